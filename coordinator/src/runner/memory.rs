//! The journal as the driver uses it: groups of actions that wait for their transaction, and the nodes of earlier epochs.

use std::collections::{HashMap, VecDeque};

use lookalike::graph::{Blob, NodeId, NodeKey, WorkerId};
use lookalike::protocol::LeaseName;

use super::RunError;
use crate::comm::Action;
use crate::core::Policy;
use crate::journal::{Batch, Journal};
use crate::reactor::Event;

/// How many groups may wait for their transactions. With one, what comes while it is written becomes the next: a transaction costs
/// as much as many events, and a node that begins and ends within one is written once.
const WAITING_GROUPS: usize = 1;

/// What a group of events has led to: done once it is written down.
#[derive(Debug, Default)]
pub(super) struct Group {
    pub(super) actions: Vec<Action>,
    /// Answers to leases of earlier epochs, to be acknowledged.
    pub(super) late: Vec<(WorkerId, LeaseName)>,
    /// What the journal is told of it.
    pub(super) batch: Batch,
}

/// What the run has written down, and what waits for that.
#[derive(Debug)]
pub(super) struct Memory {
    journal: Option<Journal>,
    /// What nodes of today compute, where there were earlier epochs.
    today: HashMap<NodeKey, NodeId>,
    /// Whether outputs are believed as they are: none waits for a second computation.
    keeps_early: bool,
    waiting: VecDeque<Group>,
}

impl Memory {
    /// The memory of a run with a journal, or without.
    pub(super) fn new(journal: Option<Journal>, policy: &Policy) -> Self {
        let keeps_early = policy.verify_fraction <= 0.0;
        Self { journal, today: HashMap::new(), keeps_early, waiting: VecDeque::new() }
    }

    /// Whether there is a journal to tell.
    pub(super) fn is_kept(&self) -> bool {
        self.journal.is_some()
    }

    /// Whether another group may be made now.
    pub(super) fn has_room(&self) -> bool {
        self.waiting.len() < WAITING_GROUPS
    }

    /// Whether nothing waits to be written.
    pub(super) fn is_written(&self) -> bool {
        self.waiting.is_empty()
    }

    /// Write a group down; it comes back from [`Self::written`]. One that needs no writing comes back at once, if it is its turn.
    pub(super) fn submit(&mut self, mut group: Group) -> Option<Group> {
        let Some(journal) = &mut self.journal else { return Some(group) };
        if journal.epoch > 1 {
            for (key, node) in group.batch.keys() {
                self.today.entry(key).or_insert(node);
            }
        }
        let batch = std::mem::take(&mut group.batch);
        if self.waiting.is_empty() && !batch.is_urgent() {
            if !batch.is_empty() {
                journal.note(batch);
            }
            return Some(group);
        }
        journal.commit(batch);
        self.waiting.push_back(group);
        None
    }

    /// The next group that is written down. Waits for ever if none is on its way.
    pub(super) async fn written(&mut self) -> Result<Group, RunError> {
        let (Some(journal), false) = (&mut self.journal, self.waiting.is_empty()) else {
            return std::future::pending().await;
        };
        journal.committed().await?;
        Ok(self.waiting.pop_front().unwrap_or_default())
    }

    /// The number that a node of an earlier epoch has today.
    pub(super) fn today(&self, lease: LeaseName) -> Option<NodeId> {
        let key = self.journal.as_ref()?.past.keys.get(&(lease.epoch, lease.node))?;
        self.today.get(key).copied()
    }

    /// A worker has answered to a lease of an earlier epoch: what that means today.
    pub(super) fn late_answer(
        &mut self,
        worker: WorkerId,
        lease: LeaseName,
        output: Option<Blob>,
        group: &mut Group,
    ) -> Event {
        group.late.push((worker, lease));
        let key = self.journal.as_ref().and_then(|journal| journal.past.keys.get(&(lease.epoch, lease.node))).copied();
        match (key.map(|key| (key, self.today.get(&key))), output) {
            (Some((_, Some(node))), Some(output)) => return Event::Recovered { worker, node: *node, output },
            // Its node has not been planned today. It will be: the plan is the same. Where outputs are verified it may have to be, too.
            (Some((key, None)), Some(output)) if self.keeps_early => {
                group.batch.keep(key, output);
                self.journal.iter().for_each(|journal| journal.learn(key));
            }
            // An error that its node would have again, or a node that was lost with the machine: it runs again.
            _ => {}
        }
        Event::Heartbeat { worker, executing: Vec::new() }
    }

    /// The run is over.
    pub(super) fn close(&mut self, ended: Option<String>) -> Result<(), RunError> {
        Ok(self.journal.take().map_or(Ok(()), |journal| journal.close(ended))?)
    }

    /// The run could not begin.
    pub(super) fn discard(&mut self) {
        self.journal.take().into_iter().for_each(Journal::discard);
    }
}
