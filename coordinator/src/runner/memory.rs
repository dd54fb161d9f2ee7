//! The journal, as the driver uses it: groups of actions wait for their transactions.

use std::collections::VecDeque;

use super::RunError;
use crate::actions::Action;
use crate::journal::{Batch, Journal};

/// How many groups may wait for their transactions. With one, the events that arrive while it is written form the next group.
/// This saves time: a transaction costs as much as many events, and a node that starts and ends within one is written once.
const WAITING_GROUPS: usize = 1;

/// The actions of a group of events, which are performed once it is committed.
#[derive(Debug, Default)]
pub(super) struct Group {
    pub(super) actions: Vec<Action>,
    /// The rows of the group for the journal.
    pub(super) batch: Batch,
}

/// The journal of the run, and the groups that wait for their transactions.
#[derive(Debug)]
pub(super) struct Memory {
    journal: Option<Journal>,
    waiting: VecDeque<Group>,
}

impl Memory {
    /// The memory of a run, with or without a journal.
    pub(super) fn new(journal: Option<Journal>) -> Self {
        Self { journal, waiting: VecDeque::new() }
    }

    /// Whether there is a journal.
    pub(super) fn is_kept(&self) -> bool {
        self.journal.is_some()
    }

    /// Whether another group may be submitted now.
    pub(super) fn has_room(&self) -> bool {
        self.waiting.len() < WAITING_GROUPS
    }

    /// Whether all groups are written.
    pub(super) fn is_written(&self) -> bool {
        self.waiting.is_empty()
    }

    /// Commit a group, which [`Self::written`] then returns. A group that needs no commit is returned at once if no other group
    /// waits.
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

    /// Wait for the next committed group; for ever if no group is outstanding.
    pub(super) async fn written(&mut self) -> Result<Group, RunError> {
        let (Some(journal), false) = (&mut self.journal, self.waiting.is_empty()) else {
            return std::future::pending().await;
        };
        journal.committed().await?;
        Ok(self.waiting.pop_front().unwrap_or_default())
    }

    /// Close the journal at the end of the run.
    pub(super) fn close(&mut self, ended: Option<String>) -> Result<(), RunError> {
        Ok(self.journal.take().map_or(Ok(()), |journal| journal.close(ended))?)
    }

    /// Remove the journal of a run that could not begin.
    pub(super) fn discard(&mut self) {
        self.journal.take().into_iter().for_each(Journal::discard);
    }
}
