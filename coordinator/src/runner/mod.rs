//! The runner: drives the [`reactor`] with real sockets, processes and time.
//!
//! ```text
//!   connections, processes --Inbound--+
//!   nodes run here --Event------------+--> reactor::handle --Outbox--> sockets, nodes run here, observer
//!   the next deadline ----------------+
//! ```
//! One task owns the state; everything else talks to it through channels. Stopping is a message to every worker and then
//! waiting for what was started: when [`run`] returns, there is no process and no connection left.

mod cluster;
mod error;
mod interrupt;
mod options;

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use lookalike::graph::{DecodedCache, NodeId, Planner, Registry, RunContext, WorkerId};
use lookalike::protocol::{Assignment, LeaseName, ToWorker};
use tokio::sync::mpsc::{UnboundedReceiver, UnboundedSender, unbounded_channel};
use tokio::time::{Instant, MissedTickBehavior, interval, sleep_until};
use tokio_util::sync::CancellationToken;
use tracing::{info, trace};

use self::cluster::Cluster;
pub use self::error::{NodeAnswer, RunError};
use self::interrupt::Interrupt;
pub use self::options::RunnerOptions;
use crate::comm::{Action, Lease, Outbox, RunEvent, Site};
use crate::core::{Core, RunSummary};
use crate::reactor::{self, Event};
use crate::rpc::{Inbound, Outgoing};

/// Counts the coordinator processes of a run; without a journal there is only one.
const FIRST_EPOCH: u64 = 1;

/// How many encoded bytes of inputs are kept decoded for the nodes that run here (128 MiB).
const DECODED_BOUND_BYTES: usize = 128 << 20;

/// Run the planner's graph on workers, and its coordinator nodes on this process's rayon pool. Returns the planner, which
/// has seen every output, when no node is open any more. `observer` is told what happens, as it happens; it should be
/// quick, for the run waits for it.
///
/// Needs a tokio runtime with time and I/O; a multi-threaded one keeps connections alive while the planner is busy.
///
/// # Errors
/// [`RunError`]: in each case every worker is told to end and no process is left.
pub async fn run<P: Planner>(
    options: RunnerOptions,
    planner: P,
    registry: Arc<Registry>,
    mut observer: impl FnMut(&RunEvent),
) -> Result<(P, RunSummary), RunError> {
    // Before anything is started: a signal in between must not leave it behind.
    let interrupt = options.handle_signals.then(Interrupt::watch).transpose().map_err(RunError::Signals)?;
    let interrupted = interrupt.as_ref().map_or_else(CancellationToken::new, Interrupt::token);
    let cluster = Cluster::start(&options, FIRST_EPOCH).await?;
    observer(&RunEvent::Listening { address: cluster.address.clone() });
    let (results_sender, results) = unbounded_channel();
    let mut driver = Driver {
        core: Core::new(options.policy, FIRST_EPOCH),
        planner,
        outbox: Outbox::default(),
        cluster,
        observer,
        here: Here {
            registry,
            decoded: Arc::new(DecodedCache::new(DECODED_BOUND_BYTES)),
            contexts: BTreeMap::new(),
            results: results_sender,
        },
        began: Instant::now(),
    };
    let outcome = driver.drive(results, interrupted).await;
    info!(summary = ?driver.core.summary(), "the run is over");
    driver.here.contexts.values().for_each(|(context, _)| context.cancel());
    let reason = if outcome.is_ok() { "the run is complete" } else { "the run has failed" };
    driver.cluster.stop(reason).await;
    outcome.map(|()| (driver.planner, driver.core.summary()))
}

struct Driver<P, O> {
    core: Core,
    planner: P,
    outbox: Outbox,
    cluster: Cluster,
    observer: O,
    here: Here,
    began: Instant,
}

impl<P: Planner, O: FnMut(&RunEvent)> Driver<P, O> {
    async fn drive(
        &mut self,
        mut results: UnboundedReceiver<Event>,
        interrupted: CancellationToken,
    ) -> Result<(), RunError> {
        let now = self.now();
        let outcome = reactor::start(&mut self.core, &mut self.planner, now, &mut self.outbox);
        self.perform();
        outcome?;
        let mut glance = interval(GLANCE);
        glance.set_missed_tick_behavior(MissedTickBehavior::Delay);
        while !self.core.is_finished() {
            let deadline = self.core.next_deadline().map(|deadline| self.began + deadline);
            let event = tokio::select! {
                // What has come is looked at before the time is: a late look must not make a worker late.
                biased;
                () = interrupted.cancelled() => return Err(RunError::Interrupted),
                Some(inbound) = self.cluster.inbound.recv() => self.event(inbound),
                Some(result) = results.recv() => {
                    self.here.forget(&result);
                    Some(result)
                }
                _ = glance.tick(), if !self.here.contexts.is_empty() => {
                    self.tell_progress();
                    None
                }
                () = sleep_or_wait(deadline) => Some(Event::DeadlinePassed),
            };
            let Some(event) = event else { continue };
            trace!(?event);
            let now = self.now();
            let outcome = reactor::handle(&mut self.core, &mut self.planner, event, now, &mut self.outbox);
            // Also after an error: what was said before it shall be heard.
            self.perform();
            outcome?;
        }
        Ok(())
    }

