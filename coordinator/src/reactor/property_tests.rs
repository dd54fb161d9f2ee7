//! Whatever workers do, in whatever order: every node is completed or fails by name, its planner is told once, and nothing
//! is lost or held twice.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use lookalike::graph::{Blob, BlobHash, Input, NodeFailure, NodeId, NodeState, Placement, WorkerId};
use proptest::prelude::*;

use super::tests::{Script, node};
use super::{Event, handle, start};
use crate::comm::{Action, Departure, Outbox, Site};
use crate::core::{Core, Policy};

/// One thing that the outside world does. Numbers choose among what is there, modulo.
#[derive(Clone, Debug)]
enum Deed {
    Join { threads: usize },
    Leave { worker: usize, departure: u8 },
    Begin { worker: usize, lease: usize },
    Answer { worker: usize, lease: usize, again: bool },
    LateAnswer { lease: usize },
    Fetch { worker: usize },
    PassTime { seconds: u64 },
    RunHere,
}

fn deed() -> impl Strategy<Value = Deed> {
    prop_oneof![
        2 => (1..4_usize).prop_map(|threads| Deed::Join { threads }),
        1 => (0..9_usize, 0..4_u8).prop_map(|(worker, departure)| Deed::Leave { worker, departure }),
        4 => (0..9_usize, 0..9_usize).prop_map(|(worker, lease)| Deed::Begin { worker, lease }),
        6 => (0..9_usize, 0..9_usize, any::<bool>())
            .prop_map(|(worker, lease, again)| Deed::Answer { worker, lease, again }),
        2 => (0..99_usize).prop_map(|lease| Deed::LateAnswer { lease }),
        1 => (0..9_usize).prop_map(|worker| Deed::Fetch { worker }),
        1 => (0..3_u64).prop_map(|seconds| Deed::PassTime { seconds }),
        2 => Just(Deed::RunHere),
    ]
}

/// The world outside the state machine: who is connected, and what each was told to do.
struct World {
    core: Core,
    planner: Script,
    outbox: Outbox,
    now: Duration,
    connected: BTreeMap<WorkerId, BTreeMap<NodeId, u32>>,
    /// Every lease ever given out.
    ever: Vec<(NodeId, u32)>,
    here: BTreeSet<(NodeId, u32)>,
    next_worker: u64,
}

