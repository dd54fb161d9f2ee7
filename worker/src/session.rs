//! The socket loop: connect, greet, serve the connection, and reconnect within the time limit.

use std::sync::Arc;
use std::time::Duration;

use lookalike::graph::{Blob, BlobHash, Registry};
use lookalike::protocol::{
    Access, Hello, IncomingBlob, ProcessName, ProofKey, ToCoordinator, ToWorker, TransferError, Welcome,
};
use tokio::io::{AsyncWrite, AsyncWriteExt, ReadHalf, WriteHalf, split};
use tokio::sync::Notify;
use tokio::sync::mpsc::{UnboundedReceiver, UnboundedSender, unbounded_channel};
use tokio::task::JoinHandle;
use tokio::time::{Instant, sleep, sleep_until, timeout};
use tokio_rustls::client::TlsStream;
use tracing::{debug, info, warn};

use crate::cache::BlobCache;
use crate::ending::Wishes;
use crate::error::WorkerError;
use crate::execute::{Completed, Executor};
use crate::options::WorkerOptions;
use crate::tasks::{Action, Tasks};
use crate::tls::{self, TlsError, Transport};
use crate::wire::{Incoming, Parcel, Received, WireError, greet_coordinator, is_small, send_message};
use crate::world::World;

/// How long connecting and greeting may take.
const GREETING_TIME: Duration = Duration::from_secs(10);
/// How long sending the goodbye may take when the worker ends.
const FAREWELL_TIME: Duration = Duration::from_secs(1);
/// The first pause before a new attempt to connect; each further pause is twice as long, with random jitter.
const FIRST_PAUSE: Duration = Duration::from_millis(100);
/// The longest pause between two attempts.
const LONGEST_PAUSE: Duration = Duration::from_secs(5);
/// A connection that lasted this long counts as stable; a shorter one makes the next pause longer.
const STEADY_TIME: Duration = Duration::from_secs(10);
/// Upper limit of the drain time, in effect unlimited.
const LONGEST_DRAIN: Duration = Duration::from_hours(24 * 365);

/// Work until the coordinator ends the run or this process is asked to end.
pub(crate) async fn run<W: World>(
    world: W,
    options: &WorkerOptions,
    registry: Registry,
    wishes: Wishes,
) -> Result<(), WorkerError> {
    let access = read_access(options)?;
    let address = options.address.clone().unwrap_or_else(|| access.address.clone());
    let mut name = [0; 16];
    world.fill_random(&mut name).map_err(WorkerError::Runtime)?;
    let (completed_sender, completed) = unbounded_channel();
    let threads = options.threads;
    let pool = world.start_pool(threads)?;
    let executor = Executor::new(pool, registry, options.decoded_blob_bytes, completed_sender);
    let tasks = Tasks::new(threads.get(), BlobCache::new(options.cached_blob_bytes));
    let mut session = Session {
        world,
        address,
        access,
        name: ProcessName(name),
        is_local: options.is_leashed,
        threads: threads.get(),
        wishes,
        own_drain_time: options.drain_time,
        drain_time: options.drain_time.unwrap_or_default(),
        leave_by: None,
        executor,
        completed,
        tasks,
    };
    session.keep_connected(options.reconnect_for).await
}

/// The address to which a worker with these options connects; `None` if its access file cannot be read.
pub(crate) fn address(options: &WorkerOptions) -> Option<String> {
    options.address.clone().or_else(|| read_access(options).ok().map(|access| access.address))
}

fn read_access(options: &WorkerOptions) -> Result<Access, WorkerError> {
    let path = options.access.clone();
    let text =
        std::fs::read_to_string(&path).map_err(|source| WorkerError::AccessFile { path: path.clone(), source })?;
    Access::parse(&text).map_err(|source| WorkerError::AccessContent { path, source })
}

/// How a connection ended without an error.
enum Ended {
    /// The coordinator said that the run is over.
    RunOver,
    /// This process was asked to end.
    AskedToEnd,
}

struct Session<W: World> {
    world: W,
    address: String,
    access: Access,
    name: ProcessName,
    /// Whether a coordinator started this process.
    is_local: bool,
    threads: usize,
    wishes: Wishes,
    /// The drain time from the options, which takes precedence over the coordinator's.
    own_drain_time: Option<Duration>,
    /// How long to finish running nodes. Zero before the first welcome, when there are none.
    drain_time: Duration,
    /// While draining, the time at which it ends at the latest.
    leave_by: Option<Instant>,
    executor: Executor<W::Pool>,
    completed: UnboundedReceiver<Completed>,
    tasks: Tasks,
}

