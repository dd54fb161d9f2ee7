//! For any behaviour of workers in any order: every node is completed or fails, its planner is informed once, no node is lost, no
//! worker holds more than it may, and all indices of the state are up to date.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use lookalike::graph::{Blob, BlobHash, Input, NodeFailure, NodeId, NodeState, Placement, WorkerId};
use proptest::prelude::*;

use super::tests::{Script, node, process};
use super::{Event, Executing, handle, start};
use crate::actions::{Action, Outbox};
use crate::events::{Departure, Site};
use crate::policy::Policy;
use crate::policy::Speculation;
use crate::state::Core;
use lookalike::graph::FailureReason;

/// An event from outside. A number selects one of the present objects (modulo their count).
#[derive(Clone, Debug)]
enum Step {
    Join {
        threads: usize,
    },
    Leave {
        worker: usize,
        departure: u8,
    },
    Begin {
        worker: usize,
        lease: usize,
    },
    Answer {
        worker: usize,
        lease: usize,
        again: bool,
    },
    LateAnswer {
        lease: usize,
    },
    Fetch {
        worker: usize,
    },
    Drain {
        worker: usize,
    },
    /// Time passes. Workers that sent nothing are lost.
    PassTime {
        microseconds: u64,
        heard: u8,
    },
    /// A process whose connection broke reconnects. It still executes the nodes that this selects.
    Return {
        which: usize,
        is_at_it: bool,
    },
    RunHere,
}

fn step() -> impl Strategy<Value = Step> {
    prop_oneof![
        2 => (1..4_usize).prop_map(|threads| Step::Join { threads }),
        1 => (0..9_usize, 0..5_u8).prop_map(|(worker, departure)| Step::Leave { worker, departure }),
        4 => (0..9_usize, 0..9_usize).prop_map(|(worker, lease)| Step::Begin { worker, lease }),
        6 => (0..9_usize, 0..9_usize, any::<bool>())
            .prop_map(|(worker, lease, again)| Step::Answer { worker, lease, again }),
        2 => (0..99_usize).prop_map(|lease| Step::LateAnswer { lease }),
        1 => (0..9_usize).prop_map(|worker| Step::Fetch { worker }),
        1 => (0..9_usize).prop_map(|worker| Step::Drain { worker }),
        1 => (0..4_000_000_u64, any::<u8>()).prop_map(|(microseconds, heard)| Step::PassTime { microseconds, heard }),
        // So little time that nodes count as short.
        3 => (0..400_u64, any::<u8>()).prop_map(|(microseconds, heard)| Step::PassTime { microseconds, heard }),
        2 => (0..9_usize, any::<bool>()).prop_map(|(which, is_at_it)| Step::Return { which, is_at_it }),
        2 => Just(Step::RunHere),
    ]
}

/// The world outside the state machine: the connected workers, and what each was told to do.
struct World {
    core: Core,
    planner: Script,
    outbox: Outbox,
    now: Duration,
    connected: BTreeMap<WorkerId, BTreeMap<NodeId, u32>>,
    executing: BTreeSet<(WorkerId, NodeId)>,
    /// How often a harmless node was executed by a worker that was killed from outside.
    hits: BTreeMap<NodeId, u32>,
    /// All leases that were given out.
    ever: Vec<(NodeId, u32)>,
    here: BTreeSet<(NodeId, u32)>,
    next_worker: u64,
    /// The process of each connected worker.
    processes: BTreeMap<WorkerId, u64>,
    /// Running processes that have lost their connection, with the nodes that they execute.
    cut_off: Vec<(u64, BTreeMap<NodeId, u32>)>,
    /// The worker that is reporting what it executes, with these nodes.
    telling: Option<(WorkerId, BTreeMap<NodeId, u32>)>,
}

/// Nodes whose number is divisible by this have an application error instead of an output.
const FAILS_EVERY: u64 = 7;

