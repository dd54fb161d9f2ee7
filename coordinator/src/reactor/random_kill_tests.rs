//! Clusters in which workers keep dying, and large ones. Time is simulated.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};
use std::time::{Duration, Instant};

use lookalike::graph::{Blob, FailureReason, NodeId, Placement, WorkerId};

use super::tests::{Script, node, process};
use super::{Event, handle, start};
use crate::actions::{Action, Outbox};
use crate::events::{Departure, Site};
use crate::policy::Policy;
use crate::state::Core;

/// A scheduled event.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Happening {
    Joins,
    /// The node of this lease ends, with an answer or with the death of its worker.
    Ends {
        worker: WorkerId,
        node: NodeId,
        attempt: u32,
    },
    /// A worker is killed from outside.
    Strikes,
}

/// A cluster of workers with one thread each, which take a node from the front of their leases.
struct Simulation {
    core: Core,
    planner: Script,
    outbox: Outbox,
    now: Duration,
    future: BinaryHeap<Reverse<(Duration, u64, Happening)>>,
    workers: BTreeMap<WorkerId, Vec<(NodeId, u32)>>,
    joined: u64,
    chance: u64,
    node_time: Duration,
    killer: Option<NodeId>,
    kills: u32,
    events: u64,
}

impl Simulation {
    fn new(nodes: usize, workers: usize, seed: u64) -> Self {
        let nodes = (0..nodes).map(|index| node(&format!("n{index}"), vec![], Placement::Worker)).collect();
        let planner = Script { nodes, tolerates_failures: true, ..Script::default() };
        let mut simulation = Self {
            core: Core::new(Policy::default(), 1),
            planner,
            outbox: Outbox::default(),
            now: Duration::ZERO,
            future: BinaryHeap::new(),
            workers: BTreeMap::new(),
            joined: 0,
            chance: seed,
            node_time: Duration::from_millis(300),
            killer: None,
            kills: 0,
            events: 0,
        };
        start(&mut simulation.core, &mut simulation.planner, simulation.now, &mut simulation.outbox).unwrap();
        (0..workers).for_each(|_| simulation.later(Duration::ZERO, Happening::Joins));
        simulation
    }

    /// A pseudorandom number below `below`, the same in every run.
    fn random(&mut self, below: u64) -> u64 {
        self.chance = self.chance.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.chance >> 33) % below
    }

    fn later(&mut self, after: Duration, happening: Happening) {
        self.events += 1;
        self.future.push(Reverse((self.now + after, self.events, happening)));
    }

    fn tell(&mut self, event: Event) {
        handle(&mut self.core, &mut self.planner, event, self.now, &mut self.outbox).unwrap();
        for action in self.outbox.take() {
            match action {
                Action::Assign { worker, lease } => {
                    let leases = self.workers.get_mut(&worker).expect("only workers that are there get leases");
                    leases.push((lease.node, lease.attempt));
                    if leases.len() == 1 {
                        self.later(
                            Duration::from_millis(1),
                            Happening::Ends { worker, node: NodeId(u64::MAX), attempt: 0 },
                        );
                    }
                }
                Action::Cancel { worker, lease } => {
                    let leases = self.workers.get_mut(&worker).expect("a worker that is there");
                    let was_first = leases.first() == Some(&(lease.node, lease.attempt));
                    leases.retain(|held| *held != (lease.node, lease.attempt));
                    if was_first && !leases.is_empty() {
                        self.later(
                            Duration::from_millis(1),
                            Happening::Ends { worker, node: NodeId(u64::MAX), attempt: 0 },
                        );
                    }
                }
                Action::Drop { worker } => _ = self.workers.remove(&worker),
                _ => {}
            }
        }
    }

    fn die(&mut self, worker: WorkerId) {
        if self.workers.remove(&worker).is_some() {
            self.kills += 1;
            self.tell(Event::WorkerLeft { worker, departure: Departure::Lost });
            self.later(Duration::from_millis(150), Happening::Joins);
        }
    }

    /// The first lease of a worker begins.
    fn begin(&mut self, worker: WorkerId) {
        let Some((node, attempt)) = self.workers.get(&worker).and_then(|leases| leases.first()).copied() else {
            return;
        };
        let is_begun = |core: &Core| core.members.get(worker).is_some_and(|member| !member.waiting.contains(&node));
        if is_begun(&self.core) {
            return;
        }
        self.tell(Event::Started { worker, node, attempt });
        let spread = u64::try_from(self.node_time.as_millis()).unwrap();
        let takes = self.node_time / 2 + Duration::from_millis(self.random(spread));
        self.later(takes, Happening::Ends { worker, node, attempt });
    }

    fn happen(&mut self, happening: Happening) {
        match happening {
            Happening::Joins => {
                self.joined += 1;
                let worker = WorkerId(self.joined);
                self.workers.insert(worker, Vec::new());
                self.tell(Event::WorkerJoined { worker, threads: 1, process: process(worker.0) });
            }
            Happening::Strikes => {
                let count = self.workers.len().max(1) as u64;
                let index = usize::try_from(self.random(count)).unwrap();
                let struck = self.workers.keys().nth(index).copied();
                struck.into_iter().for_each(|worker| self.die(worker));
                let pause = 50 + self.random(200);
                self.later(Duration::from_millis(pause), Happening::Strikes);
            }
            Happening::Ends { worker, attempt: 0, .. } => self.begin(worker),
            Happening::Ends { worker, node, attempt } => {
                if self.workers.get(&worker).and_then(|leases| leases.first()) != Some(&(node, attempt)) {
                    return;
                }
                if self.killer == Some(node) {
                    return self.die(worker);
                }
                self.workers.get_mut(&worker).into_iter().for_each(|leases| _ = leases.remove(0));
                let output = Blob::new(node.0.to_le_bytes().to_vec());
                self.tell(Event::Finished { site: Site::Worker(worker), node, attempt, output });
                self.begin(worker);
            }
        }
    }

    /// Run to the end. Every worker sends something at every event.
    fn run(&mut self) {
        while !self.core.is_finished() {
            let next = self.future.peek().map(|Reverse((time, ..))| *time);
            let deadline = self.core.next_deadline();
            if deadline.is_some_and(|deadline| next.is_none_or(|next| deadline < next)) {
                self.now = deadline.unwrap_or_default().max(self.now);
                for worker in self.workers.keys().copied().collect::<Vec<_>>() {
                    self.tell(Event::Heartbeat { worker, executing: Vec::new() });
                }
                self.tell(Event::DeadlinePassed);
                continue;
            }
            let Reverse((time, _, happening)) = self.future.pop().expect("something that happens");
            self.now = time;
            self.happen(happening);
        }
    }
}