impl<W: World> Session<W> {
    async fn keep_connected(&mut self, patience: Duration) -> Result<(), WorkerError> {
        let mut without_since = Instant::now();
        let mut pause = FIRST_PAUSE;
        let mut short_connections = 0;
        while !self.may_leave() {
            let (mut was_welcome, begin) = (false, Instant::now());
            let error = match self.connect_and_serve(&mut was_welcome).await {
                Ok(Ended::RunOver | Ended::AskedToEnd) => return Ok(()),
                Err(source) if source.is_final() => {
                    return Err(WorkerError::Refused { address: self.address.clone(), source });
                }
                Err(error) => error,
            };
            if was_welcome {
                without_since = Instant::now();
                short_connections = if begin.elapsed() < STEADY_TIME { short_connections + 1 } else { 0 };
                pause = (FIRST_PAUSE * 2_u32.pow(short_connections.clamp(1, 16) - 1)).min(LONGEST_PAUSE);
            }
            let after = without_since.elapsed();
            if after >= patience {
                return Err(WorkerError::CoordinatorLost { address: self.address.clone(), after, source: error });
            }
            info!(address = %self.address, %error, ?pause, "no coordinator, retrying");
            let wishes = self.wishes.clone();
            tokio::select! {
                biased;
                () = wishes.end.cancelled() => return Ok(()),
                () = wishes.drain.cancelled(), if self.leave_by.is_none() => self.begin_to_drain(),
                () = sleep_until_some(self.leave_by) => {}
                () = sleep(self.scattered(pause).min(patience - after)) => {}
            }
            pause = (pause * 2).min(LONGEST_PAUSE);
        }
        Ok(())
    }

    /// Start no more nodes, and leave when the running ones are done or the drain time is over.
    fn begin_to_drain(&mut self) {
        self.leave_by = Some(Instant::now() + self.drain_time.min(LONGEST_DRAIN));
        self.tasks.drain();
        if !self.tasks.are_done() {
            let seconds = self.drain_time.as_secs_f64();
            warn!(
                "asked to end: finishing the nodes being computed, for at most {seconds} s; signal again to end at once"
            );
        }
    }

    /// Whether this process was asked to end and its running nodes are done or the drain time is over.
    fn may_leave(&self) -> bool {
        self.leave_by.is_some_and(|leave_by| self.tasks.are_done() || Instant::now() >= leave_by)
    }

    async fn connect_and_serve(&mut self, was_welcome: &mut bool) -> Result<Ended, WireError> {
        let wishes = self.wishes.clone();
        let (incoming, writer, welcome) = tokio::select! {
            biased;
            () = wishes.end.cancelled() => return Ok(Ended::AskedToEnd),
            () = wishes.drain.cancelled(), if self.tasks.are_done() => return Ok(Ended::AskedToEnd),
            greeted = timeout(GREETING_TIME, self.greet()) => greeted.map_err(|_| WireError::TimedOut)??,
        };
        *was_welcome = true;
        info!(address = %self.address, worker = welcome.worker, "joined");
        let (outgoing, announced, mut writing) = start_writing(writer);
        let heart = Arc::new(Notify::new());
        let heartbeat = self.world.start_heart(Duration::from_millis(welcome.heartbeat_ms.into()), Arc::clone(&heart));
        let silence = Duration::from_millis(welcome.silence_ms.into());
        let mut connection = Connection { incoming, outgoing, announced, transfer: None, silence };
        self.drain_time = self.own_drain_time.unwrap_or(Duration::from_millis(welcome.drain_ms.into()));
        if self.leave_by.is_some() {
            self.act(&connection, vec![Action::Send(ToCoordinator::Draining)]);
        }
        // Executions that ended while there was no connection become answers now, before `welcomed` reports the running nodes.
        while let Ok(completed) = self.completed.try_recv() {
            // Drop the actions: there was no connection for them, and `welcomed` returns everything that must be sent.
            drop(self.tasks.completed(completed, || self.executor.context()));
        }
        let actions = self.tasks.welcomed(welcome.run, welcome.epoch);
        self.act(&connection, actions);
        let ended = tokio::select! {
            biased;
            ended = self.serve(&mut connection, &heart) => ended,
            ended = &mut writing => Err(ended.map_or(WireError::Ended, |written| written.err().unwrap_or(WireError::Ended))),
        };
        drop(heartbeat);
        drop(connection);
        if ended.is_ok() {
            // The goodbye may not be written yet. If it is lost, the coordinator detects the end of the stream.
            let _ = timeout(FAREWELL_TIME, writing).await;
        } else {
            writing.abort();
        }
        ended
    }

