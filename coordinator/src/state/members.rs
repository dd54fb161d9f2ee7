//! The workers that have joined, and indices for every query over all of them, so that no event costs more for 1000 workers than
//! for 10.

use std::cmp::Ordering;
use std::collections::{BTreeMap, BTreeSet, btree_map::Entry};
use std::time::Duration;

use lookalike::graph::{BlobHash, NodeId, WorkerId};
use lookalike::protocol::ProcessName;

use super::departed::Lost;
use crate::actions::WorkerProcess;

/// A worker gets no further assignment while those that it has not begun take this many bytes or more. So its queue holds less
/// than this plus one assignment.
const UNBEGUN_BYTES: usize = 8 << 20;

/// Unbegun leases that take this long per thread are enough for a worker. It is longer than the journal and a round trip take.
const ENOUGH: Duration = Duration::from_millis(10);

/// A worker without progress for this long is stalled. On a busy machine a process may wait for some 10 ms.
const STANDSTILL: Duration = Duration::from_millis(50);

/// Nodes that take less than this are short: a worker gets many of them at a time.
const SHORT: Duration = Duration::from_millis(1);

/// The least weight of a node.
const SHORTEST: Duration = Duration::from_micros(20);

/// The weight of a node that is not short or whose kind has no known duration.
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
    /// The leases that it has not begun.
    pub(crate) waiting: BTreeSet<NodeId>,
    waiting_bytes: usize,
    /// The time that they take one after the other.
    waiting_time: Duration,
    /// The blobs that its leases read, each with the number of times that they read it. It may fetch only these.
    inputs: BTreeMap<BlobHash, usize>,
    /// It is lost, with its leases, if it sends nothing before this time.
    pub(crate) deadline: Duration,
    /// It was asked to end: it finishes the nodes that it executes and gets no others.
    pub(crate) is_draining: bool,
    /// It gets no nodes until it is free for a suspect.
    pub(crate) is_clearing: bool,
    /// The suspect that is the only node on it.
    pub(crate) alone_with: Option<NodeId>,
    /// The attempts of its process from earlier connections, which it may still execute.
    pub(crate) earlier: BTreeMap<NodeId, u32>,
    /// Its process has not executed a node yet.
    is_fresh: bool,
    /// When a lease of it last began, started to execute, or ended.
    last_move: Duration,
}

/// A lease of a worker.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Held {
    pub(crate) attempt: u32,
    /// When the worker started to execute it.
    pub(crate) started_at: Option<Duration>,
    /// The progress that it reported.
    pub(crate) permille: u16,
    assignment: Size,
}

/// The size of an assignment in the queue of its worker.
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
            inputs: BTreeMap::new(),
            deadline,
            is_draining: false,
            is_clearing: false,
            alone_with: None,
            earlier: BTreeMap::new(),
            is_fresh: true,
            last_move: now,
        }
    }

    /// The worker's process was connected before.
    pub(crate) fn resume(&mut self, lost: Lost) {
        self.is_fresh &= lost.was_fresh;
        self.earlier = lost.attempts;
    }

    /// The state to keep in case its process reconnects.
    pub(crate) fn into_lost(self) -> Lost {
        let mut attempts = self.earlier;
        attempts.extend(self.leases.iter().map(|(node, held)| (*node, held.attempt)));
        Lost { was_fresh: self.is_fresh, attempts, deaths: Vec::new() }
    }

    /// Add a lease.
    pub(crate) fn give(&mut self, node: NodeId, attempt: u32, assignment: Size, now: Duration) {
        self.leases.insert(node, Held { attempt, started_at: None, permille: 0, assignment });
        self.waiting.insert(node);
        self.waiting_bytes += assignment.bytes;
        self.waiting_time += assignment.time;
        self.last_move = now;
    }

    /// A lease that was added reads these blobs.
    pub(crate) fn add_inputs(&mut self, hashes: &[BlobHash]) {
        hashes.iter().for_each(|hash| *self.inputs.entry(*hash).or_default() += 1);
    }

    /// A lease that was removed read these blobs.
    pub(crate) fn remove_inputs(&mut self, hashes: &[BlobHash]) {
        for hash in hashes {
            if let Entry::Occupied(mut count) = self.inputs.entry(*hash) {
                *count.get_mut() -= 1;
                if *count.get() == 0 {
                    count.remove();
                }
            }
        }
    }

    /// Whether a lease of it reads this blob.
    pub(crate) fn reads(&self, hash: BlobHash) -> bool {
        self.inputs.contains_key(&hash)
    }

    /// The number of different blobs that its leases read.
    #[cfg(test)]
    pub(crate) fn input_count(&self) -> usize {
        self.inputs.len()
    }

    /// Mark a lease as executing; `false` if there is no such lease or the worker executes it already.
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

    /// Remove a lease.
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

    /// The number of nodes that it executes.
    pub(crate) fn executing(&self) -> usize {
        self.leases.len() - self.waiting.len()
    }

    /// The total time of waiting leases that is enough for it.
    fn enough(&self) -> Duration {
        ENOUGH * u32::try_from(self.threads).unwrap_or(u32::MAX).min(1024)
    }

    /// When leases that it has not begun may be moved to another worker. Short nodes stay while it makes progress, because it
    /// would begin them before another worker received them.
    pub(crate) fn movable_at(&self) -> Duration {
        if self.waiting_time > self.enough() + SHORT { Duration::ZERO } else { self.last_move + STANDSTILL }
    }

    /// The last of the nodes that it has not begun, if the others are enough for it.
    pub(crate) fn excess(&self, spare_leases: usize) -> Option<NodeId> {
        let last = *self.waiting.last()?;
        let rest = self.waiting_time - self.leases.get(&last)?.assignment.time;
        (self.leases.len() > self.threads + spare_leases && rest >= self.enough()).then_some(last)
    }

    /// Whether it was given a node although it had enough.
    #[cfg(test)]
    pub(crate) fn has_too_much(&self, spare_leases: usize) -> bool {
        let longest = self.waiting.iter().map(|node| self.leases[node].assignment.time).max().unwrap_or_default();
        self.leases.len() > self.threads + spare_leases && self.waiting_time - longest >= self.enough()
    }

    /// Whether it gets leases in the normal order.
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

