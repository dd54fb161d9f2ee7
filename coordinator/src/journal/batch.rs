//! The changes of a group of events: the rows of one transaction.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use lookalike::graph::{Blob, FailureReason, NodeId, NodeKey, NodeState, WorkerId};

use crate::actions::Action;
use crate::events::{RunEvent, Site};
use crate::state::{Core, Deaths, Record};

/// The worker number of nodes that run in the coordinator itself. Workers count from 1.
const HERE: u64 = 0;

/// The state of a node. The numbers are stored in the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum State {
    Waiting = 0,
    Ready = 1,
    Running = 2,
    Completed = 3,
    Recalled = 4,
    Failed = 5,
}

/// How an attempt ended. The numbers are stored in the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Outcome {
    Finished = 0,
    Failed = 1,
    Lost = 2,
    Cancelled = 3,
}

/// A node that was added or has changed.
#[derive(Debug)]
pub(super) struct NodeRow {
    /// Kind and label, if it is new.
    pub(super) added: Option<(String, String)>,
    pub(super) state: State,
    pub(super) attempts: u32,
    pub(super) deaths: Deaths,
    pub(super) key: Option<NodeKey>,
    pub(super) error: Option<String>,
}

/// A change of attempts.
#[derive(Debug)]
pub(super) enum AttemptChange {
    /// An attempt begins.
    Begun { node: u64, attempt: u32, worker: u64, at: Duration },
    /// Open attempts of a node end: that of one worker, or all.
    Ended { node: u64, worker: Option<u64>, outcome: Outcome, at: Duration },
}

/// A worker that has joined.
#[derive(Debug)]
pub(super) struct WorkerRow {
    pub(super) worker: u64,
    /// Its process id on its own machine.
    pub(super) process: u32,
    pub(super) threads: usize,
    pub(super) at: Duration,
}

/// A worker that has left, and why.
#[derive(Debug)]
pub(super) struct LeftRow {
    pub(super) worker: u64,
    pub(super) why: String,
    pub(super) at: Duration,
}

/// The changes of a group of events.
#[derive(Debug, Default)]
pub(crate) struct Batch {
    /// By number.
    pub(super) nodes: BTreeMap<u64, NodeRow>,
    /// Nodes that have stopped running.
    pub(super) stopped: Vec<u64>,
    /// Nodes that have begun to run, each with the number of its attempts.
    pub(super) started: Vec<(u64, u32)>,
    /// Nodes that are completed, each with the number of its attempts.
    pub(super) finished: Vec<(u64, u32)>,
    /// In order.
    pub(super) attempts: Vec<AttemptChange>,
    pub(super) workers: Vec<WorkerRow>,
    pub(super) left: Vec<LeftRow>,
    pub(super) results: Vec<(NodeKey, Blob)>,
    /// Results that turned out to be wrong.
    pub(super) forgotten: Vec<NodeKey>,
    /// Results whose bytes are no longer needed.
    pub(super) released: BTreeSet<NodeKey>,
    pub(super) listen: Option<String>,
}

impl Batch {
    /// Add an action of the reactor.
    pub(crate) fn note(&mut self, action: &Action, core: &Core, now: Duration) {
        match action {
            Action::Assign { worker, lease } => self.begin(lease.node, lease.attempt, worker.0, now),
            Action::RunHere { node, attempt } => self.begin(*node, *attempt, HERE, now),
            Action::Cancel { worker, lease } => self.end(lease.node, Some(worker.0), Outcome::Cancelled, now),
            Action::Tell(event) => self.note_event(event, core, now),
            Action::Keep { node, output } => {
                let key = core.look(*node).and_then(|record| record.key);
                key.into_iter().for_each(|key| self.keep(key, output.clone()));
            }
            Action::Acknowledge { worker, node, .. } => {
                let has_failed = matches!(core.graph.state(*node), Some(NodeState::Failed(_)));
                let outcome = if has_failed { Outcome::Failed } else { Outcome::Finished };
                self.end(*node, Some(worker.0), outcome, now);
            }
            Action::SendBlob { .. } | Action::ForgoBlob { .. } | Action::CancelHere { .. } | Action::Drop { .. } => {}
        }
    }

