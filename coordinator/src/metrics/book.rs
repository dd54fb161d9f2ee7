//! The values of the metrics, updated by the events of a run.

use super::{PartsMetric, histogram::Histogram};
use crate::events::{RunEvent, Site};
use lookalike::graph::{NodeId, WorkerId};
use std::{collections::BTreeMap, time::Instant};

/// The state of a node.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum State {
    Waiting,
    Ready,
    Leased,
    Running,
    Completed,
    Failed,
    Cancelled,
}

impl State {
    pub(super) const ALL: [Self; 7] =
        [Self::Waiting, Self::Ready, Self::Leased, Self::Running, Self::Completed, Self::Failed, Self::Cancelled];

    /// The value of its label.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Waiting => "waiting",
            Self::Ready => "ready",
            Self::Leased => "leased",
            Self::Running => "running",
            Self::Completed => "completed",
            Self::Failed => "failed",
            Self::Cancelled => "cancelled",
        }
    }
}

/// An open node.
#[derive(Debug, Clone)]
struct Open {
    kind: String,
    state: State,
    /// When it became ready, while it waits for a worker.
    ready_since: Option<Instant>,
}

/// The values for one kind of node.
#[derive(Debug, Default)]
pub(super) struct OfKind {
    pub(super) nodes: BTreeMap<State, usize>,
    pub(super) seconds: Histogram,
}

/// All values.
#[derive(Debug)]
pub(super) struct Book {
    pub(super) began: Instant,
    open: BTreeMap<NodeId, Open>,
    pub(super) kinds: BTreeMap<String, OfKind>,
    pub(super) queue_seconds: Histogram,
    workers: BTreeMap<WorkerId, usize>,
    pub(super) joined: u64,
    pub(super) left: BTreeMap<&'static str, u64>,
    pub(super) attempts: u64,
    pub(super) requeued: u64,
    pub(super) duplicates: u64,
    pub(super) recalled: u64,
    pub(super) speculated: u64,
    pub(super) suspected: u64,
    pub(super) blobs_sent: u64,
    pub(super) blob_bytes_sent: u64,
    pub(super) output_bytes_received: u64,
    /// The parts by state, if the run has parts.
    pub(super) parts: Option<(PartsMetric, Vec<(&'static str, usize)>)>,
}

impl Book {
    pub(super) fn new(began: Instant) -> Self {
        Self {
            began,
            open: BTreeMap::new(),
            kinds: BTreeMap::new(),
            queue_seconds: Histogram::default(),
            workers: BTreeMap::new(),
            joined: 0,
            left: BTreeMap::new(),
            attempts: 0,
            requeued: 0,
            duplicates: 0,
            recalled: 0,
            speculated: 0,
            suspected: 0,
            blobs_sent: 0,
            blob_bytes_sent: 0,
            output_bytes_received: 0,
            parts: None,
        }
    }

    pub(super) fn workers(&self) -> usize {
        self.workers.len()
    }

    pub(super) fn threads(&self) -> usize {
        self.workers.values().sum()
    }

    /// The number of nodes that workers hold.
    pub(super) fn leases(&self) -> usize {
        self.open.values().filter(|open| open.state == State::Leased || open.state == State::Running).count()
    }

    /// Process an event.
    pub(super) fn note(&mut self, event: &RunEvent, now: Instant) {
        match event {
            RunEvent::WorkerJoined { worker, threads, .. } => {
                self.joined += 1;
                self.workers.insert(*worker, *threads);
            }
            RunEvent::WorkerLeft { worker, departure } => {
                self.workers.remove(worker);
                *self.left.entry(departure.word()).or_default() += 1;
            }
            RunEvent::BlobSent { bytes, .. } => {
                self.blobs_sent += 1;
                self.blob_bytes_sent += *bytes as u64;
            }
            RunEvent::DuplicateResult { .. } => self.duplicates += 1,
            RunEvent::NodeSpeculated { .. } => self.speculated += 1,
            RunEvent::NodeSuspected { .. } => self.suspected += 1,
            _ => self.note_node(event, now),
        }
    }

    fn note_node(&mut self, event: &RunEvent, now: Instant) {
        match event {
            RunEvent::NodeAdded { name } => {
                let open = Open { kind: name.kind.clone(), state: State::Waiting, ready_since: None };
                self.open.insert(name.node, open);
                *self.of(&name.kind).nodes.entry(State::Waiting).or_default() += 1;
            }
            RunEvent::NodeReady { node } => self.wait(*node, now),
            RunEvent::NodeAssigned { node, .. } => {
                self.attempts += 1;
                // A running node stays running when a second worker also gets it.
                if self.open.get(node).is_some_and(|open| open.state < State::Leased) {
                    self.change(*node, State::Leased);
                }
            }
            RunEvent::NodeStarted { name, site } => {
                self.attempts += u64::from(*site == Site::Coordinator);
                if let Some(since) = self.open.get_mut(&name.node).and_then(|open| open.ready_since.take()) {
                    self.queue_seconds.observe(now.saturating_duration_since(since));
                }
                self.change(name.node, State::Running);
            }
            RunEvent::NodeRequeued { name, .. } => {
                self.requeued += 1;
                self.wait(name.node, now);
            }
            RunEvent::NodeFinished { name, site, bytes, elapsed } => {
                if matches!(site, Site::Worker(_)) {
                    self.output_bytes_received += *bytes as u64;
                }
                self.of(&name.kind).seconds.observe(*elapsed);
                self.close(name.node, State::Completed);
            }
            RunEvent::NodeRecalled { name, .. } => {
                self.recalled += 1;
                self.close(name.node, State::Completed);
            }
            RunEvent::NodeFailed { name, reason } => {
                let state = if reason.is_cancellation() { State::Cancelled } else { State::Failed };
                self.close(name.node, state);
            }
            _ => {}
        }
    }

    fn of(&mut self, kind: &str) -> &mut OfKind {
        if !self.kinds.contains_key(kind) {
            self.kinds.insert(kind.to_owned(), OfKind::default());
        }
        self.kinds.entry(kind.to_owned()).or_default()
    }

    fn wait(&mut self, node: NodeId, now: Instant) {
        self.change(node, State::Ready);
        if let Some(open) = self.open.get_mut(&node) {
            open.ready_since = Some(now);
        }
    }

    fn change(&mut self, node: NodeId, state: State) {
        let Some(open) = self.open.get_mut(&node) else { return };
        let before = std::mem::replace(&mut open.state, state);
        if let Some(of_kind) = self.kinds.get_mut(&open.kind) {
            *of_kind.nodes.entry(before).or_default() -= 1;
            *of_kind.nodes.entry(state).or_default() += 1;
        }
    }

    fn close(&mut self, node: NodeId, state: State) {
        self.change(node, state);
        self.open.remove(&node);
    }
}
