//! The sockets: strangers come in, workers that know the secret come through, their messages become events.
//!
//! A stranger gets little: a bounded number of them at a time, a short time, fixed lengths, no decoder. A worker gets two
//! tasks, one that reads and one that writes, so that a large blob in one direction never blocks the other.

use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::time::Duration;

use lookalike::graph::{Blob, BlobHash, NodeFailure, NodeId, WorkerId};
use lookalike::protocol::{
    FailureKind, HandshakeError, Hello, IncomingBlob, LeaseName, RunName, Secret, ToCoordinator, ToWorker, Welcome,
    bounded_text,
};
use lookalike_worker::wire::{Incoming, Received, WireError, greet_worker, send_message, send_parts};
use tokio::io::AsyncWriteExt;
use tokio::net::tcp::{OwnedReadHalf, OwnedWriteHalf};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::Semaphore;
use tokio::sync::mpsc::{Sender, UnboundedReceiver, UnboundedSender, unbounded_channel};
use tokio::task::JoinSet;
use tokio::time::{sleep, timeout};
use tokio_util::sync::CancellationToken;
use tracing::{debug, info, warn};

use crate::comm::{Departure, RunEvent, Site};
use crate::reactor::Event;

/// How long a stranger may take to prove the secret and say hello.
const GREETING_TIME: Duration = Duration::from_secs(10);
/// How long a worker may take to close its end after we have said our last word.
const FAREWELL_TIME: Duration = Duration::from_secs(2);
/// How many strangers may try at a time; further ones are closed at once.
const MAX_STRANGERS: usize = 64;
/// How many workers may be connected at a time.
const MAX_CONNECTIONS: usize = 4096;
/// How many blobs a worker may be waiting for: it has a few leases with at most 4096 inputs each.
const MAX_PENDING_BLOBS: usize = 1 << 16;
/// The pause after the system refuses to accept a connection, such as for want of file descriptors.
const ACCEPT_PAUSE: Duration = Duration::from_millis(100);

/// What comes from the sockets.
#[derive(Debug)]
pub(crate) enum Inbound {
    /// A worker has said hello. What is sent to `outgoing` goes to it; dropping `outgoing` ends the connection.
    Joined { worker: WorkerId, hello: Hello, outgoing: UnboundedSender<Outgoing> },
    /// Something happened.
    Event(Event),
    /// Something to tell the user that the reactor does not care about.
    Tell(RunEvent),
}

/// What goes to a worker.
#[derive(Debug)]
pub(crate) enum Outgoing {
    Message(ToWorker),
    Blob(Blob),
}

/// What every connection of a run needs.
#[derive(Debug)]
pub(crate) struct Gate {
    pub(crate) secret: Secret,
    pub(crate) run: RunName,
    pub(crate) epoch: u64,
    pub(crate) heartbeat: Duration,
    pub(crate) inbound: Sender<Inbound>,
}