/// A member's keys in the indices.
#[derive(PartialEq, Eq)]
struct Keys {
    rank: Option<Rank>,
    is_fresh: bool,
    surplus: Option<(Duration, usize)>,
    stalled_since: Option<Duration>,
}

/// The order in which members get leases: those with a place first, then the least busy for their threads, then the oldest.
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
        // Compares a / b with c / d without a division.
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
    /// Those that get leases in the normal order.
    ranking: BTreeSet<Rank>,
    /// Those of them that have executed nothing and hold no lease.
    fresh: BTreeSet<WorkerId>,
    /// Those of them that hold leases which another worker could begin at once.
    surplus: BTreeSet<((Duration, usize), WorkerId)>,
    /// Those with a free thread and leases that they have not begun, by the time of their last progress.
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

    /// The member whose process has this name.
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

    /// Change a member and update the indices.
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

    /// Postpone the deadline of a worker, which has sent something.
    pub(crate) fn renew(&mut self, worker: WorkerId, deadline: Duration) {
        if let Some(member) = self.by_id.get_mut(&worker) {
            self.deadlines.remove(&(member.deadline, worker));
            self.deadlines.insert((deadline, worker));
            member.deadline = deadline;
        }
    }

    /// Set the reported progress of a node that a worker executes. Returns whether it has changed; `None` if the worker has no
    /// lease of it.
    pub(crate) fn progress(&mut self, worker: WorkerId, node: NodeId, permille: u16) -> Option<bool> {
        let held = self.by_id.get_mut(&worker).and_then(|member| member.leases.get_mut(&node))?;
        Some(std::mem::replace(&mut held.permille, permille) != permille)
    }

    /// When the first member is lost unless it sends something.
    pub(crate) fn next_deadline(&self) -> Option<Duration> {
        self.deadlines.first().map(|(deadline, _)| *deadline)
    }

    /// A member whose deadline has passed.
    pub(crate) fn silent(&self, now: Duration) -> Option<WorkerId> {
        self.deadlines.first().filter(|(deadline, _)| *deadline <= now).map(|(_, worker)| *worker)
    }

    /// The number of members that get leases in the normal order.
    pub(crate) fn accepting(&self) -> usize {
        self.ranking.len()
    }

    /// Those that have a place, least busy first.
    pub(crate) fn with_place(&self) -> impl Iterator<Item = WorkerId> {
        self.ranking.iter().take_while(|rank| !rank.is_full).map(|rank| rank.worker)
    }

    /// Those that have a thread without a lease, least busy first.
    pub(crate) fn with_thread(&self) -> impl Iterator<Item = WorkerId> {
        let ranks = self.ranking.iter().take_while(|rank| !rank.is_full && rank.load.leases < rank.load.threads);
        ranks.map(|rank| rank.worker)
    }

    /// The least busy member that gets leases, even if it has no place.
    pub(crate) fn least_busy(&self) -> Option<WorkerId> {
        self.ranking.first().map(|rank| rank.worker)
    }

    /// A member that gets leases and holds none.
    pub(crate) fn idle(&self) -> Option<WorkerId> {
        self.ranking.first().filter(|rank| rank.load.leases == 0).map(|rank| rank.worker)
    }

    /// A member that has executed nothing and holds no lease.
    pub(crate) fn fresh(&self) -> Option<WorkerId> {
        self.fresh.first().copied()
    }

    /// The member with the most work that another worker could begin at once.
    pub(crate) fn busiest(&self) -> Option<(WorkerId, &Member)> {
        let (_, worker) = self.surplus.last()?;
        Some((*worker, self.get(*worker)?))
    }

    /// Those with a free thread and unbegun leases that have made no progress since `since`.
    pub(crate) fn stalled(&self, since: Duration) -> impl Iterator<Item = (WorkerId, &Member)> {
        let stalled = self.stalled.iter().take_while(move |(begin, _)| *begin <= since);
        stalled.filter_map(|(_, worker)| Some((*worker, self.get(*worker)?)))
    }

    /// The earliest last progress after `since` of such members; the earliest of all if `since` is `None`.
    pub(crate) fn next_stalled(&self, since: Option<Duration>) -> Option<Duration> {
        let first = match since {
            Some(since) => self.stalled.range((since, WorkerId(u64::MAX))..).next(),
            None => self.stalled.first(),
        };
        first.map(|(begin, _)| *begin)
    }

    /// Check that the indices agree with the members.
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
