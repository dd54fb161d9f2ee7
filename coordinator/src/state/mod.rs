//! The coordinator's state: the graph, the leases, the members. Data and queries; [`reactor`](crate::reactor) changes it.

mod deaths;
mod departed;
mod members;
mod pace;
pub mod past_outputs;
mod waiting;

use std::collections::VecDeque;
use std::time::Duration;

use lookalike::graph::{Blob, BlobHash, Graph, NodeId, NodeKey, NodeSpec, WorkerId};
use lookalike::protocol::ProcessName;

pub use self::deaths::Deaths;
pub(crate) use self::departed::{Death, Departed, Lost};
pub(crate) use self::members::{Held, Member, Members};
use self::members::{Size, weight};
use self::pace::Pace;
use self::past_outputs::PastOutputs;
pub(crate) use self::waiting::{Place, Waiting};
use crate::events::{NodeName, Site};
use crate::policy::Policy;

/// Counts of a run, to show to the user. No result may depend on them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RunSummary {
    /// How many nodes were completed.
    pub completed_nodes: usize,
    /// How many of them had been completed by an earlier coordinator of this run.
    pub recalled_nodes: usize,
    /// How many nodes failed.
    pub failed_nodes: usize,
    /// How many nodes were cancelled because their output was not needed any more.
    pub cancelled_nodes: usize,
    /// How many leases were given out, plus how often the coordinator ran a node.
    pub attempts: u64,
    /// How many nodes went back to the queue because their worker left.
    pub requeued_nodes: u64,
    /// How many results were bit-identical copies that had not been asked for.
    pub duplicate_results: u64,
    /// How many nodes were given to a second worker because the first one was slow.
    pub speculated_nodes: u64,
    /// How many outputs were verified by running their node a second time.
    pub verified_nodes: u64,
    /// How often a node became a suspect, which runs alone.
    pub suspected_nodes: u64,
    /// How many workers joined. One that reconnects is counted again.
    pub workers_joined: u64,
    /// How many workers left before the end.
    pub workers_left: u64,
    /// How many blobs were sent to workers.
    pub blobs_sent: u64,
    /// Their total size in bytes.
    pub blob_bytes_sent: u64,
    /// The total size in bytes of the outputs that came from workers.
    pub output_bytes_received: u64,
}

/// The memory of an assignment without the data that it points to.
const ASSIGNMENT_BYTES: usize = 128;

/// The coordinator's state.
#[derive(Debug)]
pub struct Core {
    pub(crate) policy: Policy,
    pub(crate) epoch: u64,
    pub(crate) graph: Graph,
    /// One per node of the graph.
    pub(crate) records: Vec<Record>,
    pub(crate) waiting: Waiting,
    pub(crate) members: Members,
    pub(crate) pace: Pace,
    /// When the next node becomes slow, if a worker has an idle thread for it.
    pub(crate) next_slow: Option<Duration>,
    /// When the busiest worker counts as stalled, so that its unbegun short nodes may be moved.
    pub(crate) next_move: Option<Duration>,
    /// When a waiting suspect stops waiting for a fresh worker.
    pub(crate) next_patience: Option<Duration>,
    /// The worker that is being freed for a suspect.
    pub(crate) clearing: Option<WorkerId>,
    /// The latest deaths of workers that no suspect explains.
    pub(crate) unexplained: VecDeque<Unexplained>,
    /// The processes that have lost their connection and may reconnect.
    pub(crate) departed: Departed,
    /// Since when there has been work but no worker.
    pub(crate) starving: Option<Starving>,
    /// How the last local worker ended, if none will be restarted and no other can join.
    pub(crate) given_up: Option<String>,
    pub(crate) summary: RunSummary,
    /// The outputs of earlier coordinators of this run.
    pub(crate) past_outputs: Option<Box<dyn PastOutputs>>,
}