/// Nodes whose number is divisible by this kill the worker that executes them.
const KILLS_EVERY: u64 = 5;

fn kills(node: NodeId) -> bool {
    node.0 > 0 && node.0.is_multiple_of(KILLS_EVERY) && !node.0.is_multiple_of(FAILS_EVERY)
}

impl World {
    fn new(shape: &[(usize, bool)]) -> Self {
        let blob = vec![1, 2, 3];
        let nodes = shape.iter().enumerate().map(|(index, (back, is_here))| {
            let source = index.checked_sub(*back).filter(|source| *source < index);
            let input =
                source.map_or(Input::Blob(BlobHash::of(&blob)), |source| Input::OutputOf(NodeId(source as u64)));
            let placement = if *is_here { Placement::Coordinator } else { Placement::Worker };
            node(&format!("n{index}"), vec![input], placement)
        });
        let follow_up = Some(node("follow-up", vec![Input::OutputOf(NodeId(0))], Placement::Worker));
        let nodes = nodes.collect();
        let planner = Script { nodes, blob, follow_up, tolerates_failures: true, ..Script::default() };
        // The limits are so long that the run does not end because there is no worker.
        let patient = Duration::from_secs(1_000_000);
        let speculation = Speculation { factor: Some(1.0), after: Duration::from_secs(1) };
        let policy = Policy {
            wait_for_workers: patient,
            grace: patient,
            speculation,
            verify_fraction: 0.5,
            ..Policy::default()
        };
        let mut world = Self {
            core: Core::new(policy, 1),
            planner,
            outbox: Outbox::default(),
            now: Duration::ZERO,
            connected: BTreeMap::new(),
            executing: BTreeSet::new(),
            hits: BTreeMap::new(),
            ever: Vec::new(),
            here: BTreeSet::new(),
            next_worker: 1,
            processes: BTreeMap::new(),
            cut_off: Vec::new(),
            telling: None,
        };
        start(&mut world.core, &mut world.planner, world.now, &mut world.outbox).unwrap();
        world.listen();
        world
    }

    fn tell(&mut self, event: Event) {
        handle(&mut self.core, &mut self.planner, event, self.now, &mut self.outbox).unwrap();
        self.listen();
        self.check();
    }

    fn listen(&mut self) {
        for action in self.outbox.take() {
            match action {
                Action::Assign { worker, lease } => {
                    let leases = self.connected.get_mut(&worker).expect("only connected workers get leases");
                    assert_eq!(leases.insert(lease.node, lease.attempt), None, "given twice to {worker}");
                    self.ever.push((lease.node, lease.attempt));
                    if self.has_told(worker, lease.node).is_some() {
                        self.executing.insert((worker, lease.node));
                    }
                }
                Action::Cancel { worker, lease } if self.has_told(worker, lease.node) == Some(lease.attempt) => {}
                Action::Cancel { worker, lease } => {
                    let attempt = self.connected.get_mut(&worker).and_then(|leases| leases.remove(&lease.node));
                    self.executing.remove(&(worker, lease.node));
                    assert_eq!(attempt, Some(lease.attempt), "cancelled what was not given");
                }
                Action::Drop { worker } => self.disconnect(worker),
                Action::RunHere { node, attempt } => assert!(self.here.insert((node, attempt))),
                Action::CancelHere { .. }
                | Action::Keep { .. }
                | Action::SendBlob { .. }
                | Action::ForgoBlob { .. }
                | Action::Acknowledge { .. }
                | Action::Tell(_) => {}
            }
        }
    }

    /// The attempt under which a worker has just reported that it executes a node.
    fn has_told(&self, worker: WorkerId, node: NodeId) -> Option<u32> {
        let (telling, executing) = self.telling.as_ref()?;
        executing.get(&node).copied().filter(|_| *telling == worker)
    }

