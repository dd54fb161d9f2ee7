//! Nodes that are ready and wait for a worker, each in one place.

use std::collections::BTreeSet;
use std::time::Duration;

use lookalike::graph::NodeId;

/// The place where a node waits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Place {
    /// It does not wait for a worker.
    #[default]
    Nowhere,
    /// For any worker, with this priority.
    Queue(u32),
    /// Until this time, because it has repeatedly lost its worker.
    Delayed(Duration),
    /// For a worker on which it is the only node, since this time.
    Suspects(Duration),
    /// For a worker other than the one whose output is to be verified.
    Checks,
}

/// All waiting nodes, by place.
#[derive(Debug, Default)]
pub(crate) struct Waiting {
    /// By priority and number; the lowest goes first.
    queue: BTreeSet<(u32, NodeId)>,
    delayed: BTreeSet<(Duration, NodeId)>,
    suspects: BTreeSet<(Duration, NodeId)>,
    checks: BTreeSet<NodeId>,
}

impl Waiting {
    pub(crate) fn is_empty(&self) -> bool {
        self.queue.is_empty() && self.delayed.is_empty() && self.suspects.is_empty() && self.checks.is_empty()
    }

    pub(crate) fn enter(&mut self, node: NodeId, place: Place) {
        match place {
            Place::Nowhere => false,
            Place::Queue(priority) => self.queue.insert((priority, node)),
            Place::Delayed(until) => self.delayed.insert((until, node)),
            Place::Suspects(since) => self.suspects.insert((since, node)),
            Place::Checks => self.checks.insert(node),
        };
    }

    pub(crate) fn leave(&mut self, node: NodeId, place: Place) {
        match place {
            Place::Nowhere => false,
            Place::Queue(priority) => self.queue.remove(&(priority, node)),
            Place::Delayed(until) => self.delayed.remove(&(until, node)),
            Place::Suspects(since) => self.suspects.remove(&(since, node)),
            Place::Checks => self.checks.remove(&node),
        };
    }

    /// The next node for any worker.
    pub(crate) fn next(&self) -> Option<NodeId> {
        self.queue.first().map(|(_, node)| *node)
    }

    /// The suspect that has waited longest, and since when.
    pub(crate) fn suspect(&self) -> Option<(Duration, NodeId)> {
        self.suspects.first().copied()
    }

    /// The next nodes to be verified.
    pub(crate) fn checks(&self) -> impl Iterator<Item = NodeId> {
        self.checks.iter().copied()
    }

    /// A node whose delay is over.
    pub(crate) fn rested(&self, now: Duration) -> Option<NodeId> {
        self.delayed.first().filter(|(until, _)| *until <= now).map(|(_, node)| *node)
    }

    /// When the next delay is over.
    pub(crate) fn next_rested(&self) -> Option<Duration> {
        self.delayed.first().map(|(until, _)| *until)
    }

    #[cfg(test)]
    pub(crate) fn places(&self, node: NodeId) -> usize {
        let timed = |set: &BTreeSet<(Duration, NodeId)>| set.iter().filter(|(_, other)| *other == node).count();
        let plain = |set: &BTreeSet<NodeId>| usize::from(set.contains(&node));
        let queued = self.queue.iter().filter(|(_, other)| *other == node).count();
        queued + timed(&self.delayed) + timed(&self.suspects) + plain(&self.checks)
    }
}
