//! The workers that have joined, and which of them is next. Every query over all of them has an index, so that no event costs more for a
//! thousand workers than for ten.

use std::cmp::Ordering;
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use lookalike::graph::{BlobHash, NodeId, WorkerId};
use lookalike::protocol::ProcessName;

use super::departed::Lost;
use crate::actions::WorkerProcess;

/// How many bytes of assignments a worker may have been given that it has not begun with. What waits in its queue stays as
/// small as this, and one assignment.
const UNBEGUN_BYTES: usize = 8 << 20;

/// How long a worker shall have something to do for each of its threads without being heard: more than the journal and the way
/// there and back take.
const ENOUGH: Duration = Duration::from_millis(10);

/// A worker without progress for this long is stalled; on a busy machine a process may wait for some 10 ms.
const STANDSTILL: Duration = Duration::from_millis(50);

/// A node that takes less than this is short: a worker is given many of them at a time.
const SHORT: Duration = Duration::from_millis(1);

/// No node is thought to take less.
const SHORTEST: Duration = Duration::from_micros(20);

/// The weight of a node that is not short, or whose kind has no known duration.
const LONG: Duration = Duration::from_hours(1);

/// The weight, in a worker's queue, of a node whose kind usually takes this long.
pub(crate) fn weight(usual: Option<Duration>) -> Duration {
    usual.filter(|usual| *usual < SHORT).map_or(LONG, |usual| usual.max(SHORTEST))
}

/// A worker that has joined.
#[derive(Clone, Debug)]
pub(crate) struct Member {
    pub(crate) process: WorkerProcess,
    pub(crate) threads: usize,
    pub(crate) leases: BTreeMap<NodeId, Held>,
    /// The leases that it has not begun with.
    pub(crate) waiting: BTreeSet<NodeId>,
    waiting_bytes: usize,
    /// How long they will take one after the other.
    waiting_time: Duration,
    /// The inputs of every node it was ever given: what it may read. (One that was taken back may still be asked about.)
    pub(crate) readable: BTreeSet<BlobHash>,
    /// When it is lost, and with it its leases, unless it is heard of before.
    pub(crate) deadline: Duration,
    /// It was asked to end: it finishes what it executes and gets nothing more.
    pub(crate) is_draining: bool,
    /// It gets nothing more until a suspect has it for itself.
    pub(crate) is_clearing: bool,
    /// The suspect that has it for itself.
    pub(crate) alone_with: Option<NodeId>,
    /// The attempts of its process on earlier connections, which it may still execute.
    pub(crate) earlier: BTreeMap<NodeId, u32>,
    /// Its process has executed nothing yet.
    is_fresh: bool,
    /// When it last got, began or ended something.
    last_move: Duration,
}

/// A lease, as its worker's member holds it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Held {
    pub(crate) attempt: u32,
    /// Since when the worker executes it.
    pub(crate) started_at: Option<Duration>,
    /// The progress that it reported.
    pub(crate) permille: u16,
    assignment: Size,
}

/// What an assignment is for the queue that it waits in.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Size {
    pub(crate) bytes: usize,
    /// See [`weight`].
    pub(crate) time: Duration,
}

impl Member {
    fn new(process: WorkerProcess, threads: usize, deadline: Duration, now: Duration) -> Self {
        Self {
            process,
            threads: threads.max(1),
            leases: BTreeMap::new(),
            waiting: BTreeSet::new(),
            waiting_bytes: 0,
            waiting_time: Duration::ZERO,
            readable: BTreeSet::new(),
            deadline,
            is_draining: false,
            is_clearing: false,
            alone_with: None,
            earlier: BTreeMap::new(),
            is_fresh: true,
            last_move: now,
        }
    }

    /// Its process was here before.
    pub(crate) fn resume(&mut self, lost: Lost) {
        self.is_fresh &= lost.was_fresh;
        self.earlier = lost.attempts;
    }

    /// What is to be known of it should its process come back.
    pub(crate) fn into_lost(self) -> Lost {
        let mut attempts = self.earlier;
        attempts.extend(self.leases.iter().map(|(node, held)| (*node, held.attempt)));
        Lost { was_fresh: self.is_fresh, attempts, deaths: Vec::new() }
    }

