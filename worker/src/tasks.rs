//! The nodes that were assigned to this worker, and their progress: a state machine without sockets, threads and time.
//!
//! ```text
//!   Gathering --all inputs here, a thread free--> Announcing --"started" is on the wire--> Executing --> Answered
//! ```
//! A node executes only after its start was sent to the coordinator: if the node kills this process, the coordinator must know which
//! node to suspect. An answer is kept until it is acknowledged, and sent again on a new connection.

use std::collections::{BTreeMap, BTreeSet};

use lookalike::graph::{Blob, BlobHash, NodeFailure, RunContext};
use lookalike::protocol::{Assignment, Executing, FailureKind, LeaseName, RunName, ToCoordinator, bounded_text};

use crate::cache::BlobCache;
use crate::execute::{Completed, Job};

/// An action that the caller must execute.
#[derive(Debug)]
pub(crate) enum Action {
    /// Send a message.
    Send(ToCoordinator),
    /// Send the message that a node starts, then call [`Tasks::announced`].
    Announce { lease: LeaseName, serial: u64 },
    /// Send an output.
    SendOutput { lease: LeaseName, output: Blob },
    /// Execute a job.
    Execute(Job),
}

/// The assigned nodes.
#[derive(Debug)]
pub(crate) struct Tasks {
    threads: usize,
    cache: BlobCache,
    /// The coordinator that the tasks belong to: the run and its epoch.
    coordinator: Option<(RunName, u64)>,
    /// By node number.
    tasks: BTreeMap<u64, Task>,
    /// Blobs that were requested and have not arrived.
    fetching: BTreeSet<BlobHash>,
    /// Whether the worker drains: no more nodes start.
    is_draining: bool,
    /// Nodes with all inputs, in order of arrival; may contain nodes that were cancelled since.
    ready: BTreeMap<u64, u64>,
    /// Executions that use a thread, by serial number, including those whose task was dropped.
    running: BTreeMap<u64, u64>,
    next_serial: u64,
}

#[derive(Debug)]
struct Task {
    lease: LeaseName,
    stage: Stage,
}

#[derive(Debug)]
enum Stage {
    /// Holds the inputs that have arrived, because the cache may drop them before the last one arrives.
    Gathering {
        assignment: Assignment,
        inputs: Vec<Option<Blob>>,
        arrival: u64,
    },
    Announcing(Job),
    Executing {
        serial: u64,
        context: RunContext,
    },
    Answered(Result<Blob, NodeFailure>),
}

impl Tasks {
    pub(crate) fn new(threads: usize, cache: BlobCache) -> Self {
        Self {
            threads,
            cache,
            coordinator: None,
            tasks: BTreeMap::new(),
            fetching: BTreeSet::new(),
            is_draining: false,
            ready: BTreeMap::new(),
            running: BTreeMap::new(),
            next_serial: 0,
        }
    }

    /// A coordinator has accepted this worker. After a broken connection to the same coordinator, nodes that had not begun are
    /// dropped, because the coordinator has re-queued them; nodes that had begun continue, and answers are sent again. For another
    /// coordinator, of this run or another one, everything is dropped.
    pub(crate) fn welcomed(&mut self, run: RunName, epoch: u64) -> Vec<Action> {
        let is_same = self.coordinator.replace((run, epoch)) == Some((run, epoch));
        self.fetching.clear();
        for (_, task) in std::mem::take(&mut self.tasks) {
            match &task.stage {
                Stage::Gathering { .. } => {}
                Stage::Announcing(job) => _ = self.running.remove(&job.serial),
                Stage::Executing { .. } | Stage::Answered(_) if is_same => {
                    self.tasks.insert(task.lease.node, task);
                }
                Stage::Executing { context, .. } => context.cancel(),
                Stage::Answered(_) => {}
            }
        }
        let mut actions: Vec<_> = self.tasks.values().filter_map(Task::answer).collect();
        if is_same {
            // At once, so that the coordinator does not give these nodes to other workers.
            actions.push(Action::Send(ToCoordinator::Heartbeat { executing: self.executing() }));
        }
        actions
    }