    /// Check that each ready node for workers waits in one place or is held by one or two connected workers, the same as in this
    /// model.
    fn check(&self) {
        let graph = self.core.graph();
        for index in 0..graph.len() as u64 {
            let node = NodeId(index);
            let is_for_workers = graph.spec(node).is_some_and(|spec| spec.placement == Placement::Worker);
            let is_ready = is_for_workers && graph.state(node) == Some(&NodeState::Ready);
            let holders: Vec<_> = self.connected.iter().filter(|(_, leases)| leases.contains_key(&node)).collect();
            let places = self.core.waiting.places(node);
            let state = graph.state(node);
            assert_eq!(places, usize::from(is_ready && holders.is_empty()), "{node} in state {state:?}");
            assert!(holders.len() <= if is_ready { 2 } else { 0 }, "{node} in state {state:?} is held by {holders:?}");
            let record = &self.core.records[usize::try_from(index).unwrap()];
            assert_eq!(
                record.holders.iter().copied().collect::<BTreeSet<_>>(),
                holders.iter().map(|(id, _)| **id).collect()
            );
        }
        for (worker, leases) in &self.connected {
            let member = self.core.members.get(*worker).unwrap();
            let spare = self.core.policy.spare_leases;
            assert!(!member.has_too_much(spare), "{member:?}");
            let told = leases.keys().filter(|node| self.executing.contains(&(*worker, **node))).count();
            assert!(leases.len() <= told.max(member.threads) + spare + 500 * member.threads, "{member:?}");
            let is_long = self.core.pace.established("test").is_none();
            assert!(!is_long || leases.len() <= told.max(member.threads) + spare, "{member:?}");
            assert!(leases.keys().eq(member.leases.keys()));
            let executing = leases.keys().filter(|node| self.executing.contains(&(*worker, **node)));
            assert_eq!(executing.count(), member.executing());
            assert!(!member.is_draining || member.waiting.is_empty());
            assert!(member.alone_with.is_none_or(|node| leases.keys().eq([&node])), "{leases:?} beside a suspect");
        }
        self.core.members.check();
    }

    fn disconnect(&mut self, worker: WorkerId) {
        self.connected.remove(&worker);
        self.processes.remove(&worker);
        self.executing.retain(|(other, _)| *other != worker);
    }

    /// A worker dies of a node that it executes, or is killed.
    fn lose(&mut self, worker: WorkerId, departure: Departure) {
        if departure.is_suspicious() {
            let hit = self.executing.iter().filter(|(other, node)| *other == worker && !kills(*node));
            hit.for_each(|(_, node)| *self.hits.entry(*node).or_default() += 1);
        }
        self.disconnect(worker);
        self.tell(Event::WorkerLeft { worker, departure });
    }

    fn begin(&mut self, worker: WorkerId, (node, attempt): (NodeId, u32)) {
        if self.core.members.get(worker).is_some_and(|member| member.executing() >= member.threads) {
            return;
        }
        self.executing.insert((worker, node));
        self.tell(Event::Started { worker, node, attempt });
        if kills(node) {
            self.lose(worker, Departure::Lost);
        }
    }

    fn chosen(&self, worker: usize) -> Option<WorkerId> {
        self.connected.keys().nth(worker % self.connected.len().max(1)).copied()
    }

    fn lease_of(&self, worker: WorkerId, lease: usize) -> Option<(NodeId, u32)> {
        let leases = &self.connected[&worker];
        leases.iter().nth(lease % leases.len().max(1)).map(|(node, attempt)| (*node, *attempt))
    }

    fn answer(&mut self, site: Site, (node, attempt): (NodeId, u32)) {
        if let Site::Worker(worker) = site {
            if kills(node) {
                return;
            }
            let leases = self.connected.get_mut(&worker);
            if let Some(leases) = leases.filter(|leases| leases.get(&node) == Some(&attempt)) {
                leases.remove(&node);
                self.executing.remove(&(worker, node));
            }
        }
        self.tell(if node.0.is_multiple_of(FAILS_EVERY) && node.0 > 0 {
            Event::Failed { site, node, attempt, failure: NodeFailure::new("asked to") }
        } else {
            Event::Finished { site, node, attempt, output: Blob::new(node.0.to_le_bytes().to_vec()) }
        });
    }