    /// A lease begins.
    pub(crate) fn give(&mut self, node: NodeId, attempt: u32, assignment: Size, now: Duration) {
        self.leases.insert(node, Held { attempt, started_at: None, permille: 0, assignment });
        self.waiting.insert(node);
        self.waiting_bytes += assignment.bytes;
        self.waiting_time += assignment.time;
        self.last_move = now;
    }

    /// The worker begins to execute a node that it has not begun with yet; `false` if there is no such lease.
    pub(crate) fn begin(&mut self, node: NodeId, attempt: u32, (arrived, now): (Duration, Duration)) -> bool {
        let Some(held) = self.leases.get_mut(&node).filter(|held| held.attempt == attempt) else { return false };
        if !self.waiting.remove(&node) {
            return false;
        }
        held.started_at = Some(arrived);
        self.waiting_bytes -= held.assignment.bytes;
        self.waiting_time -= held.assignment.time;
        self.is_fresh = false;
        self.last_move = now;
        true
    }

    /// A lease ends.
    pub(crate) fn end(&mut self, node: NodeId, now: Duration) -> Option<Held> {
        let held = self.leases.remove(&node)?;
        if self.waiting.remove(&node) {
            self.waiting_bytes -= held.assignment.bytes;
            self.waiting_time -= held.assignment.time;
        }
        self.alone_with = self.alone_with.filter(|alone| *alone != node);
        self.last_move = now;
        Some(held)
    }

    /// How many nodes it executes.
    pub(crate) fn executing(&self) -> usize {
        self.leases.len() - self.waiting.len()
    }

    /// How much may wait for it.
    fn enough(&self) -> Duration {
        ENOUGH * u32::try_from(self.threads).unwrap_or(u32::MAX).min(1024)
    }

    /// When leases that it has not begun may be moved to another worker. Short nodes stay while it makes progress: it would begin them
    /// before the other worker received them.
    pub(crate) fn movable_at(&self) -> Duration {
        if self.waiting_time > self.enough() + SHORT { Duration::ZERO } else { self.last_move + STANDSTILL }
    }

    /// The last of the nodes that it has not begun with, if it has enough without that one.
    pub(crate) fn excess(&self, spare_leases: usize) -> Option<NodeId> {
        let last = *self.waiting.last()?;
        let rest = self.waiting_time - self.leases.get(&last)?.assignment.time;
        (self.leases.len() > self.threads + spare_leases && rest >= self.enough()).then_some(last)
    }

    /// Whether it was given something though it had enough.
    #[cfg(test)]
    pub(crate) fn has_too_much(&self, spare_leases: usize) -> bool {
        let longest = self.waiting.iter().map(|node| self.leases[node].assignment.time).max().unwrap_or_default();
        self.leases.len() > self.threads + spare_leases && self.waiting_time - longest >= self.enough()
    }

    /// Whether it gets leases like any other.
    fn accepts(&self) -> bool {
        !self.is_draining && !self.is_clearing && self.alone_with.is_none()
    }

    fn keys(&self, worker: WorkerId, spare_leases: usize) -> Keys {
        let is_idle = self.leases.is_empty();
        let has_enough = self.waiting.is_empty() || self.waiting_time >= self.enough();
        let is_busy = self.leases.len() >= self.threads + spare_leases && has_enough;
        let is_full = is_busy || self.waiting_bytes >= UNBEGUN_BYTES;
        let load = Load { leases: self.leases.len(), threads: self.threads };
        let surplus = self.leases.len().saturating_sub(self.threads.max(self.executing()));
        let has_thread = self.executing() < self.threads;
        Keys {
            rank: self.accepts().then_some(Rank { is_full, load, worker }),
            is_fresh: self.accepts() && self.is_fresh && is_idle,
            surplus: Some((self.waiting_time, surplus)).filter(|_| surplus > 0 && self.accepts()),
            stalled_since: Some(self.last_move).filter(|_| has_thread && !self.waiting.is_empty()),
        }
    }
}

/// Where a member is in the indices.
#[derive(PartialEq, Eq)]
struct Keys {
    rank: Option<Rank>,
    is_fresh: bool,
    surplus: Option<(Duration, usize)>,
    stalled_since: Option<Duration>,
}