    /// Start no more nodes, because this process must end. Nodes that have not started are dropped; the coordinator re-queues them.
    pub(crate) fn drain(&mut self) {
        self.is_draining = true;
        self.tasks.retain(|_, task| !matches!(task.stage, Stage::Gathering { .. }));
    }

    /// Whether no node has started whose answer is not acknowledged.
    pub(crate) fn are_done(&self) -> bool {
        self.tasks.is_empty()
    }

    /// A node was assigned.
    pub(crate) fn assigned(&mut self, assignment: Assignment, new_context: impl Fn() -> RunContext) -> Vec<Action> {
        let lease = assignment.lease;
        if let Some(task) = self.tasks.get_mut(&lease.node) {
            // This worker had the node before the connection broke: answer under the new lease.
            task.lease = lease;
            return match &task.stage {
                Stage::Executing { .. } => vec![Action::Send(ToCoordinator::Started(lease))],
                Stage::Answered(_) => task.answer().into_iter().collect(),
                Stage::Gathering { .. } | Stage::Announcing(_) => Vec::new(),
            };
        }
        if self.is_draining {
            // The assignment was sent before the coordinator received `Draining`, or that message was lost: send it again, so that the
            // coordinator re-queues the node.
            return vec![Action::Send(ToCoordinator::Draining)];
        }
        let inputs: Vec<_> = assignment.inputs.iter().map(|hash| self.cache.get(BlobHash(*hash))).collect();
        let mut actions = Vec::new();
        for (hash, input) in assignment.inputs.iter().zip(&inputs) {
            if input.is_none() && self.fetching.insert(BlobHash(*hash)) {
                actions.push(Action::Send(ToCoordinator::Fetch { hash: *hash }));
            }
        }
        let arrival = self.serial();
        if inputs.iter().all(Option::is_some) {
            self.ready.insert(arrival, lease.node);
        }
        self.tasks.insert(lease.node, Task { lease, stage: Stage::Gathering { assignment, inputs, arrival } });
        actions.extend(self.begin(new_context));
        actions
    }

    /// The "started" of this execution is on the wire.
    pub(crate) fn announced(&mut self, serial: u64) -> Vec<Action> {
        let is_meant = |task: &&mut Task| task.serial() == Some(serial);
        let node = self.running.get(&serial);
        let Some(task) = node.and_then(|node| self.tasks.get_mut(node)).filter(is_meant) else {
            return Vec::new();
        };
        let Stage::Announcing(Job { context, .. }) = &task.stage else {
            return Vec::new();
        };
        let executing = Stage::Executing { serial, context: context.clone() };
        match std::mem::replace(&mut task.stage, executing) {
            Stage::Announcing(job) => vec![Action::Execute(job)],
            _ => Vec::new(),
        }
    }

    /// A fetched blob has arrived.
    pub(crate) fn fetched(&mut self, blob: Blob, new_context: impl Fn() -> RunContext) -> Vec<Action> {
        self.fetching.remove(&blob.hash());
        for (node, task) in &mut self.tasks {
            let Stage::Gathering { assignment, inputs, arrival } = &mut task.stage else { continue };
            let missing = assignment.inputs.iter().zip(&mut *inputs).filter(|(hash, _)| **hash == blob.hash().0);
            missing.for_each(|(_, input)| *input = Some(blob.clone()));
            if inputs.iter().all(Option::is_some) {
                self.ready.insert(*arrival, *node);
            }
        }
        self.cache.insert(blob);
        self.begin(new_context)
    }

    /// An execution has ended.
    pub(crate) fn completed(&mut self, completed: Completed, new_context: impl Fn() -> RunContext) -> Vec<Action> {
        let node = self.running.remove(&completed.serial);
        let is_meant = |task: &&mut Task| task.serial() == Some(completed.serial);
        let mut actions = Vec::new();
        if let Some(task) = node.and_then(|node| self.tasks.get_mut(&node)).filter(is_meant) {
            task.stage = Stage::Answered(completed.result);
            actions.extend(task.answer());
        }
        actions.extend(self.begin(new_context));
        actions
    }

