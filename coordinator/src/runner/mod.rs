//! The runner: drives the [`reactor`] with real sockets, processes and time.
//!
//! ```text
//!   connections, processes --Inbound--+
//!   nodes run here --Event------------+--> reactor::handle --Outbox--> sockets, nodes run here, observer
//!   the next deadline ----------------+
//! ```
//! Events that arrive together form a group. With a journal, a group is committed as one transaction before its actions are performed;
//! events that arrive meanwhile form the next group.
//!
//! One task owns the state; everything else communicates with it through channels. To stop, it sends a message to every worker
//! and waits for everything that was started: when [`run`] returns, no process and no connection is left.

mod cluster;
mod error;
mod here;
mod interrupt;
mod memory;
mod options;
mod pulse;

use std::sync::Arc;
use std::time::Duration;

use lookalike::graph::{NodeId, Planner, Registry, WorkerId};
use lookalike::protocol::{Assignment, LeaseName, RunName, ToWorker};
use lookalike_worker::{
    with_causes,
    world::{Real, World},
};
use tokio::sync::Notify;
use tokio::sync::mpsc::{Receiver, UnboundedReceiver, channel, unbounded_channel};
use tokio::time::{Instant, MissedTickBehavior, interval, sleep_until};
use tokio_util::sync::CancellationToken;
use tracing::{info, trace};

use self::cluster::{Cluster, Resumed};
pub use self::error::RunError;
use self::here::Here;
use self::interrupt::Interrupt;
use self::memory::{Group, Memory};
pub use self::options::RunnerOptions;
pub use self::pulse::Pulse;
use crate::actions::{Action, Lease, Outbox, WorkerProcess};
use crate::events::{RunEvent, Site};
use crate::journal::Journal;
use crate::reactor::{self, Event, Stop};
use crate::rpc::{Inbound, Outgoing};
use crate::state::{Core, RunSummary};

/// The number of the first coordinator process of a run. Without a journal it is the only one.
const FIRST_EPOCH: u64 = 1;

/// How many events may wait for the reactor before connections must wait.
const INBOUND_CAPACITY: usize = 1024;

/// How many events are handled and journalled as one group.
const EVENTS_PER_GROUP: usize = 1024;

/// Run the planner's graph on workers, and its coordinator nodes on this process's rayon pool. Returns the planner, which has
/// received every output, when no node is open any more. `observer` is called with each event as it happens; it should be quick,
/// because the run waits for it.
///
/// With a [journal](RunnerOptions::journal), every change is committed before it is acknowledged, and an unfinished run is
/// resumed if the journal's options allow it. If no node is left to run, the coordinator does not listen and starts no worker.
///
/// Needs a tokio runtime with time and I/O. A multi-threaded one keeps connections alive while the planner is busy.
///
/// # Errors
/// [`RunError`]. In each case, every worker is told to end and no process is left.
pub async fn run<P: Planner>(
    options: RunnerOptions,
    planner: P,
    registry: Arc<Registry>,
    observer: impl FnMut(&RunEvent),
) -> Result<(P, RunSummary), RunError> {
    run_in(Real, options, planner, registry, observer).await
}