    fn now(&self) -> Duration {
        self.began.elapsed()
    }

    /// How far the nodes are that run here, where that has changed. Those of workers come with their heartbeats.
    fn tell_progress(&mut self) {
        for (node, (context, told)) in &mut self.here.contexts {
            let permille = u16::try_from(context.progress_permille()).unwrap_or(1000);
            if std::mem::replace(told, permille) != permille {
                (self.observer)(&RunEvent::NodeProgress { node: *node, permille });
            }
        }
    }

    fn event(&mut self, inbound: Inbound) -> Option<Event> {
        match inbound {
            Inbound::Event(event) => {
                if let Event::WorkerLeft { worker, .. } = &event {
                    self.cluster.dismiss(*worker);
                }
                Some(event)
            }
            Inbound::Joined { worker, hello, mailbox } => {
                self.cluster.admit(worker, mailbox);
                let threads = usize::try_from(hello.threads).unwrap_or(usize::MAX).clamp(1, MAX_THREADS);
                Some(Event::WorkerJoined { worker, threads, process: hello.process })
            }
            Inbound::Ask { lease, answer } => {
                // Whoever asked may be gone.
                let _ = answer.send(self.core.was_given_out(NodeId(lease.node), lease.attempt));
                None
            }
            Inbound::Tell(event) => {
                (self.observer)(&event);
                None
            }
        }
    }

    fn perform(&mut self) {
        for action in self.outbox.take() {
            match action {
                Action::Assign { worker, lease } => self.assign(worker, lease),
                Action::Cancel { worker, lease } => {
                    let name = LeaseName { node: lease.node.0, attempt: lease.attempt, epoch: lease.epoch };
                    self.cluster.send(worker, Outgoing::Message(ToWorker::Cancel(name)));
                }
                Action::SendBlob { worker, blob } => self.cluster.send(worker, Outgoing::Blob(blob)),
                Action::Acknowledge { worker, node, attempt } => {
                    let name = LeaseName { node: node.0, attempt, epoch: FIRST_EPOCH };
                    self.cluster.send(worker, Outgoing::Message(ToWorker::Acknowledge(name)));
                }
                Action::Drop { worker } => self.cluster.dismiss(worker),
                Action::RunHere { node, attempt } => self.run_here(node, attempt),
                Action::Tell(event) => (self.observer)(&event),
            }
        }
    }

    fn assign(&self, worker: WorkerId, lease: Lease) {
        let graph = self.core.graph();
        // A node is given out when it is ready, so both are there.
        let (Some(spec), Some(inputs)) = (graph.spec(lease.node), graph.input_blobs(lease.node)) else { return };
        let assignment = Assignment {
            lease: LeaseName { node: lease.node.0, attempt: lease.attempt, epoch: lease.epoch },
            kind: spec.kind.clone(),
            label: spec.label.clone(),
            parameters: spec.parameters.clone(),
            inputs: inputs.iter().map(|blob| blob.hash().0).collect(),
        };
        self.cluster.send(worker, Outgoing::Message(ToWorker::Assign(assignment)));
    }

    fn run_here(&mut self, node: NodeId, attempt: u32) {
        let graph = self.core.graph();
        let (Some(spec), Some(inputs)) = (graph.spec(node).cloned(), graph.input_blobs(node)) else { return };
        let context = self.here.new_context(node);
        let (registry, results) = (Arc::clone(&self.here.registry), self.here.results.clone());
        // On the rayon pool and not on a blocking thread of tokio: its parallel iterators run there anyway, and a runtime
        // waits for blocking threads before it ends, but an interrupted run shall not wait for a node.
        rayon::spawn(move || {
            let site = Site::Coordinator;
            let result = match registry.run(&spec.kind, &spec.parameters, &inputs, &context) {
                Ok(output) => Event::Finished { site, node, attempt, output },
                Err(failure) => Event::Failed { site, node, attempt, failure },
            };
            // When nobody listens any more the run is over.
            let _ = results.send(result);
        });
    }
}

/// How often to look how far the nodes are that run here.
const GLANCE: Duration = Duration::from_millis(250);

/// More threads than this on one worker are a mistake or a lie.
const MAX_THREADS: usize = 4096;

async fn sleep_or_wait(deadline: Option<Instant>) {
    match deadline {
        Some(deadline) => sleep_until(deadline).await,
        None => std::future::pending().await,
    }
}

/// What nodes need that run in this process.
struct Here {
    registry: Arc<Registry>,
    decoded: Arc<DecodedCache>,
    /// Of every node that runs here, with the progress that was told last: to watch it, and to cancel it when the run ends.
    contexts: BTreeMap<NodeId, (RunContext, u16)>,
    results: UnboundedSender<Event>,
}

impl Here {
    fn new_context(&mut self, node: NodeId) -> RunContext {
        let context = RunContext::new(Arc::clone(&self.decoded));
        self.contexts.insert(node, (context.clone(), 0));
        context
    }

    /// Let the context of a node go that has ended.
    fn forget(&mut self, ended: &Event) {
        if let Event::Finished { node, .. } | Event::Failed { node, .. } = ended {
            self.contexts.remove(node);
        }
    }
}