/// The coordinator's data about a node, in addition to the graph.
#[derive(Debug, Default)]
pub(crate) struct Record {
    /// How often it was given out.
    pub(crate) attempts: u32,
    pub(crate) place: Place,
    /// The workers that have a lease of it: one, or two if the first was slow.
    pub(crate) holders: Vec<WorkerId>,
    /// Since when the coordinator itself has been running it.
    pub(crate) here_since: Option<Duration>,
    /// The start time under which [`Pace`] watches it.
    pub(crate) watched: Option<Duration>,
    /// Whether its output must be computed twice.
    pub(crate) is_verified: bool,
    /// The first of the two outputs.
    pub(crate) candidate: Option<Box<Candidate>>,
    /// The origin of its output or its error.
    pub(crate) finished_by: Option<Site>,
    /// How often a worker was lost while executing it, except by a drain.
    pub(crate) losses: u32,
    pub(crate) deaths: Deaths,
    /// The key of its computation, known once it is ready if the run has a journal.
    pub(crate) key: Option<NodeKey>,
}

/// An output that waits for its verification.
#[derive(Debug)]
pub(crate) struct Candidate {
    pub(crate) site: Site,
    /// The process it came from, if it was a member then.
    pub(crate) process: Option<ProcessName>,
    pub(crate) attempt: u32,
    pub(crate) output: Blob,
    /// How long the node ran under this lease; `None` if unknown.
    pub(crate) took: Option<Duration>,
}

/// The death of a worker that no suspect explains.
#[derive(Debug)]
pub(crate) struct Unexplained {
    pub(crate) when: Duration,
    pub(crate) process: ProcessName,
    pub(crate) executed: Vec<NodeId>,
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct Starving {
    pub(crate) since: Duration,
    pub(crate) next_reminder: Duration,
}

impl Core {
    /// The state at the start of a run. `epoch` counts the coordinator processes of the run, from 1.
    #[must_use]
    pub fn new(policy: Policy, epoch: u64) -> Self {
        Self {
            policy,
            epoch,
            graph: Graph::new(),
            records: Vec::new(),
            waiting: Waiting::default(),
            members: Members::new(policy.spare_leases),
            pace: Pace::default(),
            next_slow: None,
            next_move: None,
            next_patience: None,
            clearing: None,
            unexplained: VecDeque::new(),
            departed: Departed::default(),
            starving: None,
            given_up: None,
            summary: RunSummary::default(),
            past_outputs: None,
        }
    }

    /// Complete nodes from the outputs of earlier coordinators of this run, where available.
    #[must_use]
    pub fn with_past_outputs(self, past_outputs: Box<dyn PastOutputs>) -> Self {
        Self { past_outputs: Some(past_outputs), ..self }
    }

    /// The graph of the run.
    #[must_use]
    pub fn graph(&self) -> &Graph {
        &self.graph
    }

    /// The counts of the run so far.
    #[must_use]
    pub fn summary(&self) -> RunSummary {
        self.summary
    }

    /// Whether no node is open.
    #[must_use]
    pub fn is_finished(&self) -> bool {
        self.graph.is_drained()
    }

    /// When [`Event::DeadlinePassed`](crate::reactor::Event::DeadlinePassed) is due next, as time since the run began.
    #[must_use]
    pub fn next_deadline(&self) -> Option<Duration> {
        let limit = self.starvation_limit();
        let starvation = self.starving.map(|starving| starving.next_reminder.min(starving.since + limit));
        let delays = [
            self.members.next_deadline(),
            self.waiting.next_rested(),
            self.next_slow,
            self.next_move,
            self.next_patience,
        ];
        delays.into_iter().flatten().chain(starvation).min()
    }

    /// Whether this attempt was given out. Any worker may answer for it, because a worker that reconnects has a new number.
    pub(crate) fn was_given_out(&self, node: NodeId, attempt: u32) -> bool {
        self.look(node).is_some_and(|record| (1..=record.attempts).contains(&attempt))
    }