/// Like [`run`], in any world. Local workers are processes in every world.
///
/// # Errors
/// See [`run`].
pub async fn run_in<W: World, P: Planner>(
    world: W,
    options: RunnerOptions,
    planner: P,
    registry: Arc<Registry>,
    observer: impl FnMut(&RunEvent),
) -> Result<(P, RunSummary), RunError> {
    // Before anything is started, so that an early signal leaves nothing behind.
    let interrupt = options.handle_signals.then(Interrupt::watch).transpose().map_err(RunError::Signals)?;
    let interrupted = interrupt.as_ref().map_or_else(CancellationToken::new, Interrupt::token);
    options.check()?;
    let mut name = [0; 16];
    world.fill_random(&mut name).map_err(RunError::Randomness)?;
    let open = |options| Journal::open(options, RunName(name), world.disk_time());
    let journal = options.journal.as_ref().map(open).transpose()?;
    let (run, epoch) = journal.as_ref().map_or((RunName(name), FIRST_EPOCH), |journal| (journal.run, journal.epoch));
    let earlier = journal.as_ref().filter(|_| epoch > FIRST_EPOCH);
    let resumed = earlier.map(|journal| Resumed { listen: journal.past.listen, results: journal.past.results });
    let core = Core::new(options.policy, epoch);
    let core = match &journal {
        Some(journal) => core.with_past_outputs(journal.past_outputs()),
        None => core,
    };
    let (results_sender, results) = unbounded_channel();
    let mut driver = Driver {
        core,
        planner,
        outbox: Outbox::default(),
        cluster: None,
        observer,
        here: Here::new(world.common_pool(), registry, results_sender),
        memory: Memory::new(journal),
        began: Instant::now(),
        world,
    };
    let begin = Begin { options, run, resumed };
    let outcome = driver.drive(begin, results, interrupted).await;
    info!(summary = ?driver.core.summary(), "the run is over");
    driver.here.cancel();
    let reason = if outcome.is_ok() { "the run is complete" } else { "the run has failed" };
    if let Some(cluster) = driver.cluster.take() {
        cluster.stop(reason).await;
    }
    let closed = driver.memory.close(outcome.as_ref().err().map(|error| with_causes(error)));
    // The first error is the one to report.
    outcome.and(closed).map(|()| (driver.planner, driver.core.summary()))
}

/// The parameters of the start of a run.
struct Begin {
    options: RunnerOptions,
    run: RunName,
    resumed: Option<Resumed>,
}

struct Driver<W: World, P, O> {
    world: W,
    core: Core,
    planner: P,
    outbox: Outbox,
    /// Started when there is work for workers.
    cluster: Option<Cluster>,
    observer: O,
    here: Here<W::Pool>,
    memory: Memory,
    began: Instant,
}

impl<W: World, P: Planner, O: FnMut(&RunEvent)> Driver<W, P, O> {
    async fn drive(
        &mut self,
        begin: Begin,
        mut results: UnboundedReceiver<Event>,
        interrupted: CancellationToken,
    ) -> Result<(), RunError> {
        // Dropped when this function returns, so that connections that wait for room in the queue end.
        let (sender, mut inbound) = channel(INBOUND_CAPACITY);
        let (wake, pulse) = (begin.options.wake.clone(), begin.options.pulse.clone());
        let mut failure = self.begin(begin, sender).await?;
        let mut glance = interval(GLANCE);
        glance.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut beat = interval(pulse::INTERVAL);
        beat.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut events = Vec::new();
        loop {
            pulse.iter().for_each(|pulse| pulse.beat());
            let is_over = failure.is_some() || self.core.is_finished();
            if is_over && self.memory.is_written() {
                return failure.map_or(Ok(()), |stop| Err(stop.into()));
            }
            let may_act = !is_over && self.memory.has_room();
            let deadline = self.core.next_deadline().map(|deadline| self.began + deadline);
            tokio::select! {
                // Process events before deadlines, so that workers do not miss deadlines because the coordinator is slow.
                biased;
                () = interrupted.cancelled() => return Err(RunError::Interrupted),
                written = self.memory.written() => {
                    let group = written?;
                    self.perform(group);
                    continue;
                }
                Some(result) = results.recv(), if may_act => events.push(Inbound::Event(result)),
                _ = inbound.recv_many(&mut events, EVENTS_PER_GROUP), if may_act => {}
                _ = glance.tick(), if !self.here.is_idle() => {
                    self.here.tell_progress(&mut self.observer);
                    continue;
                }
                () = told(wake.as_deref()), if may_act => events.push(Inbound::Event(Event::LookAgain)),
                _ = beat.tick(), if pulse.is_some() => continue,
                () = sleep_or_wait(deadline), if may_act => {}
            }
            more(&mut inbound, &mut events);
            // Check deadlines after each group, even if events keep arriving.
            if deadline.is_some_and(|deadline| deadline <= Instant::now()) {
                events.push(Inbound::Event(Event::DeadlinePassed));
            }
            failure = self.handle_all(&mut events).err();
        }
    }