#[test]
fn workers_killed_at_random_fail_no_node() {
    let mut kills = 0;
    for seed in 0..200 {
        // A node takes 300 ms on average, and one of four workers is killed every 150 ms.
        let mut simulation = Simulation::new(40, 4, seed);
        simulation.later(Duration::ZERO, Happening::Strikes);
        simulation.run();
        assert_eq!(simulation.planner.failed, [], "seed {seed}");
        assert_eq!(simulation.planner.completed.len(), 40);
        kills += simulation.kills;
    }
    assert!(kills > 5000, "{kills} kills are too few");
}

#[test]
fn node_that_kills_its_workers_fails_by_name_and_all_others_complete_with_and_without_random_kills() {
    for seed in 0..100 {
        let mut simulation = Simulation::new(40, 4, seed);
        simulation.killer = Some(NodeId(seed % 40));
        if seed % 2 == 0 {
            simulation.later(Duration::ZERO, Happening::Strikes);
        }
        simulation.run();
        let failed: Vec<_> = simulation.planner.failed.iter().map(|(node, _)| *node).collect();
        assert_eq!(failed, simulation.killer.into_iter().collect::<Vec<_>>(), "seed {seed}");
        assert_eq!(simulation.planner.failed[0].1, FailureReason::Crashed { crashes: 3 });
        assert_eq!(simulation.planner.completed.len(), 39);
        assert!(seed % 2 == 0 || simulation.kills == 5, "{} deaths without random kills", simulation.kills);
    }
}

/// The time that all events of a run with this many nodes and workers take together.
fn time_of_run(nodes: usize, workers: usize) -> Duration {
    let began = Instant::now();
    let mut simulation = Simulation::new(nodes, workers, 1);
    simulation.node_time = Duration::from_millis(100);
    simulation.run();
    assert_eq!(simulation.planner.completed.len(), nodes);
    began.elapsed()
}

/// How much more an event may cost with many nodes or workers than with few. Measured: 1.1 and 2.4 times as much, because large
/// trees do not fit into a processor's caches. Scanning all workers would cost about thirty times as much, and scanning all nodes
/// more.
const DEARER: u32 = 8;

#[test]
fn event_costs_about_the_same_with_many_nodes_and_workers_as_with_few() {
    // The shortest of three, because other tests disturb the shortest measurement most.
    let few = (0..3).map(|_| time_of_run(10_000, 10)).min().unwrap_or_default();
    let (many_nodes, many_workers) = (time_of_run(100_000, 10), time_of_run(100_000, 4000));
    assert!(many_nodes < 10 * DEARER * few, "{many_nodes:?} for ten times as many nodes as in {few:?}");
    assert!(many_workers < 10 * DEARER * few, "{many_workers:?} with 400 times as many workers as in {few:?}");
}