/// Let workers in until `stop`, then give the connected ones a moment to take their leave.
pub(crate) async fn serve_forever(listener: TcpListener, gate: Gate, stop: CancellationToken) {
    let gate = Arc::new(gate);
    let strangers = Arc::new(Semaphore::new(MAX_STRANGERS));
    let next_worker = Arc::new(AtomicU64::new(1));
    let mut connections = JoinSet::new();
    loop {
        let accepted = tokio::select! {
            () = stop.cancelled() => break,
            Some(_) = connections.join_next() => continue,
            accepted = listener.accept() => accepted,
        };
        let (stream, peer) = match accepted {
            Ok(accepted) => accepted,
            Err(error) => {
                warn!(%error, "cannot accept a connection");
                sleep(ACCEPT_PAUSE).await;
                continue;
            }
        };
        let Ok(permit) = Arc::clone(&strangers).try_acquire_owned() else {
            debug!(%peer, "too many strangers at a time");
            continue;
        };
        if connections.len() >= MAX_CONNECTIONS {
            warn!(%peer, "too many connections, closing a new one");
            continue;
        }
        let (gate, next_worker) = (Arc::clone(&gate), Arc::clone(&next_worker));
        connections.spawn(async move {
            let greeted = timeout(GREETING_TIME, greet(stream, &gate.secret)).await.map_err(|_| WireError::TimedOut);
            drop(permit);
            match greeted.and_then(|greeted| greeted) {
                Ok(connection) => {
                    let worker = WorkerId(next_worker.fetch_add(1, Ordering::Relaxed));
                    serve_worker(connection, worker, peer, &gate).await;
                }
                Err(error) => report_stranger(peer, &error),
            }
        });
    }
    drop(listener);
    // Each connection ends by itself once its `outgoing` is dropped and the worker has closed its end.
    let all_gone = async { while connections.join_next().await.is_some() {} };
    let _ = timeout(FAREWELL_TIME, all_gone).await;
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

type Greeted = (Incoming<OwnedReadHalf>, OwnedWriteHalf, Hello);

async fn greet(mut stream: TcpStream, secret: &Secret) -> Result<Greeted, WireError> {
    stream.set_nodelay(true)?;
    let mut nonce = [0; 32];
    getrandom::fill(&mut nonce).map_err(std::io::Error::other)?;
    greet_worker(&mut stream, secret, nonce).await?;
    let (reader, writer) = stream.into_split();
    let mut incoming = Incoming::new(reader);
    match incoming.message().await? {
        ToCoordinator::Hello(hello) => Ok((incoming, writer, hello)),
        other => Err(WireError::Unexpected { expected: "a hello", found: bounded_text(&format!("{other:?}")) }),
    }
}

async fn serve_worker((incoming, writer, hello): Greeted, worker: WorkerId, peer: SocketAddr, gate: &Gate) {
    info!(%worker, %peer, process = hello.process, build = bounded_text(&hello.build), "joined");
    let (outgoing, queue) = unbounded_channel();
    let heartbeat_ms = u32::try_from(gate.heartbeat.as_millis()).unwrap_or(u32::MAX).max(1);
    let welcome = Welcome { worker: worker.0, run: gate.run, epoch: gate.epoch, heartbeat_ms };
    // The receiver is alive: it is ours.
    let _ = outgoing.send(Outgoing::Message(ToWorker::Welcome(welcome)));
    if gate.inbound.send(Inbound::Joined { worker, hello, outgoing }).await.is_err() {
        return;
    }
    let pending_blobs = Arc::new(AtomicUsize::new(0));
    let mut reader = Reader {
        worker,
        incoming,
        output: None,
        pending_blobs: Arc::clone(&pending_blobs),
        inbound: gate.inbound.clone(),
    };
    let mut reading = std::pin::pin!(reader.read_to_the_end());
    let departure = tokio::select! {
        departure = &mut reading => departure,
        written = write(writer, queue, &pending_blobs) => match written {
            // We have said our last word: let the worker say its own, so that closing does not destroy ours.
            Ok(()) => timeout(FAREWELL_TIME, reading).await.unwrap_or(Departure::Lost),
            Err(error) => departure_of(&error),
        },
    };
    info!(%worker, %departure, "left");
    let left = Event::WorkerLeft { worker, departure };
    // When nobody listens any more the run is over.
    let _ = gate.inbound.send(Inbound::Event(left)).await;
}

async fn write(
    mut writer: OwnedWriteHalf,
    mut queue: UnboundedReceiver<Outgoing>,
    pending_blobs: &AtomicUsize,
) -> Result<(), WireError> {
    while let Some(next) = queue.recv().await {
        match next {
            Outgoing::Message(message) => send_message(&mut writer, &message).await?,
            Outgoing::Blob(blob) => {
                let announcement = ToWorker::Blob { hash: blob.hash().0, length: blob.len() as u64 };
                send_message(&mut writer, &announcement).await?;
                send_parts(&mut writer, &blob).await?;
                pending_blobs.fetch_sub(1, Ordering::Relaxed);
            }
        }
    }
    writer.shutdown().await?;
    Ok(())
}

fn departure_of(error: &WireError) -> Departure {
    if error.is_violation() { Departure::Violation(error.to_string()) } else { Departure::Lost }
}

/// The reading end of one worker's connection.
struct Reader {
    worker: WorkerId,
    incoming: Incoming<OwnedReadHalf>,
    /// The output that is being received.
    output: Option<(LeaseName, IncomingBlob)>,
    pending_blobs: Arc<AtomicUsize>,
    inbound: Sender<Inbound>,
}

impl Reader {
    async fn read_to_the_end(&mut self) -> Departure {
        loop {
            let event = match self.incoming.next().await {
                Ok(None) => return Departure::Lost,
                Ok(Some(Received::Message(ToCoordinator::Goodbye))) => return Departure::Goodbye,
                Ok(Some(received)) => self.event(received),
                Err(error) => Err(error),
            };
            match event {
                // When nobody listens any more the run is over. Then we still read until the worker has closed its end:
                // closing over unread bytes would destroy our last word to it.
                Ok(event) => _ = self.inbound.send(Inbound::Event(event)).await,
                Err(error) => return departure_of(&error),
            }
        }
    }

    fn event(&mut self, received: Received<ToCoordinator>) -> Result<Event, WireError> {
        let worker = self.worker;
        let site = Site::Worker(worker);
        let message = match received {
            Received::Message(message) => message,
            Received::Part(part) => {
                let Some((_, output)) = &mut self.output else {
                    return Err(unexpected("a message", "a part of an output"));
                };
                output.push(&part)?;
                return self.output_or_life();
            }
        };
        Ok(match message {
            ToCoordinator::Heartbeat { executing } => {
                let executing = executing.iter().map(|node| (NodeId(node.lease.node), node.permille.min(1000)));
                Event::Heartbeat { worker, executing: executing.collect() }
            }
            ToCoordinator::Started(lease) => {
                Event::Started { worker, node: NodeId(lease.node), attempt: lease.attempt }
            }
            ToCoordinator::Fetch { hash } => {
                if self.pending_blobs.fetch_add(1, Ordering::Relaxed) >= MAX_PENDING_BLOBS {
                    return Err(unexpected("a worker that reads what it asked for", "still more requests for blobs"));
                }
                Event::BlobRequested { worker, hash: BlobHash(hash) }
            }
            ToCoordinator::Finished { lease, hash, length } => {
                if self.output.is_some() {
                    return Err(unexpected("the rest of an output", "another output"));
                }
                self.output = Some((lease, IncomingBlob::begin(BlobHash(hash), length)?));
                return self.output_or_life();
            }
            ToCoordinator::Failed { lease, kind, message } => {
                let message = bounded_text(&message);
                let failure = match kind {
                    FailureKind::Application => NodeFailure::Application { message },
                    FailureKind::Panic => NodeFailure::Panicked { message },
                    FailureKind::UnknownKind => NodeFailure::UnknownKind { message },
                };
                Event::Failed { site, node: NodeId(lease.node), attempt: lease.attempt, failure }
            }
            ToCoordinator::Hello(_) | ToCoordinator::Goodbye => return Err(unexpected("work", "a greeting")),
        })
    }

    /// The output, if it is complete; else a sign of life.
    fn output_or_life(&mut self) -> Result<Event, WireError> {
        let Some((lease, output)) = self.output.take_if(|(_, output)| output.is_complete()) else {
            return Ok(Event::Heartbeat { worker: self.worker, executing: Vec::new() });
        };
        let (node, attempt) = (NodeId(lease.node), lease.attempt);
        Ok(Event::Finished { site: Site::Worker(self.worker), node, attempt, output: output.finish()? })
    }
}

fn unexpected(expected: &'static str, found: &str) -> WireError {
    WireError::Unexpected { expected, found: found.to_owned() }
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
