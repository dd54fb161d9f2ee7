//! The state that connections need before and after their handshake.

use lookalike::protocol::{Hello, RunName, Secret};
use lookalike_worker::tls::Transport;
use lookalike_worker::wire::Incoming;
use tokio::io::{ReadHalf, WriteHalf};
use tokio::sync::mpsc::Sender;
use tokio_rustls::{TlsAcceptor, server::TlsStream};

use super::inbound::Inbound;
use crate::limits::Limits;
use crate::policy::Policy;

/// The state that all connections of a run share.
pub(crate) struct Gate<W> {
    pub(crate) world: W,
    pub(crate) tls: TlsAcceptor,
    pub(crate) secret: Secret,
    pub(crate) limits: Limits,
    pub(crate) run: RunName,
    pub(crate) epoch: u64,
    pub(crate) policy: Policy,
    pub(crate) inbound: Sender<Inbound>,
}

pub(super) type Connection<S> = TlsStream<Transport<S>>;

/// A connection after its handshake.
pub(super) struct Greeted<S> {
    pub(super) incoming: Incoming<ReadHalf<Connection<S>>>,
    pub(super) writer: WriteHalf<Connection<S>>,
    pub(super) hello: Hello,
}