    /// Start the planner and complete nodes from the journal. If nodes are left to run, listen and start workers. An error of the
    /// planner is returned as a value, so that the events before it are still reported.
    async fn begin(
        &mut self,
        Begin { options, run, resumed }: Begin,
        inbound: tokio::sync::mpsc::Sender<Inbound>,
    ) -> Result<Option<Stop>, RunError> {
        let (mut group, now) = (Group::default(), self.now());
        if let Some(resumed) = &resumed {
            let (epoch, results) = (self.core.epoch, resumed.results);
            self.outbox.tell(RunEvent::Resumed { epoch, results });
        }
        let started = reactor::start(&mut self.core, &mut self.planner, now, &mut self.outbox);
        self.forget_if_wrong(started.as_ref().err(), &mut group);
        self.collect(&mut group, now);
        if started.is_ok() && !self.core.is_finished() {
            let is_new = resumed.is_none();
            let world = self.world.clone();
            match Cluster::start(world, &options, (run, self.core.epoch), resumed, inbound).await {
                Ok(cluster) => {
                    let (address, local_workers) = (cluster.address.clone(), options.workers);
                    (self.observer)(&RunEvent::Listening { address, local_workers });
                    group.batch.listens(cluster.bound.to_string());
                    self.cluster = Some(cluster);
                }
                Err(error) => {
                    if is_new {
                        self.memory.discard();
                    }
                    return Err(error);
                }
            }
        }
        self.submit(group);
        Ok(started.err())
    }

    fn now(&self) -> Duration {
        self.began.elapsed()
    }

    /// Process events as one group.
    fn handle_all(&mut self, events: &mut Vec<Inbound>) -> Result<(), Stop> {
        let mut group = Group::default();
        let outcome = events.drain(..).try_for_each(|inbound| {
            let arrived = match &inbound {
                Inbound::Timed { arrived, .. } => Some(*arrived),
                _ => None,
            };
            let event = self.event(inbound, &mut group);
            event.map_or(Ok(()), |event| self.handle_arrived(event, arrived, &mut group))
        });
        // Also after an error, so that the events before it are reported.
        self.submit(group);
        outcome
    }

    fn handle_arrived(&mut self, event: Event, arrived: Option<Instant>, group: &mut Group) -> Result<(), Stop> {
        trace!(?event);
        self.here.forget(&event);
        let now = self.now();
        let arrived = arrived.map_or(now, |arrived| arrived.saturating_duration_since(self.began).min(now));
        let outcome =
            reactor::handle_arrived(&mut self.core, &mut self.planner, event, (arrived, now), &mut self.outbox);
        self.collect(group, now);
        self.forget_if_wrong(outcome.as_ref().err(), group);
        outcome
    }

    /// Move the reactor's actions into the group, and add their rows for the journal.
    fn collect(&mut self, group: &mut Group, now: Duration) {
        let actions = self.outbox.take();
        if self.memory.is_kept() {
            actions.iter().for_each(|action| group.batch.note(action, &self.core, now));
        }
        group.actions.extend(actions);
    }

    /// Remove a wrong result, or one of two that differ, from the journal, so that a resumed run does not use it.
    fn forget_if_wrong(&self, error: Option<&Stop>, group: &mut Group) {
        if let Some(Stop::WrongResult { name, .. } | Stop::ResultsDiffer { name, .. }) = error {
            let index = usize::try_from(name.node.0).unwrap_or(usize::MAX);
            let key = self.core.records.get(index).and_then(|record| record.key);
            key.into_iter().for_each(|key| group.batch.forget(key));
        }
    }

    fn submit(&mut self, group: Group) {
        if let Some(group) = self.memory.submit(group) {
            self.perform(group);
        }
    }

