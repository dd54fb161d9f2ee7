//! How long the nodes of each kind take, and which running nodes are slow.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::time::Duration;

use lookalike::graph::NodeId;

use crate::policy::Speculation;

/// How many of the latest nodes of a kind determine its usual duration.
const RECENT: usize = 63;

/// If the duration of its kind is unknown, a node is slow after this many times [`Speculation::after`].
const UNKNOWN_IS_SLOW_AFTER: u32 = 12;

/// How many nodes of a kind have to end before the duration of the kind is known.
pub(crate) const ESTABLISHED: usize = 8;

/// The pace of every kind.
#[derive(Debug, Default)]
pub(crate) struct Pace {
    kinds: BTreeMap<String, KindPace>,
    /// The longest time that any node took.
    longest: Duration,
}

#[derive(Debug, Default)]
struct KindPace {
    /// In order of completion.
    recent: VecDeque<Duration>,
    /// The same, sorted by length.
    sorted: Vec<Duration>,
    /// Nodes that run on one worker and could run on a second one, with their start times.
    running: BTreeSet<(Duration, NodeId)>,
}

impl Pace {
    /// Add the time that a node took.
    pub(crate) fn note(&mut self, kind: &str, took: Duration) {
        self.longest = self.longest.max(took);
        let pace = self.of(kind);
        if pace.recent.len() == RECENT
            && let Some(oldest) = pace.recent.pop_front()
            && let Ok(place) = pace.sorted.binary_search(&oldest)
        {
            pace.sorted.remove(place);
        }
        pace.recent.push_back(took);
        let place = pace.sorted.partition_point(|other| *other < took);
        pace.sorted.insert(place, took);
    }

    /// The recent median duration of a kind, once enough nodes have ended. A single one is not enough, because a busy coordinator
    /// may read the start and the end of a node at the same time.
    pub(crate) fn established(&self, kind: &str) -> Option<Duration> {
        self.kinds.get(kind).filter(|pace| pace.sorted.len() >= ESTABLISHED)?.usual()
    }

    /// Watch a node that has run since `since` and could run on a second worker.
    pub(crate) fn watch(&mut self, kind: &str, since: Duration, node: NodeId) {
        self.of(kind).running.insert((since, node));
    }

    /// Stop watching a node.
    pub(crate) fn forget(&mut self, kind: &str, since: Duration, node: NodeId) {
        if let Some(pace) = self.kinds.get_mut(kind) {
            pace.running.remove(&(since, node));
        }
    }

    /// The longest running slow node for which `is_wanted` holds.
    pub(crate) fn slowest(
        &self,
        speculation: Speculation,
        now: Duration,
        is_wanted: impl Fn(NodeId) -> bool,
    ) -> Option<NodeId> {
        let slowest_of = |pace: &KindPace| {
            let limit = pace.limit(speculation, self.longest)?;
            let slow = pace.running.iter().take_while(|(since, _)| *since + limit <= now);
            slow.copied().find(|(_, node)| is_wanted(*node))
        };
        self.kinds.values().filter_map(slowest_of).min().map(|(_, node)| node)
    }

    /// When the next node becomes slow.
    pub(crate) fn next_slow(&self, speculation: Speculation, now: Duration) -> Option<Duration> {
        let next_of = |pace: &KindPace| {
            let limit = pace.limit(speculation, self.longest)?;
            // Nodes that started at or before this time are slow already. Before the limit has passed, no node is.
            let first = match now.checked_sub(limit) {
                Some(begin) => pace.running.range((begin, NodeId(u64::MAX))..).next(),
                None => pace.running.first(),
            };
            first.map(|(since, _)| *since + limit)
        };
        self.kinds.values().filter_map(next_of).min()
    }

    fn of(&mut self, kind: &str) -> &mut KindPace {
        self.kinds.entry(kind.to_owned()).or_default()
    }
}

impl KindPace {
    fn usual(&self) -> Option<Duration> {
        self.sorted.get(self.sorted.len() / 2).copied()
    }

    /// After how long a node of this kind is slow; `None` for never.
    fn limit(&self, speculation: Speculation, longest: Duration) -> Option<Duration> {
        let factor = speculation.factor?;
        let (known, least) = match self.usual() {
            Some(median) => (median, speculation.after),
            // Without this limit, the only node of its kind would never be slow.
            None => (longest, speculation.after.saturating_mul(UNKNOWN_IS_SLOW_AFTER)),
        };
        // The factor of a policy is finite. A time that overflows is replaced by one that is never reached.
        let slow = Duration::try_from_secs_f64(known.as_secs_f64() * factor).unwrap_or(Duration::MAX / 2);
        Some(slow.max(least).min(Duration::MAX / 2))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: Duration = Duration::from_secs(1);

    #[test]
    fn node_is_slow_after_twice_the_median_of_its_kind_and_a_minimum_time() {
        let policy = Speculation { factor: Some(2.0), after: 5 * SECOND };
        let mut pace = Pace::default();
        pace.watch("search", 10 * SECOND, NodeId(1));
        let all = |_| true;
        // The duration of its kind is unknown, so the limit is longer.
        assert_eq!(pace.next_slow(policy, 10 * SECOND), Some(70 * SECOND));
        pace.note("transport", 100 * SECOND);
        assert_eq!(pace.next_slow(policy, 10 * SECOND), Some(210 * SECOND));
        assert_eq!(pace.slowest(policy, 209 * SECOND, all), None);
        assert_eq!(pace.slowest(policy, 210 * SECOND, all), Some(NodeId(1)));
        [1, 2, 9].iter().for_each(|took| pace.note("search", *took * SECOND));
        assert_eq!(pace.next_slow(policy, 10 * SECOND), Some(15 * SECOND));
        [9, 9].iter().for_each(|took| pace.note("search", *took * SECOND));
        assert_eq!(pace.next_slow(policy, 10 * SECOND), Some(28 * SECOND));
        assert_eq!(pace.slowest(policy, 27 * SECOND, all), None);
        assert_eq!(pace.slowest(policy, 28 * SECOND, all), Some(NodeId(1)));
        assert_eq!(pace.next_slow(policy, 28 * SECOND), None);
        assert_eq!(pace.slowest(policy, 28 * SECOND, |_| false), None);
        pace.forget("search", 10 * SECOND, NodeId(1));
        assert_eq!(pace.slowest(policy, 28 * SECOND, all), None);
    }

    #[test]
    fn median_is_that_of_recent_nodes() {
        let policy = Speculation { factor: Some(1.0), after: Duration::ZERO };
        let mut pace = Pace::default();
        (0..RECENT).for_each(|_| pace.note("k", 100 * SECOND));
        (0..RECENT).for_each(|_| pace.note("k", SECOND));
        pace.watch("k", Duration::ZERO, NodeId(0));
        assert_eq!(pace.next_slow(policy, Duration::ZERO), Some(SECOND));
        assert_eq!((pace.kinds["k"].recent.len(), pace.kinds["k"].sorted.len()), (RECENT, RECENT));
    }
}
