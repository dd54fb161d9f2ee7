//! The sockets: accepts connections, admits workers that know the secret, and turns their messages into events.
//!
//! A connection that has not proved the secret gets few resources: a place that a newer connection may take, a short time, a
//! TLS handshake, and messages of fixed length that need no decoder. A worker gets two tasks, one that reads and one that writes, so that a large blob
//! in one direction never blocks the other. [`Limits`](crate::limits::Limits) holds the bounds for both.

mod gate;
mod inbound;
mod mailbox;
mod member;
mod outgoing;
mod places;

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use lookalike::graph::WorkerId;
use lookalike::protocol::{FrameReader, HandshakeError, ProofKey, ToCoordinator, bounded_text};
use lookalike_worker::tls::{TlsError, channel_binding};
use lookalike_worker::wire::{Incoming, WireError, greet_worker};
use lookalike_worker::world::World;
use tokio::io::split;
use tokio::task::JoinSet;
use tokio::time::{sleep, timeout};
use tokio_util::sync::CancellationToken;
use tracing::{debug, warn};

pub(crate) use self::gate::Gate;
use self::gate::Greeted;
pub(crate) use self::inbound::Inbound;
pub(crate) use self::mailbox::Mailbox;
pub(crate) use self::outgoing::Outgoing;
use self::places::{Place, Places};
use crate::limits::ACCEPT_PAUSE;
use crate::tls::accept;

/// Accept workers until `stop`, then give the connected ones some time to close.
pub(crate) async fn serve_forever<W: World>(listener: W::Listener, gate: Gate<W>, stop: CancellationToken) {
    let limits = gate.limits;
    let gate = Arc::new(gate);
    let places = Places::new(limits.unauthenticated);
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
        let (gate, next_worker, place) = (Arc::clone(&gate), Arc::clone(&next_worker), places.enter());
        connections.spawn(async move {
            match greet(stream, place, &gate).await {
                Ok(connection) => {
                    let worker = WorkerId(next_worker.fetch_add(1, Ordering::Relaxed));
                    member::serve(connection, worker, peer, &gate).await;
                }
                Err(error) => report_refusal(peer, &error),
            }
        });
    }
    drop(listener);
    // Each connection ends once its mailbox is dropped and the worker has closed its end.
    let all_gone = async { while connections.join_next().await.is_some() {} };
    let _ = timeout(limits.farewell_time, all_gone).await;
    connections.shutdown().await;
}

/// Report a failed handshake. If the peer is a Lookalike worker with a wrong secret or version, the user is warned. Other failures
/// are only logged for debugging.
fn report_refusal(peer: SocketAddr, error: &WireError) {
    if means_us(error) {
        warn!(%peer, "refused: {error}");
    } else {
        debug!(%peer, "no worker: {error}");
    }
}

/// Whether a connection that failed came from a Lookalike worker. Port scanners and browsers do not send the greeting.
fn means_us(error: &WireError) -> bool {
    matches!(error, WireError::Handshake(why) if *why != HandshakeError::Magic)
}

/// Perform the handshake, within its time and while no newer connection takes the place.
async fn greet<W: World>(stream: W::Stream, place: Place, gate: &Gate<W>) -> Result<Greeted<W::Stream>, WireError> {
    tokio::select! {
        biased;
        greeted = timeout(gate.limits.handshake_time, handshake(stream, gate)) => {
            greeted.map_err(|_| WireError::TimedOut)?
        }
        () = place.is_needed() => Err(io::Error::other("too many unauthenticated connections at a time").into()),
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
        other => Err(WireError::unexpected("a hello", bounded_text(&format!("{other:?}")))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lookalike::protocol::Refusal;

    #[test]
    fn only_a_refused_lookalike_worker_is_a_warning() {
        let version = HandshakeError::Version { expected: 2, found: 1 };
        for known in [HandshakeError::Refused(Refusal::WrongSecret), HandshakeError::Impostor, version] {
            assert!(means_us(&WireError::Handshake(known)));
        }
        assert!(!means_us(&WireError::Handshake(HandshakeError::Magic)));
        assert!(!means_us(&WireError::Ended) && !means_us(&WireError::TimedOut));
    }
}