    /// How long there may be work without a worker.
    pub(crate) fn starvation_limit(&self) -> Duration {
        let had_workers = self.summary.workers_joined > 0;
        if had_workers { self.policy.grace } else { self.policy.wait_for_workers }
    }

    pub(crate) fn name(&self, node: NodeId) -> NodeName {
        let of = |spec: &NodeSpec| (spec.kind.clone(), spec.label.clone(), spec.priority);
        let (kind, label, part) = self.graph.spec(node).map(of).unwrap_or_default();
        NodeName { node, kind, label, part }
    }

    /// The record of a node. The reactor adds it before any other change of the node.
    pub(crate) fn record(&mut self, node: NodeId) -> Option<&mut Record> {
        self.records.get_mut(usize::try_from(node.0).ok()?)
    }

    /// The same, read-only.
    pub(crate) fn look(&self, node: NodeId) -> Option<&Record> {
        self.records.get(usize::try_from(node.0).ok()?)
    }

    /// Whether a node must run alone.
    pub(crate) fn is_suspect(&self, node: NodeId) -> bool {
        self.look(node).is_some_and(|record| record.deaths.in_company >= self.policy.suspect_after)
    }

    /// Move a node to another waiting place.
    pub(crate) fn put(&mut self, node: NodeId, place: Place) {
        if let Some(record) = self.record(node) {
            let before = std::mem::replace(&mut record.place, place);
            self.waiting.leave(node, before);
            self.waiting.enter(node, place);
        }
    }

    /// Record a lease of a node for a worker.
    pub(crate) fn give(&mut self, worker: WorkerId, node: NodeId, attempt: u32, now: Duration) {
        let inputs = self.graph.input_hashes(node).unwrap_or_default();
        let spec = self.graph.spec(node);
        let parameters = spec.map_or(0, |spec| spec.parameters.len());
        let named = spec.map_or(0, |spec| spec.kind.len() + spec.label.bytes());
        let bytes = ASSIGNMENT_BYTES + parameters + named + inputs.len() * size_of::<BlobHash>();
        let size = Size { bytes, time: weight(spec.and_then(|spec| self.pace.established(&spec.kind))) };
        self.members.change(worker, |member| {
            member.give(node, attempt, size, now);
            member.add_inputs(&inputs);
        });
        if let Some(record) = self.record(node) {
            record.holders.push(worker);
        }
        self.watch(node);
    }

    /// End a lease.
    pub(crate) fn end_lease(&mut self, worker: WorkerId, node: NodeId, now: Duration) -> Option<Held> {
        let inputs = self.graph.input_hashes(node).unwrap_or_default();
        let end = |member: &mut Member| {
            let held = member.end(node, now)?;
            member.remove_inputs(&inputs);
            Some(held)
        };
        let held = self.members.change(worker, end).flatten()?;
        self.forget_holder(worker, node);
        Some(held)
    }

    /// Remove a worker from the holders of a node.
    pub(crate) fn forget_holder(&mut self, worker: WorkerId, node: NodeId) {
        if let Some(record) = self.record(node) {
            record.holders.retain(|holder| *holder != worker);
        }
        self.watch(node);
    }

    /// Watch the pace of a node that one worker executes and a second one could run too; stop watching any other node.
    pub(crate) fn watch(&mut self, node: NodeId) {
        let wanted = match self.look(node).map(|record| record.holders.as_slice()) {
            Some([holder]) if !self.is_suspect(node) => {
                let member = self.members.get(*holder);
                member.and_then(|member| member.leases.get(&node)).and_then(|held| held.started_at)
            }
            _ => None,
        };
        let Some(record) = self.record(node) else { return };
        let watched = std::mem::replace(&mut record.watched, wanted);
        if watched == wanted {
            return;
        }
        let kind = self.graph.spec(node).map_or("", |spec| spec.kind.as_str());
        watched.into_iter().for_each(|since| self.pace.forget(kind, since, node));
        wanted.into_iter().for_each(|since| self.pace.watch(kind, since, node));
    }
}
