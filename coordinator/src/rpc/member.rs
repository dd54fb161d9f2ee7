//! A worker's connection, from its hello to its end.

use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use lookalike::graph::{BlobHash, NodeFailure, NodeId, WorkerId};
use lookalike::protocol::{FailureKind, IncomingBlob, LeaseName, ToCoordinator, ToWorker, Welcome, bounded_text};
use lookalike_worker::wire::{Incoming, Received, WireError, send_message, send_parts};
use tokio::io::{AsyncWriteExt, ReadHalf, WriteHalf};
use tokio::sync::mpsc::{Sender, UnboundedReceiver, unbounded_channel};
use tokio::time::timeout;
use tracing::info;

use super::{Connection, Gate, Greeted, Inbound, Outgoing};
use crate::comm::{Departure, Site};
use crate::reactor::Event;

/// Serve a worker to its end.
pub(super) async fn serve(greeted: Greeted, worker: WorkerId, peer: SocketAddr, gate: &Gate) {
    let Greeted { incoming, writer, hello } = greeted;
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
        epoch: gate.epoch,
        has_reported: gate.epoch == 1,
        incoming,
        output: None,
        pending_blobs: Arc::clone(&pending_blobs),
        max_pending_blobs: gate.limits.pending_blobs,
        inbound: gate.inbound.clone(),
    };
    let mut reading = std::pin::pin!(reader.read_to_the_end());
    let departure = tokio::select! {
        departure = &mut reading => departure,
        written = write(writer, queue, &pending_blobs) => match written {
            // We have said our last word: let the worker say its own, so that closing does not destroy ours.
            Ok(()) => timeout(gate.limits.farewell_time, reading).await.unwrap_or(Departure::Lost),
            Err(error) => departure_of(&error),
        },
    };
    info!(%worker, %departure, "left");
    let left = Event::WorkerLeft { worker, departure };
    // When nobody listens any more the run is over.
    let _ = gate.inbound.send(Inbound::Event(left)).await;
}

async fn write(
    mut writer: WriteHalf<Connection>,
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
    /// That of this coordinator.
    epoch: u64,
    /// Whether it has told what it does for earlier ones.
    has_reported: bool,
    incoming: Incoming<ReadHalf<Connection>>,
    /// The output that is being received.
    output: Option<(LeaseName, IncomingBlob)>,
    pending_blobs: Arc<AtomicUsize>,
    max_pending_blobs: usize,
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
                Ok(event) => _ = self.inbound.send(event).await,
                Err(error) => return departure_of(&error),
            }
        }
    }

    fn event(&mut self, received: Received<ToCoordinator>) -> Result<Inbound, WireError> {
        let worker = self.worker;
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
        Ok(Inbound::Event(match message {
            ToCoordinator::Heartbeat { executing } if !self.has_reported => {
                self.has_reported = true;
                let earlier = executing.iter().map(|node| node.lease).filter(|lease| lease.epoch < self.epoch);
                return Ok(Inbound::Reported { worker, executing: earlier.collect() });
            }
            ToCoordinator::Heartbeat { executing } => {
                // What was begun for an earlier coordinator has another number there.
                let executing = executing.iter().filter(|node| node.lease.epoch == self.epoch);
                let executing = executing.map(|node| (NodeId(node.lease.node), node.permille.min(1000)));
                Event::Heartbeat { worker, executing: executing.collect() }
            }
            ToCoordinator::Started(lease) if self.is_ours(lease)? => {
                Event::Started { worker, node: NodeId(lease.node), attempt: lease.attempt }
            }
            ToCoordinator::Started(_) => self.life(),
            ToCoordinator::Fetch { hash } => {
                if self.pending_blobs.fetch_add(1, Ordering::Relaxed) >= self.max_pending_blobs {
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
                if !self.is_ours(lease)? {
                    return Ok(Inbound::Late { worker, lease, output: None });
                }
                let failure = failure(kind, bounded_text(&message));
                Event::Failed { site: Site::Worker(worker), node: NodeId(lease.node), attempt: lease.attempt, failure }
            }
            ToCoordinator::Hello(_) | ToCoordinator::Goodbye => return Err(unexpected("work", "a greeting")),
        }))
    }

    /// Whether this coordinator gave out a lease; else an earlier one of the run did.
    fn is_ours(&self, lease: LeaseName) -> Result<bool, WireError> {
        if lease.epoch == 0 || lease.epoch > self.epoch {
            let found = format!("a lease of epoch {}", lease.epoch);
            return Err(WireError::Unexpected { expected: "a lease of this run", found });
        }
        Ok(lease.epoch == self.epoch)
    }

    fn life(&self) -> Event {
        Event::Heartbeat { worker: self.worker, executing: Vec::new() }
    }

    /// The output, if it is complete; else a sign of life.
    fn output_or_life(&mut self) -> Result<Inbound, WireError> {
        let Some((lease, output)) = self.output.take_if(|(_, output)| output.is_complete()) else {
            return Ok(Inbound::Event(self.life()));
        };
        let (worker, output) = (self.worker, output.finish()?);
        if !self.is_ours(lease)? {
            return Ok(Inbound::Late { worker, lease, output: Some(output) });
        }
        let (site, node, attempt) = (Site::Worker(worker), NodeId(lease.node), lease.attempt);
        Ok(Inbound::Event(Event::Finished { site, node, attempt, output }))
    }
}

fn failure(kind: FailureKind, message: String) -> NodeFailure {
    match kind {
        FailureKind::Application => NodeFailure::Application { message },
        FailureKind::Panic => NodeFailure::Panicked { message },
        FailureKind::UnknownKind => NodeFailure::UnknownKind { message },
    }
}

fn unexpected(expected: &'static str, found: &str) -> WireError {
    WireError::Unexpected { expected, found: found.to_owned() }
}