    async fn greet(&self) -> Result<(Incoming<Reader<W>>, Writer<W>, Welcome), WireError> {
        let stream = self.world.connect(&self.address).await?;
        let mut stream = match tls::connect(stream, self.access.certificate).await {
            Ok(stream) => stream,
            Err(error) => return Err(TlsError::of_handshake(error)?.into()),
        };
        let channel = tls::channel_binding(stream.get_ref().1).map_err(std::io::Error::other)?;
        let mut nonce = [0; 32];
        self.world.fill_random(&mut nonce)?;
        greet_coordinator(&mut stream, &ProofKey::new(&self.access.secret, &channel), nonce).await?;
        let (reader, mut writer) = split(stream);
        let threads = u32::try_from(self.threads).unwrap_or(u32::MAX);
        let (build, process) = (env!("CARGO_PKG_VERSION").to_owned(), self.world.process());
        let hello = Hello { build, threads, process, name: self.name, is_local: self.is_local };
        send_message(&mut writer, &ToCoordinator::Hello(hello)).await?;
        let mut incoming = Incoming::new(reader);
        match incoming.message().await? {
            ToWorker::Welcome(welcome) => Ok((incoming, writer, welcome)),
            other => Err(WireError::unexpected("a welcome", format!("{other:?}"))),
        }
    }

    async fn serve(&mut self, connection: &mut Connection<W>, heart: &Notify) -> Result<Ended, WireError> {
        let wishes = self.wishes.clone();
        let mut silent = std::pin::pin!(sleep_until(connection.silent_at()));
        while !self.may_leave() && !wishes.end.is_cancelled() {
            let actions = tokio::select! {
                // In this order, so that received messages are handled before nodes start: a node whose cancellation has arrived does
                // not start. Messages cannot starve the other branches, because the coordinator sends only a limited number
                // without an answer.
                biased;
                () = heart.notified() => vec![Action::Send(ToCoordinator::Heartbeat { executing: self.tasks.executing() })],
                received = connection.incoming.next() => match received?.ok_or(WireError::Ended)? {
                    Received::Message(ToWorker::Stop { reason }) => {
                        info!(reason, "the coordinator ends this worker");
                        return Ok(Ended::RunOver);
                    }
                    received => self.received(connection, received)?,
                },
                Some(serial) = connection.announced.recv() => self.tasks.announced(serial),
                Some(completed) = self.completed.recv() => self.tasks.completed(completed, || self.executor.context()),
                () = wishes.drain.cancelled(), if self.leave_by.is_none() => {
                    self.begin_to_drain();
                    vec![Action::Send(ToCoordinator::Draining)]
                }
                () = sleep_until_some(self.leave_by) => Vec::new(),
                () = wishes.end.cancelled() => Vec::new(),
                () = &mut silent => {
                    let silent_at = connection.silent_at();
                    if silent_at <= Instant::now() {
                        return Err(WireError::TimedOut);
                    }
                    silent.as_mut().reset(silent_at);
                    Vec::new()
                }
            };
            self.act(connection, actions);
        }
        self.act(connection, vec![Action::Send(ToCoordinator::Goodbye)]);
        Ok(Ended::AskedToEnd)
    }

    fn received(
        &mut self,
        connection: &mut Connection<W>,
        received: Received<ToWorker>,
    ) -> Result<Vec<Action>, WireError> {
        let new_context = || self.executor.context();
        match received {
            Received::Message(ToWorker::Assign(assignment)) => {
                debug!(label = assignment.label, lease = ?assignment.lease, "assigned");
                return Ok(self.tasks.assigned(assignment, new_context));
            }
            Received::Message(ToWorker::Cancel(lease)) => return Ok(self.tasks.cancelled(lease, new_context)),
            Received::Message(ToWorker::Acknowledge(lease)) => self.tasks.acknowledged(lease),
            Received::Message(ToWorker::Heartbeat) => {}
            Received::Message(ToWorker::Blob { hash, length }) => {
                if connection.transfer.is_some() {
                    return Err(WireError::unexpected("the rest of a blob", "another blob"));
                }
                connection.transfer = Some(IncomingBlob::begin(BlobHash(hash), length)?);
            }
            Received::Message(message @ (ToWorker::Welcome(_) | ToWorker::Stop { .. })) => {
                return Err(WireError::unexpected("work", format!("{message:?}")));
            }
            Received::Part(part) => match &mut connection.transfer {
                Some(blob) => blob.push(&part)?,
                None => return Err(WireError::unexpected("a message", "a part of a blob")),
            },
        }
        match connection.take_complete()? {
            Some(blob) => Ok(self.tasks.fetched(blob, new_context)),
            None => Ok(Vec::new()),
        }
    }

