//! The journal as the driver uses it: groups of actions that wait for their transaction.

use std::collections::VecDeque;

use super::RunError;
use crate::actions::Action;
use crate::journal::{Batch, Journal};

/// How many groups may wait for their transactions. With one, what comes while it is written becomes the next: a transaction costs
/// as much as many events, and a node that begins and ends within one is written once.
const WAITING_GROUPS: usize = 1;

/// The actions of a group of events: performed once it is committed.
#[derive(Debug, Default)]
pub(super) struct Group {
    pub(super) actions: Vec<Action>,
    /// What the journal is told of it.
    pub(super) batch: Batch,
}

/// The journal of the run, and the groups that wait for their transactions.
#[derive(Debug)]
pub(super) struct Memory {
    journal: Option<Journal>,
    waiting: VecDeque<Group>,
}

impl Memory {
    /// The memory of a run with a journal, or without.
    pub(super) fn new(journal: Option<Journal>) -> Self {
        Self { journal, waiting: VecDeque::new() }
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

    /// Commit a group; it comes back from [`Self::written`]. One that needs no commit comes back at once, if it is its turn.
    pub(super) fn submit(&mut self, mut group: Group) -> Option<Group> {
        let Some(journal) = &mut self.journal else { return Some(group) };
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

    /// The next committed group. Waits for ever if none is on its way.
    pub(super) async fn written(&mut self) -> Result<Group, RunError> {
        let (Some(journal), false) = (&mut self.journal, self.waiting.is_empty()) else {
            return std::future::pending().await;
        };
        journal.committed().await?;
        Ok(self.waiting.pop_front().unwrap_or_default())
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