    fn join(&mut self, threads: usize) {
        self.join_as(self.next_worker, threads);
    }

    fn join_as(&mut self, name: u64, threads: usize) -> WorkerId {
        let worker = WorkerId(self.next_worker);
        self.next_worker += 1;
        self.connected.insert(worker, BTreeMap::new());
        self.processes.insert(worker, name);
        self.tell(Event::WorkerJoined { worker, threads, process: process(name) });
        worker
    }

    /// A process reconnects and reports what it executes.
    fn come_back(&mut self, (name, executing): (u64, BTreeMap<NodeId, u32>)) {
        let worker = self.join_as(name, executing.len().max(1));
        let told = |(node, attempt): (&NodeId, &u32)| Executing { node: *node, attempt: *attempt, permille: 0 };
        let beat = Event::Heartbeat { worker, executing: executing.iter().map(told).collect() };
        self.telling = Some((worker, executing));
        self.tell(beat);
        self.telling = None;
    }

    fn act(&mut self, step: Step) {
        match step {
            Step::Join { threads } => self.join(threads),
            Step::Leave { worker, departure } => {
                let Some(worker) = self.chosen(worker) else { return };
                let violation = Departure::Violation("test".into());
                let departures =
                    [Departure::Lost, Departure::Silent, Departure::Goodbye, Departure::TooSlow, violation];
                let departure = departures[usize::from(departure)].clone();
                let at_it =
                    self.connected[&worker].iter().filter(|(node, _)| self.executing.contains(&(worker, **node)));
                let at_it = at_it.map(|(node, attempt)| (*node, *attempt)).collect();
                let name = self.processes[&worker];
                self.lose(worker, departure);
                self.cut_off.push((name, at_it));
            }
            Step::Begin { worker, lease } => {
                let Some(worker) = self.chosen(worker) else { return };
                let Some(lease) = self.lease_of(worker, lease) else { return };
                self.begin(worker, lease);
            }
            Step::Answer { worker, lease, again } => {
                let Some(worker) = self.chosen(worker) else { return };
                let Some(lease) = self.lease_of(worker, lease) else { return };
                self.answer(Site::Worker(worker), lease);
                if again {
                    self.answer(Site::Worker(worker), lease);
                }
            }
            Step::LateAnswer { lease } => {
                // From a worker that has left, or from one that is connected.
                let site = Site::Worker(self.chosen(lease).unwrap_or(WorkerId(999)));
                let lease = self.ever.get(lease % self.ever.len().max(1)).copied();
                lease.into_iter().for_each(|lease| self.answer(site, lease));
            }
            Step::Fetch { worker } => {
                let Some(worker) = self.chosen(worker) else { return };
                self.tell(Event::BlobRequested { worker, hash: BlobHash::of(&[1, 2, 3]) });
            }
            Step::Drain { worker } => {
                let Some(worker) = self.chosen(worker) else { return };
                let begun = |node: &NodeId| self.executing.contains(&(worker, *node));
                let kept = self.connected[&worker].iter().filter(|(node, _)| begun(node));
                let kept = kept.map(|(node, attempt)| (*node, *attempt)).collect();
                self.connected.insert(worker, kept);
                self.tell(Event::WorkerDrains { worker });
            }
            Step::PassTime { microseconds, heard } => {
                self.now += Duration::from_micros(microseconds);
                let heard = self.connected.keys().copied().filter(|worker| heard >> (worker.0 % 8) & 1 == 1);
                self.pass(heard.collect());
            }
            Step::Return { which, is_at_it } => {
                if self.cut_off.is_empty() {
                    return;
                }
                let (name, at_it) = self.cut_off.swap_remove(which % self.cut_off.len());
                self.come_back((name, if is_at_it { at_it } else { BTreeMap::new() }));
            }
            Step::RunHere => {
                if let Some(run) = self.here.pop_first() {
                    self.answer(Site::Coordinator, run);
                }
            }
        }
    }