/// Who is next: first who has a place, then who is least busy for its threads, then who came first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Rank {
    is_full: bool,
    load: Load,
    worker: WorkerId,
}

/// Leases per thread.
#[derive(Clone, Copy, Debug)]
struct Load {
    leases: usize,
    threads: usize,
}

impl Ord for Load {
    fn cmp(&self, other: &Self) -> Ordering {
        // a / b < c / d without a division.
        (self.leases * other.threads).cmp(&(other.leases * self.threads))
    }
}

impl PartialOrd for Load {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Load {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Load {}

/// All workers that have joined.
#[derive(Debug)]
pub(crate) struct Members {
    spare_leases: usize,
    by_id: BTreeMap<WorkerId, Member>,
    by_process: BTreeMap<ProcessName, WorkerId>,
    /// Those that get leases like any other.
    ranking: BTreeSet<Rank>,
    /// Those of them that have executed nothing and hold nothing.
    fresh: BTreeSet<WorkerId>,
    /// Those of them that hold leases which another one could begin with at once.
    surplus: BTreeSet<((Duration, usize), WorkerId)>,
    /// Those that have not begun with a node though they have a thread for it, since then.
    stalled: BTreeSet<(Duration, WorkerId)>,
    deadlines: BTreeSet<(Duration, WorkerId)>,
}

impl Members {
    pub(crate) fn new(spare_leases: usize) -> Self {
        Self {
            spare_leases,
            by_id: BTreeMap::new(),
            by_process: BTreeMap::new(),
            ranking: BTreeSet::new(),
            fresh: BTreeSet::new(),
            surplus: BTreeSet::new(),
            stalled: BTreeSet::new(),
            deadlines: BTreeSet::new(),
        }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.by_id.is_empty()
    }

    pub(crate) fn get(&self, worker: WorkerId) -> Option<&Member> {
        self.by_id.get(&worker)
    }

    /// The member that is this process.
    pub(crate) fn of_process(&self, name: ProcessName) -> Option<WorkerId> {
        self.by_process.get(&name).copied()
    }

    pub(crate) fn join(
        &mut self,
        worker: WorkerId,
        process: WorkerProcess,
        threads: usize,
        deadline: Duration,
        now: Duration,
    ) {
        let member = Member::new(process, threads, deadline, now);
        self.by_process.insert(process.name, worker);
        self.enter(&member.keys(worker, self.spare_leases), worker);
        self.deadlines.insert((deadline, worker));
        self.by_id.insert(worker, member);
    }

    pub(crate) fn remove(&mut self, worker: WorkerId) -> Option<Member> {
        let member = self.by_id.remove(&worker)?;
        self.leave(&member.keys(worker, self.spare_leases), worker);
        self.deadlines.remove(&(member.deadline, worker));
        self.by_process.remove(&member.process.name);
        Some(member)
    }

    /// Change a member; the indices follow.
    pub(crate) fn change<T>(&mut self, worker: WorkerId, change: impl FnOnce(&mut Member) -> T) -> Option<T> {
        let member = self.by_id.get_mut(&worker)?;
        let before = member.keys(worker, self.spare_leases);
        let result = change(member);
        let after = member.keys(worker, self.spare_leases);
        if before != after {
            self.leave(&before, worker);
            self.enter(&after, worker);
        }
        Some(result)
    }

    /// A worker was heard of: its membership and its leases go on.
    pub(crate) fn renew(&mut self, worker: WorkerId, deadline: Duration) {
        if let Some(member) = self.by_id.get_mut(&worker) {
            self.deadlines.remove(&(member.deadline, worker));
            self.deadlines.insert((deadline, worker));
            member.deadline = deadline;
        }
    }

    /// What a worker said of the progress of a node that it executes: whether that is news; `None` if it has no lease of it.
    pub(crate) fn progress(&mut self, worker: WorkerId, node: NodeId, permille: u16) -> Option<bool> {
        let held = self.by_id.get_mut(&worker).and_then(|member| member.leases.get_mut(&node))?;
        Some(std::mem::replace(&mut held.permille, permille) != permille)
    }

    /// When the first member is lost if nothing is heard.
    pub(crate) fn next_deadline(&self) -> Option<Duration> {
        self.deadlines.first().map(|(deadline, _)| *deadline)
    }

