//! The connection of a worker, from its hello to its end.

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use lookalike::graph::{BlobHash, NodeFailure, NodeId, WorkerId};
use lookalike::protocol::{
    self as protocol, FailureKind, IncomingBlob, LeaseName, PART_BYTES, ToCoordinator, ToWorker, Welcome, bounded_text,
};
use lookalike_worker::wire::{Incoming, Parcel, Received, WireError};
use lookalike_worker::world::World;
use tokio::io::{AsyncRead, AsyncWrite, AsyncWriteExt};
use tokio::sync::mpsc::Sender;
use tokio::sync::oneshot;
use tokio::time::{Instant, MissedTickBehavior, interval_at, timeout};
use tracing::info;

use super::gate::{Gate, Greeted};
use super::inbound::Inbound;
use super::mailbox::{Patient, Postman, mailbox};
use super::outgoing::Outgoing;
use crate::events::{Departure, Site};
use crate::reactor::{Event, Executing};

/// How many bytes of small outputs a worker may send before the connection waits until the reactor has processed them (8 MiB).
const UNASKED_BYTES: u64 = 8 << 20;

/// Serve a worker until its connection ends.
pub(super) async fn serve<W: World>(greeted: Greeted<W::Stream>, worker: WorkerId, peer: SocketAddr, gate: &Gate<W>) {
    let Greeted { incoming, writer, hello } = greeted;
    info!(%worker, %peer, process = hello.process, build = bounded_text(&hello.build), "joined");
    let (mailbox, postman) = mailbox(gate.limits.queued_bytes);
    let (heartbeat_ms, drain_ms) = (milliseconds(gate.policy.heartbeat), milliseconds(gate.policy.drain_time));
    let silence_ms = milliseconds(gate.policy.silence());
    let welcome = Welcome { worker: worker.0, run: gate.run, epoch: gate.epoch, heartbeat_ms, silence_ms, drain_ms };
    mailbox.send(Outgoing::Message(ToWorker::Welcome(welcome)));
    if gate.inbound.send(Inbound::Joined { worker, hello, mailbox }).await.is_err() {
        return;
    }
    let pending_blobs = Arc::new(AtomicUsize::new(0));
    let mut reader = Reader {
        worker,
        epoch: gate.epoch,
        output: None,
        unasked_bytes: 0,
        pending_blobs: Arc::clone(&pending_blobs),
        max_pending_blobs: gate.limits.pending_blobs,
        heartbeat: gate.policy.heartbeat,
        told: incoming.heard(),
        incoming,
        inbound: gate.inbound.clone(),
    };
    let mut reading = std::pin::pin!(reader.read_to_the_end());
    let (overflowing, closed) = (postman.overflowing(), postman.closed());
    let writer = Patient::new(writer, gate.policy.lost_after);
    let departure = tokio::select! {
        biased;
        // Closed by the reactor, which has recorded the reason.
        () = closed => return,
        () = overflowing => Departure::TooSlow,
        departure = &mut reading => departure,
        written = write(writer, postman, gate.policy.heartbeat, &pending_blobs) => match written {
            // All messages are sent. Wait for the worker to close: closing with unread bytes would destroy the last message to
            // it.
            Ok(()) => timeout(gate.limits.farewell_time, reading).await.unwrap_or(Departure::Lost),
            Err(WireError::Stream(error)) if error.kind() == io::ErrorKind::TimedOut => Departure::TooSlow,
            Err(error) => departure_of(&error),
        },
    };
    info!(%worker, %departure, "left");
    let left = Event::WorkerLeft { worker, departure };
    // An error means that the run is over.
    let _ = gate.inbound.send(Inbound::Event(left)).await;
}

async fn write(
    mut writer: Patient<impl AsyncWrite + Unpin>,
    mut postman: Postman,
    heartbeat: Duration,
    pending_blobs: &AtomicUsize,
) -> Result<(), WireError> {
    let (mut together, mut parcel) = (Vec::new(), Parcel::default());
    // Heartbeats let the worker notice a dead coordinator whatever it is waiting for.
    let mut heart = interval_at(Instant::now() + heartbeat, heartbeat);
    heart.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        tokio::select! {
            biased;
            is_open = postman.take(&mut together) => match is_open {
                true => {}
                false => break,
            },
            _ = heart.tick() => parcel.add(&ToWorker::Heartbeat)?,
        }
        for next in together.drain(..) {
            match next {
                Outgoing::Message(message) => parcel.add(&message)?,
                Outgoing::Blob(blob) => {
                    parcel.add(&ToWorker::Blob { hash: blob.hash().0, length: blob.len() as u64 })?;
                    parcel.add_blob(&blob, &mut writer).await?;
                    pending_blobs.fetch_sub(1, Ordering::Relaxed);
                }
                Outgoing::NoBlob => _ = pending_blobs.fetch_sub(1, Ordering::Relaxed),
            }
            if parcel.is_full() {
                parcel.send(&mut writer).await?;
            }
        }
        parcel.send(&mut writer).await?;
    }
    writer.shutdown().await?;
    Ok(())
}

