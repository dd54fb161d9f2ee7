//! Worker processes that have lost their connection. Many reconnect, because a connection may break without a death.

use std::collections::BTreeMap;

use lookalike::graph::NodeId;
use lookalike::protocol::ProcessName;

/// How many of them are remembered: as many as there may be connections, because one network failure may break them all at once.
const REMEMBERED: usize = 4096;

/// A process that has lost its connection.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Lost {
    /// It had executed no node.
    pub(crate) was_fresh: bool,
    /// The attempts that it has not answered. It may continue them.
    pub(crate) attempts: BTreeMap<NodeId, u32>,
    /// The deaths that were counted against nodes when it was lost.
    pub(crate) deaths: Vec<(NodeId, Death)>,
}

/// How a death is counted: see [`Deaths`](super::Deaths).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Death {
    InCompany,
    Alone,
    NotCounted,
}

/// The remembered processes.
#[derive(Debug, Default)]
pub(crate) struct Departed {
    /// Each with its number in the order of departures.
    by_process: BTreeMap<ProcessName, (u64, Lost)>,
    order: BTreeMap<u64, ProcessName>,
    next: u64,
}

impl Departed {
    /// Remember a process that has lost its connection.
    pub(crate) fn insert(&mut self, process: ProcessName, lost: Lost) {
        self.remove(process);
        self.by_process.insert(process, (self.next, lost));
        self.order.insert(self.next, process);
        self.next += 1;
        if self.order.len() > REMEMBERED
            && let Some((_, first)) = self.order.pop_first()
        {
            self.by_process.remove(&first);
        }
    }

    /// Remove a process that has reconnected.
    pub(crate) fn remove(&mut self, process: ProcessName) -> Option<Lost> {
        let (place, lost) = self.by_process.remove(&process)?;
        self.order.remove(&place);
        Some(lost)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn latest_departures_are_kept_once_each() {
        let name = |number: usize| ProcessName((number as u128).to_le_bytes());
        let mut departed = Departed::default();
        (0..REMEMBERED + 2).for_each(|number| departed.insert(name(number), Lost::default()));
        departed.insert(name(5), Lost { was_fresh: true, ..Lost::default() });
        assert_eq!((departed.by_process.len(), departed.order.len()), (REMEMBERED, REMEMBERED));
        assert!(departed.remove(name(1)).is_none() && departed.remove(name(2)).is_some());
        assert_eq!(departed.remove(name(5)).map(|lost| lost.was_fresh), Some(true));
        assert!(departed.remove(name(5)).is_none());
    }
}