    /// Add an event.
    pub(crate) fn note_event(&mut self, event: &RunEvent, core: &Core, now: Duration) {
        match event {
            RunEvent::NodeAdded { name } => {
                self.touch(name.node, core).added = Some((name.kind.clone(), name.label.to_string()));
            }
            RunEvent::NodeReady { node } => _ = self.touch(*node, core),
            RunEvent::NodeStarted { name, .. } => self.started.push(numbers(name.node, core)),
            RunEvent::NodeRecalled { name, .. } => self.touch(name.node, core).state = State::Recalled,
            RunEvent::NodeFinished { name, site, .. } => {
                self.finished.push(numbers(name.node, core));
                if *site == Site::Coordinator {
                    self.end(name.node, Some(HERE), Outcome::Finished, now);
                }
            }
            RunEvent::NodeFailed { name, reason } => {
                self.touch(name.node, core).error = Some(reason.to_string());
                let is_own = matches!(reason, FailureReason::Node(_));
                self.end(name.node, None, if is_own { Outcome::Failed } else { Outcome::Lost }, now);
            }
            RunEvent::DeathsCounted { name, .. } | RunEvent::NodeSuspected { name, .. } => {
                self.touch(name.node, core);
            }
            RunEvent::NodeRequeued { name, worker, .. } => {
                self.touch(name.node, core);
                self.started.retain(|(node, _)| *node != name.node.0);
                self.stopped.push(name.node.0);
                self.end(name.node, Some(worker.0), Outcome::Lost, now);
            }
            RunEvent::NodeReleased { name } => {
                self.released.extend(core.look(name.node).and_then(|record| record.key));
            }
            RunEvent::WorkerJoined { worker, threads, .. } => {
                if let Some(process) = core.members.get(*worker).map(|member| member.process.id) {
                    self.workers.push(WorkerRow { worker: worker.0, process, threads: *threads, at: now });
                }
            }
            RunEvent::WorkerLeft { worker, departure } => {
                self.left.push(LeftRow { worker: worker.0, why: departure.to_string(), at: now });
            }
            _ => {}
        }
    }

    /// Store the result of a node, even if it was released before.
    pub(crate) fn keep(&mut self, key: NodeKey, output: Blob) {
        self.released.remove(&key);
        self.results.push((key, output));
    }

    /// Remove the result of a node, because it is or may be wrong.
    pub(crate) fn forget(&mut self, key: NodeKey) {
        self.results.retain(|(kept, _)| *kept != key);
        self.forgotten.push(key);
    }

    /// Set the address on which the coordinator listens.
    pub(crate) fn listens(&mut self, address: String) {
        self.listen = Some(address);
    }

    /// Whether the actions of the group must wait for this transaction. They need not if all its rows are only shown to users.
    pub(crate) fn is_urgent(&self) -> bool {
        let Self { nodes, workers, left, results, forgotten, released, listen, .. } = self;
        let rows = nodes.len() + workers.len() + left.len();
        rows + results.len() + forgotten.len() + released.len() > 0 || listen.is_some()
    }

    /// Whether there is nothing to write.
    pub(crate) fn is_empty(&self) -> bool {
        // Finished nodes are also among the results, stopped ones among the nodes.
        !self.is_urgent() && self.started.is_empty() && self.attempts.is_empty()
    }

    fn begin(&mut self, node: NodeId, attempt: u32, worker: u64, at: Duration) {
        self.attempts.push(AttemptChange::Begun { node: node.0, attempt, worker, at });
    }

    fn end(&mut self, node: NodeId, worker: Option<u64>, outcome: Outcome, at: Duration) {
        self.attempts.push(AttemptChange::Ended { node: node.0, worker, outcome, at });
    }

    /// The row of a node, updated to the node's present state.
    fn touch(&mut self, node: NodeId, core: &Core) -> &mut NodeRow {
        let unknown = Record::default();
        let index = usize::try_from(node.0).unwrap_or(usize::MAX);
        let record = core.records.get(index).unwrap_or(&unknown);
        let (attempts, deaths, key) = (record.attempts, record.deaths, record.key);
        let is_executing = |worker: &WorkerId| {
            let held = core.members.get(*worker).and_then(|member| member.leases.get(&node));
            held.is_some_and(|held| held.started_at.is_some())
        };
        let is_running = || record.here_since.is_some() || record.holders.iter().any(is_executing);
        let state = match core.graph.state(node) {
            Some(NodeState::Completed(_)) => State::Completed,
            Some(NodeState::Failed(_)) => State::Failed,
            Some(NodeState::Ready) if is_running() => State::Running,
            Some(NodeState::Ready) => State::Ready,
            Some(NodeState::Waiting) | None => State::Waiting,
        };
        let new = || NodeRow { added: None, state, attempts, deaths, key, error: None };
        let row = self.nodes.entry(node.0).or_insert_with(new);
        // A node that an earlier coordinator completed stays recalled.
        let state = if row.state == State::Recalled { State::Recalled } else { state };
        (row.state, row.attempts, row.deaths, row.key) = (state, attempts, deaths, key);
        row
    }
}

/// The number of a node, and the number of its attempts.
fn numbers(node: NodeId, core: &Core) -> (u64, u32) {
    (node.0, core.look(node).map_or(0, |record| record.attempts))
}