    fn event(&mut self, inbound: Inbound, group: &mut Group) -> Option<Event> {
        match inbound {
            Inbound::Event(event) | Inbound::Timed { event, .. } => {
                if let Event::WorkerLeft { worker, .. } = &event {
                    self.cluster.iter_mut().for_each(|cluster| cluster.dismiss(*worker));
                }
                Some(event)
            }
            Inbound::Joined { worker, hello, mailbox } => {
                let cluster = self.cluster.as_mut()?;
                let process = WorkerProcess { id: hello.process, name: hello.name, is_local: hello.is_local };
                let threads = usize::try_from(hello.threads).unwrap_or(usize::MAX).clamp(1, MAX_THREADS);
                cluster.admit(worker, process, mailbox);
                Some(Event::WorkerJoined { worker, threads, process })
            }
            Inbound::Ask { lease, answer } => {
                // The connection that asked may have ended.
                let _ = answer.send(self.core.was_given_out(NodeId(lease.node), lease.attempt));
                None
            }
            Inbound::Tell(event) => {
                group.batch.note_event(&event, &self.core, self.now());
                group.actions.push(Action::Tell(event));
                None
            }
        }
    }

    /// Perform the actions of a group.
    fn perform(&mut self, group: Group) {
        for action in group.actions {
            match action {
                Action::Assign { worker, lease } => self.assign(worker, lease),
                Action::Cancel { worker, lease } => self.send(worker, ToWorker::Cancel(name_of(lease))),
                Action::SendBlob { worker, blob } => {
                    self.cluster.iter().for_each(|cluster| cluster.send(worker, Outgoing::Blob(blob.clone())));
                }
                Action::ForgoBlob { worker } => {
                    self.cluster.iter().for_each(|cluster| cluster.send(worker, Outgoing::NoBlob));
                }
                Action::Acknowledge { worker, node, attempt } => {
                    let name = LeaseName { node: node.0, attempt, epoch: self.core.epoch };
                    self.send(worker, ToWorker::Acknowledge(name));
                }
                Action::Drop { worker } => self.cluster.iter_mut().for_each(|cluster| cluster.dismiss(worker)),
                Action::RunHere { node, attempt } => self.run_here(node, attempt),
                Action::CancelHere { node } => self.here.cancel_one(node),
                // The journal has written it already.
                Action::Keep { .. } => {}
                Action::Tell(event) => {
                    if let RunEvent::NodeStarted { site: Site::Worker(worker), .. } = &event {
                        self.cluster.iter().for_each(|cluster| cluster.note_work(*worker));
                    }
                    (self.observer)(&event);
                }
            }
        }
    }

    fn send(&self, worker: WorkerId, message: ToWorker) {
        if let Some(cluster) = &self.cluster {
            cluster.send(worker, Outgoing::Message(message));
        }
    }

    fn assign(&self, worker: WorkerId, lease: Lease) {
        let graph = self.core.graph();
        // A node is given out only when it is ready, so it has both.
        let (Some(spec), Some(inputs)) = (graph.spec(lease.node), graph.input_blobs(lease.node)) else { return };
        let assignment = Assignment {
            lease: name_of(lease),
            kind: spec.kind.clone(),
            label: spec.label.to_string(),
            parameters: spec.parameters.clone(),
            inputs: inputs.iter().map(|blob| blob.hash().0).collect(),
        };
        self.send(worker, ToWorker::Assign(assignment));
    }

    fn run_here(&mut self, node: NodeId, attempt: u32) {
        let graph = self.core.graph();
        let (Some(spec), Some(inputs)) = (graph.spec(node).cloned(), graph.input_blobs(node)) else { return };
        self.here.start(node, attempt, spec, inputs);
    }
}

fn name_of(lease: Lease) -> LeaseName {
    LeaseName { node: lease.node.0, attempt: lease.attempt, epoch: lease.epoch }
}

/// Add further events that have arrived, as far as the group has room.
fn more(inbound: &mut Receiver<Inbound>, events: &mut Vec<Inbound>) {
    while events.len() < EVENTS_PER_GROUP {
        let Ok(event) = inbound.try_recv() else { return };
        events.push(event);
    }
}

/// How often to read the progress of the nodes that run here.
const GLANCE: Duration = Duration::from_millis(250);

/// The most threads of one worker; a larger number is an error or an attack.
const MAX_THREADS: usize = 4096;

async fn told(wake: Option<&Notify>) {
    match wake {
        Some(wake) => wake.notified().await,
        None => std::future::pending().await,
    }
}

async fn sleep_or_wait(deadline: Option<Instant>) {
    match deadline {
        Some(deadline) => sleep_until(deadline).await,
        None => std::future::pending().await,
    }
}
