//! TLS on a connection: the coordinator's side. [`lookalike_worker::tls`] has the worker's side, and the reasons for the choices.

use std::io;
use std::sync::Arc;

use lookalike_worker::tls::{Transport, provider, transport};
use rustls::ServerConfig;
use rustls::server::NoServerSessionStorage;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio_rustls::{TlsAcceptor, server};

use crate::access::Identity;

/// The TLS configuration of a coordinator with this identity: TLS 1.3 only, no client certificates, no resumed sessions, no early
/// data.
///
/// # Errors
/// When the key does not belong to the certificate.
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

/// Perform the TLS handshake as the coordinator.
///
/// # Errors
/// When the stream fails, or the peer does not speak TLS 1.3.
pub async fn accept<S>(acceptor: &TlsAcceptor, stream: S) -> io::Result<server::TlsStream<Transport<S>>>
where
    S: AsyncRead + AsyncWrite + Unpin,
{
    acceptor.accept(transport(stream)).await
}