/// Nodes whose number is divisible by this have an application error instead of an output.
const FAILS_EVERY: u64 = 7;

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
        // Time passes, but not so much that the run gives up for want of workers.
        let patient = Duration::from_secs(1_000_000);
        let policy = Policy { wait_for_workers: patient, grace: patient, ..Policy::default() };
        let mut world = Self {
            core: Core::new(policy, 1),
            planner,
            outbox: Outbox::default(),
            now: Duration::ZERO,
            connected: BTreeMap::new(),
            ever: Vec::new(),
            here: BTreeSet::new(),
            next_worker: 1,
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
                }
                Action::Cancel { worker, lease } => {
                    let attempt = self.connected.get_mut(&worker).and_then(|leases| leases.remove(&lease.node));
                    assert_eq!(attempt, Some(lease.attempt), "cancelled what was not given");
                }
                Action::Drop { worker } => _ = self.connected.remove(&worker),
                Action::RunHere { node, attempt } => assert!(self.here.insert((node, attempt))),
                Action::SendBlob { .. } | Action::ForgoBlob { .. } | Action::Acknowledge { .. } | Action::Tell(_) => {}
            }
        }
    }

    /// Each ready node for workers is queued or held by exactly one connected worker, and we agree with the core who.
    fn check(&self) {
        let graph = self.core.graph();
        for index in 0..graph.len() as u64 {
            let node = NodeId(index);
            let is_for_workers = graph.spec(node).is_some_and(|spec| spec.placement == Placement::Worker);
            let holders = self.connected.values().filter(|leases| leases.contains_key(&node)).count();
            let places = holders + usize::from(self.core.queue.contains(&self.core.place(node)));
            let expected = usize::from(is_for_workers && graph.state(node) == Some(&NodeState::Ready));
            assert_eq!(places, expected, "{node} in state {:?}", graph.state(node));
        }
        for (worker, leases) in &self.connected {
            let member = &self.core.workers[worker];
            assert!(leases.len() <= member.threads + self.core.policy.spare_leases);
            assert!(leases.keys().eq(member.leases.keys()));
            assert!(
                member.leases.values().all(|lease| lease.deadline == member.deadline && lease.deadline >= self.now)
            );
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
            self.connected.get_mut(&worker).and_then(|leases| leases.remove(&node));
        }
        self.tell(if node.0.is_multiple_of(FAILS_EVERY) && node.0 > 0 {
            Event::Failed { site, node, attempt, failure: NodeFailure::new("asked to") }
        } else {
            Event::Finished { site, node, attempt, output: Blob::new(node.0.to_le_bytes().to_vec()) }
        });
    }

    fn join(&mut self, threads: usize) {
        let worker = WorkerId(self.next_worker);
        self.next_worker += 1;
        self.connected.insert(worker, BTreeMap::new());
        self.tell(Event::WorkerJoined { worker, threads, process: 0 });
    }

    fn act(&mut self, deed: Deed) {
        match deed {
            Deed::Join { threads } => self.join(threads),
            Deed::Leave { worker, departure } => {
                let Some(worker) = self.chosen(worker) else { return };
                self.connected.remove(&worker);
                let violation = Departure::Violation("test".into());
                let departures = [Departure::Lost, Departure::Silent, Departure::Goodbye, violation];
                let departure = departures[usize::from(departure)].clone();
                self.tell(Event::WorkerLeft { worker, departure });
            }
            Deed::Begin { worker, lease } => {
                let Some(worker) = self.chosen(worker) else { return };
                let Some((node, attempt)) = self.lease_of(worker, lease) else { return };
                self.tell(Event::Started { worker, node, attempt });
            }
            Deed::Answer { worker, lease, again } => {
                let Some(worker) = self.chosen(worker) else { return };
                let Some(lease) = self.lease_of(worker, lease) else { return };
                self.answer(Site::Worker(worker), lease);
                if again {
                    self.answer(Site::Worker(worker), lease);
                }
            }
            Deed::LateAnswer { lease } => {
                // From a worker that is gone, or from whoever is there now.
                let site = Site::Worker(self.chosen(lease).unwrap_or(WorkerId(999)));
                let lease = self.ever.get(lease % self.ever.len().max(1)).copied();
                lease.into_iter().for_each(|lease| self.answer(site, lease));
            }
            Deed::Fetch { worker } => {
                let Some(worker) = self.chosen(worker) else { return };
                self.tell(Event::BlobRequested { worker, hash: BlobHash::of(&[1, 2, 3]) });
            }
            Deed::PassTime { seconds } => {
                self.now += Duration::from_secs(seconds);
                let due = self.core.next_deadline().is_some_and(|deadline| deadline <= self.now);
                if due {
                    self.tell(Event::DeadlinePassed);
                }
            }
            Deed::RunHere => {
                if let Some(run) = self.here.pop_first() {
                    self.answer(Site::Coordinator, run);
                }
            }
        }
    }

    /// From now on one loyal worker answers everything.
    fn finish(&mut self) {
        for worker in self.connected.keys().copied().collect::<Vec<_>>() {
            self.connected.remove(&worker);
            self.tell(Event::WorkerLeft { worker, departure: Departure::Goodbye });
        }
        self.join(2);
        let loyal = self.chosen(0).expect("it has just joined");
        while !self.core.is_finished() {
            let here = self.here.pop_first();
            let lease = self.lease_of(loyal, 0);
            assert!(here.is_some() || lease.is_some(), "the run hangs: {:?}", self.core);
            here.into_iter().for_each(|run| self.answer(Site::Coordinator, run));
            lease.filter(|(node, _)| self.core.graph().is_open(*node)).into_iter().for_each(|lease| {
                self.answer(Site::Worker(loyal), lease);
            });
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn every_node_completes_or_fails_by_name(
        shape in prop::collection::vec((0..6_usize, prop::bool::weighted(0.2)), 1..20),
        deeds in prop::collection::vec(deed(), 0..120),
    ) {
        let mut world = World::new(&shape);
        deeds.into_iter().for_each(|deed| world.act(deed));
        world.finish();
        let told: BTreeSet<_> = world.planner.completed.iter().copied().collect();
        let failed: BTreeSet<_> = world.planner.failed.iter().map(|(node, _)| *node).collect();
        prop_assert_eq!(told.len() + failed.len(), world.planner.completed.len() + world.planner.failed.len());
        prop_assert!(told.is_disjoint(&failed));
        prop_assert_eq!(told.len() + failed.len(), world.core.graph().len());
    }
}
