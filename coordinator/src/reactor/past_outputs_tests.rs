//! A resumed run: a node whose output the journal has does not run again.

use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

use lookalike::graph::{Blob, Graph, Input, NodeId, NodeKey, NodeSpec, Placement, WorkerId};

use super::tests::{Script, node, process};
use super::{Event, Stop, handle, start};
use crate::actions::{Action, Outbox};
use crate::events::{Departure, RunEvent, Site};
use crate::policy::Policy;
use crate::state::past_outputs::{Memory, PastOutputs};
use crate::state::{Core, Deaths};

const A: WorkerId = WorkerId(1);

#[derive(Debug, Default)]
struct Notebook(BTreeMap<NodeKey, Memory>);

impl PastOutputs for Notebook {
    fn of(&mut self, key: NodeKey) -> Memory {
        self.0.get(&key).cloned().unwrap_or_default()
    }
}

fn leaf(name: &str, placement: Placement) -> NodeSpec {
    NodeSpec { parameters: name.into(), ..node(name, vec![], placement) }
}

fn key_of(spec: NodeSpec) -> NodeKey {
    let mut graph = Graph::new();
    let node = graph.add_node(spec).unwrap();
    graph.key(node).unwrap()
}

/// A run with two leaves on workers, one leaf here, and a node that joins them. Earlier coordinators left outputs or deaths of
/// some.
struct Bench {
    core: Core,
    planner: Script,
    outbox: Outbox,
}

impl Bench {
    fn new(remembered: &[(&str, Placement, Memory)]) -> Self {
        let mut notebook = Notebook::default();
        for (name, placement, memory) in remembered {
            notebook.0.insert(key_of(leaf(name, *placement)), memory.clone());
        }
        let all = vec![Input::OutputOf(NodeId(0)), Input::OutputOf(NodeId(1)), Input::OutputOf(NodeId(2))];
        let nodes = vec![
            leaf("x", Placement::Worker),
            leaf("y", Placement::Worker),
            leaf("z", Placement::Coordinator),
            node("join", all, Placement::Worker),
        ];
        let planner = Script { nodes, blob: vec![1], ..Script::default() };
        let core = Core::new(Policy::default(), 2).with_past_outputs(Box::new(notebook));
        let mut bench = Self { core, planner, outbox: Outbox::default() };
        start(&mut bench.core, &mut bench.planner, Duration::ZERO, &mut bench.outbox).unwrap();
        bench
    }

    fn handle(&mut self, event: Event) -> Result<Vec<String>, Stop> {
        handle(&mut self.core, &mut self.planner, event, Duration::ZERO, &mut self.outbox)?;
        Ok(self.said())
    }

    fn join(&mut self, worker: WorkerId) -> Vec<String> {
        self.handle(Event::WorkerJoined { worker, threads: 1, process: process(worker.0) }).unwrap()
    }

    fn said(&mut self) -> Vec<String> {
        let line = |action: &Action| match action {
            Action::Assign { worker, lease } => Some(format!("{worker} gets {}.{}", lease.node.0, lease.attempt)),
            Action::RunHere { node, .. } => Some(format!("run {} here", node.0)),
            Action::Tell(RunEvent::NodeRecalled { name, .. }) => Some(format!("{} recalled", name.label)),
            Action::Tell(RunEvent::NodeRequeued { name, crashes, .. }) => {
                Some(format!("{} requeued, {crashes}", name.label))
            }
            _ => None,
        };
        self.outbox.take().iter().filter_map(line).collect()
    }
}

fn output(byte: u8) -> Memory {
    Memory { output: Some(Blob::new(vec![byte])), ..Memory::default() }
}

#[test]
fn nodes_with_past_outputs_complete_without_running() {
    let mut bench = Bench::new(&[("x", Placement::Worker, output(1)), ("z", Placement::Coordinator, output(3))]);
    assert_eq!(bench.said(), ["x recalled", "z recalled"]);
    assert_eq!(bench.planner.completed, [NodeId(0), NodeId(2)]);
    assert_eq!(bench.join(A), ["worker 1 gets 1.1"]);
    let summary = bench.core.summary();
    assert_eq!((summary.recalled_nodes, summary.completed_nodes, summary.attempts), (2, 2, 1));
}

#[test]
fn run_with_past_outputs_of_all_nodes_finishes_at_once() {
    let bytes = [("x", 1), ("y", 2)].map(|(name, byte)| (name, Placement::Worker, output(byte)));
    let mut bench = Bench::new(&[bytes[0].clone(), bytes[1].clone(), ("z", Placement::Coordinator, output(3))]);
    assert!(!bench.core.is_finished(), "the join is not remembered");
    assert_eq!(bench.said(), ["x recalled", "y recalled", "z recalled"]);
    assert_eq!(bench.join(A), ["worker 1 gets 3.1"]);
}

