//! TLS on a connection: the coordinator's side. See [`lookalike_worker::tls`] for the worker's, and for why it is as it is.

use std::io;
use std::sync::Arc;

use lookalike_worker::tls::{Transport, provider, transport};
use rustls::ServerConfig;
use rustls::server::NoServerSessionStorage;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio_rustls::{TlsAcceptor, server};

use crate::access::Identity;

/// How a coordinator of this identity speaks TLS: version 1.3 only, no certificates of workers, no session ever resumed, nothing
/// before the handshake is over.
///
/// # Errors
/// When the identity's key is not that of its certificate.
pub fn server_config(identity: &Identity) -> Result<ServerConfig, rustls::Error> {
    let mut config = ServerConfig::builder_with_provider(provider())
        .with_protocol_versions(&[&rustls::version::TLS13])?
        .with_no_client_auth()
        .with_single_cert(vec![identity.certificate().clone()], identity.key())?;
    config.session_storage = Arc::new(NoServerSessionStorage {});
    config.send_tls13_tickets = 0;
    config.max_early_data_size = 0;
    Ok(config)
}

/// Speak TLS as the coordinator with whoever is at the other end of `stream`.
///
/// # Errors
/// When the stream fails, or the other side does not speak TLS 1.3.
pub async fn accept<S>(acceptor: &TlsAcceptor, stream: S) -> io::Result<server::TlsStream<Transport<S>>>
where
    S: AsyncRead + AsyncWrite + Unpin,
{
    acceptor.accept(transport(stream)).await
}