    /// The coordinator no longer needs this node.
    pub(crate) fn cancelled(&mut self, lease: LeaseName, new_context: impl Fn() -> RunContext) -> Vec<Action> {
        if self.tasks.get(&lease.node).is_none_or(|task| task.lease != lease) {
            return Vec::new();
        }
        match self.tasks.remove(&lease.node).map(|task| task.stage) {
            Some(Stage::Announcing(job)) => _ = self.running.remove(&job.serial),
            Some(Stage::Executing { context, .. }) => context.cancel(),
            Some(Stage::Gathering { assignment, .. }) => self.forgo(&assignment),
            Some(Stage::Answered(_)) | None => {}
        }
        self.begin(new_context)
    }

    /// Drop the requests for blobs that only this assignment needed: the coordinator may have dropped the blobs, so they must be
    /// requested again if another node needs them.
    fn forgo(&mut self, assignment: &Assignment) {
        for hash in assignment.inputs.iter().map(|hash| BlobHash(*hash)) {
            let needs = |task: &Task| match &task.stage {
                Stage::Gathering { assignment, inputs, .. } => {
                    assignment.inputs.iter().zip(inputs).any(|(name, input)| *name == hash.0 && input.is_none())
                }
                _ => false,
            };
            if self.fetching.contains(&hash) && !self.tasks.values().any(needs) {
                self.fetching.remove(&hash);
            }
        }
    }

    /// The coordinator has received the answer.
    pub(crate) fn acknowledged(&mut self, lease: LeaseName) {
        if self.tasks.get(&lease.node).is_some_and(|task| matches!(task.stage, Stage::Answered(_))) {
            self.tasks.remove(&lease.node);
        }
    }

    /// The nodes in execution.
    pub(crate) fn executing(&self) -> Vec<Executing> {
        let progress = |task: &Task| match &task.stage {
            Stage::Executing { context, .. } => {
                let permille = u16::try_from(context.progress_permille()).unwrap_or(1000);
                Some(Executing { lease: task.lease, permille })
            }
            _ => None,
        };
        self.tasks.values().filter_map(progress).collect()
    }

    /// Start nodes with all inputs on free threads, in order of arrival.
    fn begin(&mut self, new_context: impl Fn() -> RunContext) -> Vec<Action> {
        let mut actions = Vec::new();
        while self.running.len() < self.threads
            && let Some((came, node)) = self.ready.pop_first()
        {
            let serial = self.serial();
            let Some(task) = self.tasks.get_mut(&node) else { continue };
            let Stage::Gathering { assignment, inputs, arrival } = &mut task.stage else { continue };
            // It was cancelled and assigned again since.
            if *arrival != came {
                continue;
            }
            let Some(inputs) = inputs.iter().cloned().collect::<Option<Vec<_>>>() else { continue };
            let kind = std::mem::take(&mut assignment.kind);
            let parameters = std::mem::take(&mut assignment.parameters);
            task.stage = Stage::Announcing(Job { serial, kind, parameters, inputs, context: new_context() });
            self.running.insert(serial, node);
            actions.push(Action::Announce { lease: task.lease, serial });
        }
        actions
    }

    fn serial(&mut self) -> u64 {
        self.next_serial += 1;
        self.next_serial
    }
}

impl Task {
    fn answer(&self) -> Option<Action> {
        let lease = self.lease;
        match &self.stage {
            Stage::Answered(Ok(output)) => Some(Action::SendOutput { lease, output: output.clone() }),
            Stage::Answered(Err(failure)) => {
                let (kind, message) = on_the_wire(failure);
                Some(Action::Send(ToCoordinator::Failed { lease, kind, message: bounded_text(&message) }))
            }
            _ => None,
        }
    }

    /// The serial number of its execution, while it is announced or executing.
    fn serial(&self) -> Option<u64> {
        match &self.stage {
            Stage::Announcing(job) => Some(job.serial),
            Stage::Executing { serial, .. } => Some(*serial),
            Stage::Gathering { .. } | Stage::Answered(_) => None,
        }
    }
}

/// The kind of a failure on the wire, and its message without the text that the kind adds.
fn on_the_wire(failure: &NodeFailure) -> (FailureKind, String) {
    match failure {
        NodeFailure::Panicked { message } => (FailureKind::Panic, message.clone()),
        NodeFailure::UnknownKind { message } => (FailureKind::UnknownKind, message.clone()),
        other => (FailureKind::Application, other.to_string()),
    }
}