    /// Execute the actions of the tasks. Does not wait.
    fn act(&self, connection: &Connection<W>, actions: Vec<Action>) {
        for action in actions {
            let outgoing = match action {
                Action::Execute(job) => {
                    self.executor.start(job);
                    continue;
                }
                Action::Send(message) => Outgoing::Message(message),
                Action::Announce { lease, serial } => Outgoing::Announce(ToCoordinator::Started(lease), serial),
                Action::SendOutput { lease, output } => {
                    let length = output.len() as u64;
                    Outgoing::Output(ToCoordinator::Finished { lease, hash: output.hash().0, length }, output)
                }
            };
            // `connect_and_serve` detects that the writer has ended; answers are kept until acknowledged.
            let _ = connection.outgoing.send(outgoing);
        }
    }

    /// A random pause of half to all of this length, so that workers that lost one coordinator do not all reconnect at the same time.
    fn scattered(&self, pause: Duration) -> Duration {
        let mut chance = [0];
        // Without random bytes, the full pause.
        let share = self.world.fill_random(&mut chance).map_or(1.0, |()| 0.5 + f64::from(chance[0]) / 512.0);
        pause.mul_f64(share)
    }
}

type Reader<W> = ReadHalf<TlsStream<Transport<<W as World>::Stream>>>;
type Writer<W> = WriteHalf<TlsStream<Transport<<W as World>::Stream>>>;

struct Connection<W: World> {
    incoming: Incoming<Reader<W>>,
    outgoing: UnboundedSender<Outgoing>,
    announced: UnboundedReceiver<u64>,
    transfer: Option<IncomingBlob>,
    /// How long the coordinator may send nothing.
    silence: Duration,
}

impl<W: World> Connection<W> {
    /// When the connection times out, unless a byte arrives before.
    fn silent_at(&self) -> Instant {
        self.incoming.heard() + self.silence
    }

    fn take_complete(&mut self) -> Result<Option<Blob>, TransferError> {
        self.transfer.take_if(|blob| blob.is_complete()).map(IncomingBlob::finish).transpose()
    }
}

enum Outgoing {
    Message(ToCoordinator),
    /// A message, and what to report once it is written.
    Announce(ToCoordinator, u64),
    /// A message, and the blob that it announces.
    Output(ToCoordinator, Blob),
}

type Writing = JoinHandle<Result<(), WireError>>;

/// How much of the queue is written at a time.
const WRITTEN_TOGETHER: usize = 256;

/// Write in a separate task, so that a large output does not block reading, and reading does not block writing.
fn start_writing(
    writer: impl AsyncWrite + Unpin + Send + 'static,
) -> (UnboundedSender<Outgoing>, UnboundedReceiver<u64>, Writing) {
    let (outgoing, queue) = unbounded_channel();
    let (written, announced) = unbounded_channel();
    (outgoing, announced, tokio::spawn(write(writer, queue, written)))
}

/// Write the queue. Messages that are queued at the same time share a packet, such as the output of a node and the start of the next
/// one.
async fn write(
    mut writer: impl AsyncWrite + Unpin,
    mut queue: UnboundedReceiver<Outgoing>,
    written: UnboundedSender<u64>,
) -> Result<(), WireError> {
    let (mut together, mut parcel, mut serials) = (Vec::new(), Parcel::default(), Vec::new());
    while queue.recv_many(&mut together, WRITTEN_TOGETHER).await > 0 {
        for next in together.drain(..) {
            let (message, serial, output) = match next {
                Outgoing::Message(message) => (message, None, None),
                Outgoing::Announce(message, serial) => (message, Some(serial), None),
                Outgoing::Output(message, output) => (message, None, Some(output)),
            };
            parcel.add(&message)?;
            serials.extend(serial);
            let is_large = output.as_ref().is_some_and(|output| !is_small(output));
            if parcel.is_full() || is_large {
                // Announced nodes must not wait for a large output.
                parcel.send(&mut writer).await?;
                serials.drain(..).for_each(|serial| _ = written.send(serial));
            }
            if let Some(output) = output {
                parcel.add_blob(&output, &mut writer).await?;
            }
        }
        parcel.send(&mut writer).await?;
        serials.drain(..).for_each(|serial| _ = written.send(serial));
    }
    writer.shutdown().await?;
    Ok(())
}

/// Wait until a time; for ever without one.
async fn sleep_until_some(then: Option<Instant>) {
    match then {
        Some(then) => sleep_until(then).await,
        None => std::future::pending().await,
    }
}
