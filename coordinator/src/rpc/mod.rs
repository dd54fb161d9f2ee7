//! The sockets: strangers come in, workers that know the secret come through, their messages become events.
//!
//! A stranger gets little: a place that the next one may need, a short time, a TLS handshake, fixed lengths, no decoder. A worker
//! gets two tasks, one that reads and one that writes, so that a large blob in one direction never blocks the other. What either
//! may cost is in [`Limits`].

mod mailbox;
mod member;
mod strangers;

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use lookalike::graph::{Blob, WorkerId};
use lookalike::protocol::{
    FrameReader, HandshakeError, Hello, LeaseName, ProofKey, RunName, Secret, ToCoordinator, ToWorker, bounded_text,
};
use lookalike_worker::tls::{TlsError, Transport, channel_binding};
use lookalike_worker::wire::{Incoming, WireError, greet_worker};
use lookalike_worker::world::World;
use tokio::io::{ReadHalf, WriteHalf, split};
use tokio::sync::mpsc::Sender;
use tokio::sync::oneshot;
use tokio::task::JoinSet;
use tokio::time::{Instant, sleep, timeout};
use tokio_rustls::{TlsAcceptor, server::TlsStream};
use tokio_util::sync::CancellationToken;
use tracing::{debug, warn};

pub(crate) use self::mailbox::Mailbox;
use self::strangers::{Place, Strangers};
use crate::events::RunEvent;
use crate::limits::Limits;
use crate::policy::Policy;
use crate::reactor::Event;
use crate::tls::accept;

/// The pause after the system refuses to accept a connection, such as for want of file descriptors.
const ACCEPT_PAUSE: Duration = Duration::from_millis(100);

/// What comes from the sockets.
#[derive(Debug)]
pub(crate) enum Inbound {
    /// A worker has said hello. What is put into the mailbox goes to it.
    Joined { worker: WorkerId, hello: Hello, mailbox: Mailbox },
    /// A worker announces an output for this lease: may it come? A lease that was never given out is answered with `false`.
    Ask { lease: LeaseName, answer: oneshot::Sender<bool> },
    /// Something happened.
    Event(Event),
    /// Something happened at this time, which matters, though it may be looked at later.
    Timed { arrived: Instant, event: Event },
    /// Something to tell the user that the reactor does not care about.
    Tell(RunEvent),
}

/// What goes to a worker.
#[derive(Debug)]
pub(crate) enum Outgoing {
    Message(ToWorker),
    Blob(Blob),
    /// Nothing, for a blob that was asked for.
    NoBlob,
}

/// What every connection of a run needs.
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

/// Let workers in until `stop`, then give the connected ones a moment to take their leave.
pub(crate) async fn serve_forever<W: World>(listener: W::Listener, gate: Gate<W>, stop: CancellationToken) {
    let limits = gate.limits;
    let gate = Arc::new(gate);
    let strangers = Strangers::new(limits.strangers);
    let next_worker = Arc::new(AtomicU64::new(1));
    let mut connections = JoinSet::new();
    loop {
        let accepted = tokio::select! {
            biased;
            () = stop.cancelled() => break,
            Some(_) = connections.join_next() => continue,
            accepted = W::accept(&listener) => accepted,
        };
        let (stream, peer) = match accepted {
            Ok(accepted) => accepted,
            Err(error) => {
                warn!(%error, "cannot accept a connection");
                sleep(ACCEPT_PAUSE).await;
                continue;
            }
        };
        if connections.len() >= limits.connections {
            warn!(%peer, "too many connections, closing a new one");
            continue;
        }
        let (gate, next_worker, place) = (Arc::clone(&gate), Arc::clone(&next_worker), strangers.enter());
        connections.spawn(async move {
            match greet(stream, place, &gate).await {
                Ok(connection) => {
                    let worker = WorkerId(next_worker.fetch_add(1, Ordering::Relaxed));
                    member::serve(connection, worker, peer, &gate).await;
                }
                Err(error) => report_stranger(peer, &error),
            }
        });
    }
    drop(listener);
    // Each connection ends by itself once its mailbox is dropped and the worker has closed its end.
    let all_gone = async { while connections.join_next().await.is_some() {} };
    let _ = timeout(limits.farewell_time, all_gone).await;
    connections.shutdown().await;
}

/// A wrong secret or version is worth a word to the user: somebody means us. Anything else is noise of the network.
fn report_stranger(peer: SocketAddr, error: &WireError) {
    if means_us(error) {
        warn!(%peer, "refused: {error}");
    } else {
        debug!(%peer, "no worker: {error}");
    }
}

/// Whether a connection that failed was a Lookalike's. Port scanners and browsers do not know the greeting.
fn means_us(error: &WireError) -> bool {
    matches!(error, WireError::Handshake(why) if *why != HandshakeError::Magic)
}

type Connection<S> = TlsStream<Transport<S>>;

/// A stranger that has become a worker.
struct Greeted<S> {
    incoming: Incoming<ReadHalf<Connection<S>>>,
    writer: WriteHalf<Connection<S>>,
    hello: Hello,
}

/// Make a worker of a stranger, in the time that it may take and as long as nobody else needs its place.
async fn greet<W: World>(stream: W::Stream, place: Place, gate: &Gate<W>) -> Result<Greeted<W::Stream>, WireError> {
    tokio::select! {
        biased;
        greeted = timeout(gate.limits.stranger_time, handshake(stream, gate)) => {
            greeted.map_err(|_| WireError::TimedOut)?
        }
        () = place.is_needed() => Err(io::Error::other("too many strangers at a time").into()),
    }
}

async fn handshake<W: World>(stream: W::Stream, gate: &Gate<W>) -> Result<Greeted<W::Stream>, WireError> {
    let mut stream = match accept(&gate.tls, stream).await {
        Ok(stream) => stream,
        Err(error) => return Err(TlsError::of_handshake(error)?.into()),
    };
    let channel = channel_binding(stream.get_ref().1).map_err(io::Error::other)?;
    let mut nonce = [0; 32];
    gate.world.fill_random(&mut nonce)?;
    greet_worker(&mut stream, &ProofKey::new(&gate.secret, &channel), nonce).await?;
    let (reader, writer) = split(stream);
    let mut incoming = Incoming::with_frames(reader, FrameReader::with_limit(gate.limits.frame_bytes));
    match incoming.message().await? {
        ToCoordinator::Hello(hello) => Ok(Greeted { incoming, writer, hello }),
        other => Err(WireError::Unexpected { expected: "a hello", found: bounded_text(&format!("{other:?}")) }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lookalike::protocol::Refusal;

    #[test]
    fn only_a_lookalike_that_is_refused_is_worth_a_warning() {
        let version = HandshakeError::Version { expected: 2, found: 1 };
        for known in [HandshakeError::Refused(Refusal::WrongSecret), HandshakeError::Impostor, version] {
            assert!(means_us(&WireError::Handshake(known)));
        }
        assert!(!means_us(&WireError::Handshake(HandshakeError::Magic)));
        assert!(!means_us(&WireError::Ended) && !means_us(&WireError::TimedOut));
    }
}