    /// These workers send a heartbeat; then deadlines are checked.
    fn pass(&mut self, heard: Vec<WorkerId>) {
        for worker in heard {
            self.tell(Event::Heartbeat { worker, executing: Vec::new() });
        }
        if self.core.next_deadline().is_some_and(|deadline| deadline <= self.now) {
            self.tell(Event::DeadlinePassed);
            let next = self.core.next_deadline();
            assert!(next.is_none_or(|next| next > self.now), "{next:?} is not after {:?}", self.now);
        }
    }

    /// From now on, two reliable workers, and as many new ones as necessary, execute everything in order. Time passes when there
    /// is nothing to do.
    fn finish(&mut self) {
        for worker in self.connected.keys().copied().collect::<Vec<_>>() {
            self.lose(worker, Departure::Goodbye);
        }
        let mut idle_rounds = 0;
        while !self.core.is_finished() {
            while self.connected.len() < 2 {
                self.join(2);
            }
            let here = self.here.pop_first();
            here.into_iter().for_each(|run| self.answer(Site::Coordinator, run));
            let lease = (0..2).find_map(|index| {
                let worker = self.chosen(index)?;
                Some((worker, self.lease_of(worker, 0)?))
            });
            if let Some((worker, lease)) = lease {
                self.begin(worker, lease);
                if self.connected.contains_key(&worker) && self.core.graph().is_open(lease.0) {
                    self.answer(Site::Worker(worker), lease);
                }
            }
            if here.is_some() || lease.is_some() {
                idle_rounds = 0;
                continue;
            }
            idle_rounds += 1;
            assert!(idle_rounds < 100, "the run hangs: {:?}", self.core);
            self.now = self.core.next_deadline().expect("something to wait for").max(self.now);
            self.pass(self.connected.keys().copied().collect());
        }
    }
}

/// The number of cases.
const CASES: u32 = if cfg!(feature = "slow") { 2000 } else { 256 };

proptest! {
    #![proptest_config(ProptestConfig { cases: CASES, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn every_node_completes_or_fails_by_name(
        shape in prop::collection::vec((0..6_usize, prop::bool::weighted(0.2)), 1..20),
        steps in prop::collection::vec(step(), 0..150),
    ) {
        let mut world = World::new(&shape);
        steps.into_iter().for_each(|step| world.act(step));
        world.finish();
        let told: BTreeSet<_> = world.planner.completed.iter().copied().collect();
        let failed: BTreeMap<_, _> = world.planner.failed.iter().cloned().collect();
        prop_assert_eq!(told.len() + failed.len(), world.planner.completed.len() + world.planner.failed.len());
        prop_assert!(told.iter().all(|node| !failed.contains_key(node)));
        prop_assert_eq!(told.len() + failed.len(), world.core.graph().len());
        let policy = world.core.policy;
        for index in 0..world.core.graph().len() as u64 {
            let node = NodeId(index);
            let is_here = world.core.graph().spec(node).is_some_and(|spec| spec.placement == Placement::Coordinator);
            let hits = world.hits.get(&node).copied().unwrap_or(0);
            match failed.get(&node) {
                Some(FailureReason::Crashed { crashes }) => {
                    prop_assert_eq!(*crashes, policy.node_crashes);
                    prop_assert!(kills(node) || hits >= policy.suspect_after + policy.node_crashes, "{} hits", hits);
                }
                Some(FailureReason::Node(_)) => prop_assert!(index > 0 && index.is_multiple_of(FAILS_EVERY)),
                Some(_) => {}
                None => prop_assert!(is_here || !kills(node), "{} cannot have completed", node),
            }
        }
    }
}