    /// Some member that is lost by now.
    pub(crate) fn silent(&self, now: Duration) -> Option<WorkerId> {
        self.deadlines.first().filter(|(deadline, _)| *deadline <= now).map(|(_, worker)| *worker)
    }

    /// How many members get leases like any other.
    pub(crate) fn accepting(&self) -> usize {
        self.ranking.len()
    }

    /// Those that have a place, the least busy one first.
    pub(crate) fn with_place(&self) -> impl Iterator<Item = WorkerId> {
        self.ranking.iter().take_while(|rank| !rank.is_full).map(|rank| rank.worker)
    }

    /// Those that have a thread without a lease, the least busy one first.
    pub(crate) fn with_thread(&self) -> impl Iterator<Item = WorkerId> {
        let ranks = self.ranking.iter().take_while(|rank| !rank.is_full && rank.load.leases < rank.load.threads);
        ranks.map(|rank| rank.worker)
    }

    /// One that gets leases and has few, perhaps too many for a place.
    pub(crate) fn least_busy(&self) -> Option<WorkerId> {
        self.ranking.first().map(|rank| rank.worker)
    }

    /// One that gets leases and holds none.
    pub(crate) fn idle(&self) -> Option<WorkerId> {
        self.ranking.first().filter(|rank| rank.load.leases == 0).map(|rank| rank.worker)
    }

    /// One that has executed nothing and holds nothing.
    pub(crate) fn fresh(&self) -> Option<WorkerId> {
        self.fresh.first().copied()
    }

    /// The one with the most to do that another one could begin with at once.
    pub(crate) fn busiest(&self) -> Option<(WorkerId, &Member)> {
        let (_, worker) = self.surplus.last()?;
        Some((*worker, self.get(*worker)?))
    }

    /// Those that have not begun with a node though they have had a thread for it since then or before.
    pub(crate) fn stalled(&self, since: Duration) -> impl Iterator<Item = (WorkerId, &Member)> {
        let stalled = self.stalled.iter().take_while(move |(begin, _)| *begin <= since);
        stalled.filter_map(|(_, worker)| Some((*worker, self.get(*worker)?)))
    }

    /// Since when the first one is stalled of those that are so only since after `since`; of all if there is no such time.
    pub(crate) fn next_stalled(&self, since: Option<Duration>) -> Option<Duration> {
        let first = match since {
            Some(since) => self.stalled.range((since, WorkerId(u64::MAX))..).next(),
            None => self.stalled.first(),
        };
        first.map(|(begin, _)| *begin)
    }

    /// That every index says what the members say.
    #[cfg(test)]
    pub(crate) fn check(&self) {
        let mut anew = Self::new(self.spare_leases);
        for (worker, member) in &self.by_id {
            anew.enter(&member.keys(*worker, self.spare_leases), *worker);
            anew.deadlines.insert((member.deadline, *worker));
            anew.by_process.insert(member.process.name, *worker);
        }
        assert!(self.ranking.iter().eq(&anew.ranking), "{:?}", self.ranking);
        assert_eq!(self.fresh, anew.fresh);
        assert_eq!(self.surplus, anew.surplus);
        assert_eq!(self.stalled, anew.stalled);
        assert_eq!(self.deadlines, anew.deadlines);
        assert_eq!(self.by_process, anew.by_process);
    }

    fn enter(&mut self, keys: &Keys, worker: WorkerId) {
        keys.rank.into_iter().for_each(|rank| _ = self.ranking.insert(rank));
        keys.surplus.into_iter().for_each(|surplus| _ = self.surplus.insert((surplus, worker)));
        keys.stalled_since.into_iter().for_each(|since| _ = self.stalled.insert((since, worker)));
        if keys.is_fresh {
            self.fresh.insert(worker);
        }
    }

    fn leave(&mut self, keys: &Keys, worker: WorkerId) {
        keys.rank.into_iter().for_each(|rank| _ = self.ranking.remove(&rank));
        keys.surplus.into_iter().for_each(|surplus| _ = self.surplus.remove(&(surplus, worker)));
        keys.stalled_since.into_iter().for_each(|since| _ = self.stalled.remove(&(since, worker)));
        if keys.is_fresh {
            self.fresh.remove(&worker);
        }
    }
}