fn milliseconds(time: Duration) -> u32 {
    u32::try_from(time.as_millis()).unwrap_or(u32::MAX).max(1)
}

fn departure_of(error: &WireError) -> Departure {
    if error.is_violation() { Departure::Violation(error.to_string()) } else { Departure::Lost }
}

/// The reading half of a worker's connection.
struct Reader<R> {
    worker: WorkerId,
    /// The epoch of this coordinator, and of every lease that it gives out.
    epoch: u64,
    incoming: Incoming<R>,
    /// The output that is being received.
    output: Option<(LeaseName, IncomingBlob)>,
    /// The announced lengths of outputs since the reactor was last asked.
    unasked_bytes: u64,
    pending_blobs: Arc<AtomicUsize>,
    max_pending_blobs: usize,
    heartbeat: Duration,
    /// When the reactor last received a sign of life.
    told: Instant,
    inbound: Sender<Inbound>,
}

impl<R: AsyncRead + Unpin> Reader<R> {
    async fn read_to_the_end(&mut self) -> Departure {
        loop {
            let event = match self.next().await {
                Ok(None) => return Departure::Lost,
                Ok(Some(Received::Message(ToCoordinator::Goodbye))) => return Departure::Goodbye,
                Ok(Some(received)) => self.event(received).await,
                Err(error) => Err(error),
            };
            match event {
                // An error means that the run is over. Then keep reading until the worker has closed its end: closing with unread
                // bytes would destroy the last message to it.
                Ok(Some(event)) => {
                    self.told = self.incoming.heard();
                    _ = self.inbound.send(event).await;
                }
                // The first part of the output follows.
                Ok(None) => {}
                Err(error) => return departure_of(&error),
            }
        }
    }

    /// Read the next message or part. While a long one arrives slowly, its bytes count as signs of life.
    async fn next(&mut self) -> Result<Option<Received<ToCoordinator>>, WireError> {
        loop {
            if let Some(received) = self.incoming.complete()? {
                return Ok(Some(received));
            }
            if self.incoming.heard() >= self.told + self.heartbeat {
                self.told = self.incoming.heard();
                // An error means that the run is over.
                _ = self.inbound.send(Inbound::Event(self.life())).await;
            }
            if !self.incoming.read().await? {
                return Ok(None);
            }
        }
    }

    async fn event(&mut self, received: Received<ToCoordinator>) -> Result<Option<Inbound>, WireError> {
        let worker = self.worker;
        let message = match received {
            Received::Message(message) => message,
            Received::Part(part) => {
                let Some((_, output)) = &mut self.output else {
                    return Err(WireError::unexpected("a message", "a part of an output"));
                };
                output.push(&part)?;
                return Ok(Some(self.output()?.unwrap_or_else(|| Inbound::Event(self.life()))));
            }
        };
        Ok(Some(Inbound::Event(match message {
            ToCoordinator::Heartbeat { executing } => {
                let executing = executing.iter().map(|node| self.executing(node)).collect::<Result<_, _>>()?;
                Event::Heartbeat { worker, executing }
            }
            ToCoordinator::Started(lease) => {
                self.check_epoch(lease)?;
                let event = Event::Started { worker, node: NodeId(lease.node), attempt: lease.attempt };
                return Ok(Some(Inbound::Timed { arrived: self.incoming.heard(), event }));
            }
            ToCoordinator::Fetch { hash } => {
                if self.pending_blobs.fetch_add(1, Ordering::Relaxed) >= self.max_pending_blobs {
                    return Err(WireError::unexpected(
                        "a worker that reads the blobs it requested",
                        "too many requests for blobs",
                    ));
                }
                Event::BlobRequested { worker, hash: BlobHash(hash) }
            }
            ToCoordinator::Finished { lease, hash, length } => {
                if self.output.is_some() {
                    return Err(WireError::unexpected("the rest of an output", "another output"));
                }
                self.check_epoch(lease)?;
                self.output = Some((lease, IncomingBlob::begin(BlobHash(hash), length)?));
                self.ask_before(lease, length).await?;
                return self.output();
            }
            ToCoordinator::Failed { lease, kind, message } => {
                self.check_epoch(lease)?;
                let failure = failure(kind, bounded_text(&message));
                Event::Failed { site: Site::Worker(worker), node: NodeId(lease.node), attempt: lease.attempt, failure }
            }
            ToCoordinator::Draining => Event::WorkerDrains { worker },
            ToCoordinator::Hello(_) | ToCoordinator::Goodbye => {
                return Err(WireError::unexpected("work", "a greeting"));
            }
        })))
    }

    /// Check that this coordinator gave out a lease. (Workers drop the leases of earlier epochs when they join.)
    fn check_epoch(&self, lease: LeaseName) -> Result<(), WireError> {
        if lease.epoch == self.epoch {
            return Ok(());
        }
        let found = format!("one of epoch {} in epoch {}", lease.epoch, self.epoch);
        Err(WireError::unexpected("a lease of this coordinator", found))
    }

    fn executing(&self, node: &protocol::Executing) -> Result<Executing, WireError> {
        let protocol::Executing { lease, permille } = *node;
        self.check_epoch(lease)?;
        Ok(Executing { node: NodeId(lease.node), attempt: lease.attempt, permille: permille.min(1000) })
    }