#[test]
fn run_resumed_from_any_past_outputs_by_any_number_of_workers_ends() {
    let leaves = [("x", Placement::Worker), ("y", Placement::Worker), ("z", Placement::Coordinator)];
    for (mask, workers) in (0..8_u8).flat_map(|mask| (1..=3).map(move |workers| (mask, workers))) {
        let has_output = |bit: &u8| mask >> bit & 1 == 1;
        let past = (0..3).filter(has_output).map(|bit| {
            let (name, placement) = leaves[usize::from(bit)];
            (name, placement, output(bit))
        });
        let mut bench = Bench::new(&past.collect::<Vec<_>>());
        let joined = |number| Event::WorkerJoined { worker: WorkerId(number), threads: 1, process: process(number) };
        let mut events: VecDeque<Event> = (1..=workers).map(joined).collect();
        let answer = |site, node: NodeId, attempt| {
            let output = Blob::new(vec![node.0.to_le_bytes()[0]]);
            Event::Finished { site, node, attempt, output }
        };
        loop {
            for action in bench.outbox.take() {
                match action {
                    Action::Assign { worker, lease } => {
                        let (node, attempt) = (lease.node, lease.attempt);
                        events.push_back(Event::Started { worker, node, attempt });
                        events.push_back(answer(Site::Worker(worker), node, attempt));
                    }
                    Action::RunHere { node, attempt } => events.push_back(answer(Site::Coordinator, node, attempt)),
                    _ => {}
                }
            }
            let Some(event) = events.pop_front() else { break };
            handle(&mut bench.core, &mut bench.planner, event, Duration::ZERO, &mut bench.outbox).unwrap();
        }
        let mut completed = bench.planner.completed.clone();
        completed.sort_unstable();
        assert!(bench.core.is_finished(), "outputs {mask:03b}, {workers} workers");
        assert_eq!(completed, [0, 1, 2, 3].map(NodeId), "outputs {mask:03b}, {workers} workers");
        assert_eq!(bench.core.summary().recalled_nodes, mask.count_ones() as usize);
    }
}

#[test]
fn deaths_are_remembered() {
    let mut bench = Bench::new(&[(
        "x",
        Placement::Worker,
        Memory { output: None, deaths: Deaths { in_company: 1, ..Deaths::default() } },
    )]);
    bench.join(A);
    bench.handle(Event::Started { worker: A, node: NodeId(0), attempt: 1 }).unwrap();
    let said = bench.handle(Event::WorkerLeft { worker: A, departure: Departure::Lost }).unwrap();
    assert!(said.contains(&"x requeued, 2".to_owned()), "{said:?}");
}

#[test]
fn output_accepted_after_deaths_is_kept() {
    let nodes = vec![leaf("x", Placement::Worker)];
    let policy = Policy { verify_fraction: 1.0, ..Policy::default() };
    let core = Core::new(policy, 1).with_past_outputs(Box::new(Notebook::default()));
    let mut bench = Bench { core, planner: Script { nodes, ..Script::default() }, outbox: Outbox::default() };
    start(&mut bench.core, &mut bench.planner, Duration::ZERO, &mut bench.outbox).unwrap();
    bench.join(A);
    let output = Blob::new(vec![5]);
    let finished = Event::Finished { site: Site::Worker(A), node: NodeId(0), attempt: 1, output: output.clone() };
    bench.handle(finished).unwrap();
    bench.handle(Event::WorkerLeft { worker: A, departure: Departure::Goodbye }).unwrap();
    for death in 1..=2 {
        let worker = WorkerId(10 + death);
        bench.join(worker);
        let attempt = bench.core.look(NodeId(0)).unwrap().attempts;
        bench.handle(Event::Started { worker, node: NodeId(0), attempt }).unwrap();
        let lost = Event::WorkerLeft { worker, departure: Departure::Lost };
        handle(&mut bench.core, &mut bench.planner, lost, Duration::ZERO, &mut bench.outbox).unwrap();
        let actions = bench.outbox.take();
        let counts = actions.iter().any(|action| matches!(action, Action::Tell(RunEvent::DeathsCounted { .. })));
        let keeps = actions.contains(&Action::Keep { node: NodeId(0), output: output.clone() });
        assert_eq!((counts, keeps), (true, death == 2));
    }
    assert!(bench.core.is_finished());
}
