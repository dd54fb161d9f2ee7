//! The coordinator's state: the graph, who holds which node, who is a member. Data and questions; what changes it is in
//! [`reactor`](crate::reactor).

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use lookalike::graph::{BlobHash, Graph, NodeId, NodeKey, WorkerId};

use crate::comm::{Lease, NodeName, Site};
use crate::recall::Recall;

/// How the coordinator treats workers and nodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Policy {
    /// A node fails once this many workers have died while they executed it.
    pub node_crashes: u32,
    /// How many leases a worker holds beyond its threads, so that it never waits for the next one.
    pub spare_leases: usize,
    /// A worker that was not heard of for this long is lost.
    pub lost_after: Duration,
    /// How long to wait for the first worker.
    pub wait_for_workers: Duration,
    /// How often to tell the user about it.
    pub remind_every: Duration,
    /// How long to wait for another worker after the last one was lost.
    pub grace: Duration,
}

/// The defaults of design section 8.
impl Default for Policy {
    fn default() -> Self {
        Self {
            node_crashes: 3,
            spare_leases: 2,
            lost_after: Duration::from_secs(5),
            wait_for_workers: Duration::from_mins(10),
            remind_every: Duration::from_secs(30),
            grace: Duration::from_mins(1),
        }
    }
}

/// What a run has cost, for people: nothing of it may reach a result.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RunSummary {
    /// How many nodes were completed.
    pub completed_nodes: usize,
    /// How many of them had been completed by an earlier coordinator of this run.
    pub recalled_nodes: usize,
    /// How many nodes failed.
    pub failed_nodes: usize,
    /// How many leases were given out, and how often a node was run by the coordinator.
    pub attempts: u64,
    /// How many nodes went back to the queue because their worker left.
    pub requeued_nodes: u64,
    /// How many results came a second time, bit for bit the same.
    pub duplicate_results: u64,
    /// How many workers joined; one that reconnects counts again.
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

/// The coordinator's state.
#[derive(Debug)]
pub struct Core {
    pub(crate) policy: Policy,
    pub(crate) epoch: u64,
    pub(crate) graph: Graph,
    /// One per node of the graph.
    pub(crate) records: Vec<Record>,
    /// Ready nodes that wait for a worker; the lowest number goes first.
    pub(crate) queue: BTreeSet<NodeId>,
    pub(crate) workers: BTreeMap<WorkerId, Member>,
    /// Since when there is work but no worker.
    pub(crate) starving: Option<Starving>,
    /// How the last local worker ended, once none will be started again and no other can join.
    pub(crate) given_up: Option<String>,
    pub(crate) summary: RunSummary,
    /// Which workers that are about to join execute which nodes for an earlier coordinator of this run.
    pub(crate) continued: Vec<(WorkerId, NodeId)>,
    /// What earlier coordinators of this run have left.
    pub(crate) recall: Option<Box<dyn Recall>>,
}

/// What the coordinator knows of a node beside the graph.
#[derive(Clone, Debug, Default)]
pub(crate) struct Record {
    pub(crate) attempts: u32,
    pub(crate) crashes: u32,
    pub(crate) holder: Option<Site>,
    pub(crate) started_at: Option<Duration>,
    /// Where its output came from.
    pub(crate) finished_by: Option<Site>,
    /// What it computes: known once it is ready, where the run is remembered.
    pub(crate) key: Option<NodeKey>,
}

/// A worker that has joined.
#[derive(Clone, Debug)]
pub(crate) struct Member {
    pub(crate) threads: usize,
    pub(crate) leases: BTreeMap<NodeId, Lease>,
    pub(crate) executing: BTreeSet<NodeId>,
    /// The inputs of every node it was ever given: what it may read. (One that was taken back may still be asked about.)
    pub(crate) readable: BTreeSet<BlobHash>,
    pub(crate) deadline: Duration,
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct Starving {
    pub(crate) since: Duration,
    pub(crate) next_reminder: Duration,
}

impl Core {
    /// The state at the begin of a run. `epoch` counts the coordinator processes of the run, from 1.
    #[must_use]
    pub fn new(policy: Policy, epoch: u64) -> Self {
        Self {
            policy,
            epoch,
            graph: Graph::new(),
            records: Vec::new(),
            queue: BTreeSet::new(),
            workers: BTreeMap::new(),
            starving: None,
            given_up: None,
            summary: RunSummary::default(),
            continued: Vec::new(),
            recall: None,
        }
    }

    /// Complete nodes from what earlier coordinators of this run have left, wherever there is something.
    #[must_use]
    pub fn with_recall(self, recall: Box<dyn Recall>) -> Self {
        Self { recall: Some(recall), ..self }
    }

    /// The graph of the run.
    #[must_use]
    pub fn graph(&self) -> &Graph {
        &self.graph
    }

    /// What the run has cost so far.
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
        self.workers.values().map(|member| member.deadline).chain(starvation).min()
    }

    /// How long there may be work without a worker.
    pub(crate) fn starvation_limit(&self) -> Duration {
        let had_workers = self.summary.workers_joined > 0;
        if had_workers { self.policy.grace } else { self.policy.wait_for_workers }
    }

    pub(crate) fn name(&self, node: NodeId) -> NodeName {
        let (kind, label) =
            self.graph.spec(node).map(|spec| (spec.kind.clone(), spec.label.clone())).unwrap_or_default();
        NodeName { node, kind, label }
    }

    /// The record of a node; the reactor makes one for each node before anything else happens to it.
    pub(crate) fn record(&mut self, node: NodeId) -> Option<&mut Record> {
        self.records.get_mut(usize::try_from(node.0).ok()?)
    }

    /// The member with free places that is least busy for its threads.
    pub(crate) fn least_busy(&self, has_place: impl Fn(&Member) -> bool) -> Option<WorkerId> {
        let free = self.workers.iter().filter(|(_, member)| has_place(member));
        // leases_a / threads_a < leases_b / threads_b without a division; `min_by` takes the first of equals.
        let load = |(_, a): &(&WorkerId, &Member), (_, b): &(&WorkerId, &Member)| {
            (a.leases.len() * b.threads).cmp(&(b.leases.len() * a.threads))
        };
        free.min_by(load).map(|(worker, _)| *worker)
    }
}