    fn life(&self) -> Event {
        Event::Alive { worker: self.worker }
    }

    /// Before receiving a large output, ask the reactor whether its lease was given out. The answer also implies that earlier
    /// outputs were processed, so at most one large output per worker waits in memory. An output of one frame has arrived
    /// already.
    async fn ask_before(&mut self, lease: LeaseName, length: u64) -> Result<(), WireError> {
        self.unasked_bytes = self.unasked_bytes.saturating_add(length);
        if length <= PART_BYTES as u64 && self.unasked_bytes <= UNASKED_BYTES {
            return Ok(());
        }
        self.unasked_bytes = length;
        let (answer, answered) = oneshot::channel();
        let _ = self.inbound.send(Inbound::Ask { lease, answer }).await;
        match answered.await {
            Ok(false) => {
                let found = format!("one for node {}, attempt {}", lease.node, lease.attempt);
                Err(WireError::unexpected("an output for a lease that was given out", found))
            }
            // An error means that the run is over.
            Ok(true) | Err(_) => Ok(()),
        }
    }

    /// Take the output, if it is complete.
    fn output(&mut self) -> Result<Option<Inbound>, WireError> {
        let Some((lease, output)) = self.output.take_if(|(_, output)| output.is_complete()) else {
            return Ok(None);
        };
        let (worker, output) = (self.worker, output.finish()?);
        let (site, node, attempt) = (Site::Worker(worker), NodeId(lease.node), lease.attempt);
        let event = Event::Finished { site, node, attempt, output };
        Ok(Some(Inbound::Timed { arrived: self.incoming.heard(), event }))
    }
}

fn failure(kind: FailureKind, message: String) -> NodeFailure {
    match kind {
        FailureKind::Application => NodeFailure::Application { message },
        FailureKind::Panic => NodeFailure::Panicked { message },
        FailureKind::UnknownKind => NodeFailure::UnknownKind { message },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lookalike::protocol::{FrameTag, encode_message, frame_header};
    use tokio::io::duplex;
    use tokio::sync::mpsc::channel;
    use tokio::time::{Instant, sleep};

    const HEARTBEAT: Duration = Duration::from_secs(1);

    fn reader<R: AsyncRead + Unpin>(stream: R, inbound: Sender<Inbound>) -> Reader<R> {
        let incoming = Incoming::new(stream);
        Reader {
            worker: WorkerId(1),
            epoch: 1,
            output: None,
            unasked_bytes: 0,
            pending_blobs: Arc::default(),
            max_pending_blobs: 1,
            heartbeat: HEARTBEAT,
            told: incoming.heard(),
            incoming,
            inbound,
        }
    }

    #[tokio::test(start_paused = true)]
    async fn partial_frames_on_a_slow_connection_renew_the_lease() {
        let (mut near, far) = duplex(1 << 20);
        let (inbound, mut events) = channel(1024);
        let reading = tokio::spawn(async move { reader(far, inbound).read_to_the_end().await });
        let output = vec![7; 50_000];
        let lease = LeaseName { node: 3, attempt: 1, epoch: 1 };
        let hash = lookalike::graph::Blob::new(output.clone()).hash().0;
        let announced = encode_message(&ToCoordinator::Finished { lease, hash, length: 50_000 }).unwrap();
        near.write_all(&frame_header(FrameTag::Message, announced.len()).unwrap()).await.unwrap();
        near.write_all(&announced).await.unwrap();
        near.write_all(&frame_header(FrameTag::Part, output.len()).unwrap()).await.unwrap();
        let began = Instant::now();
        for piece in output.chunks(1000) {
            sleep(HEARTBEAT / 2).await;
            near.write_all(piece).await.unwrap();
        }
        drop(near);
        assert_eq!(reading.await.unwrap(), Departure::Lost);
        let took = began.elapsed();
        let (mut signs, mut finished) = (0, 0);
        while let Some(event) = events.recv().await {
            match event {
                Inbound::Event(Event::Alive { .. }) => signs += 1,
                Inbound::Timed { event: Event::Finished { .. }, .. } => finished += 1,
                other => panic!("{other:?}"),
            }
        }
        assert_eq!((took, finished), (25 * HEARTBEAT, 1));
        assert!((20..=25).contains(&signs), "{signs} in 25 heartbeats");
    }

    #[tokio::test(start_paused = true)]
    async fn idle_coordinator_sends_a_heartbeat_every_interval() {
        let (near, far) = duplex(1 << 20);
        let (mailbox, postman) = mailbox(1000);
        let writing = tokio::spawn(async move {
            write(Patient::new(near, HEARTBEAT), postman, HEARTBEAT, &AtomicUsize::new(0)).await
        });
        let mut incoming = Incoming::new(far);
        let began = Instant::now();
        for _ in 0..5 {
            assert_eq!(incoming.message::<ToWorker>().await.unwrap(), ToWorker::Heartbeat);
        }
        assert_eq!(began.elapsed(), 5 * HEARTBEAT);
        drop(mailbox);
        writing.await.unwrap().unwrap();
    }
}
