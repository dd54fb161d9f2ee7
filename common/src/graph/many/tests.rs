//! Planners that share a graph, on nodes that count how often they run.

use super::*;
use crate::graph::{
    Change, DecodedCache, Execution, Graph, Input, NodeFailure, NodeSpec, NodeState, NodeType, Placement, Registry,
    RunContext, run_in_process,
};
use std::sync::{Arc, Mutex};

/// Two leaves and their join. The first leaf is shared with every fit of the same `shared`; the second is its own.
struct Fit {
    shared: u8,
    own: u8,
    leaves: Vec<NodeId>,
    open: usize,
    /// Whether it holds its leaves until it ends.
    keeps: bool,
    result: Option<Vec<u8>>,
}

impl Fit {
    fn new(shared: u8, own: u8) -> Self {
        Self { shared, own, leaves: Vec::new(), open: 2, keeps: false, result: None }
    }
}

fn node(kind: &str, label: &str, parameters: Vec<u8>, inputs: Vec<Input>) -> NodeSpec {
    let (kind, label) = (kind.to_owned(), label.to_owned());
    NodeSpec { kind, label: label.into(), parameters, inputs, placement: Placement::Worker, priority: 0 }
}

impl Planner for Fit {
    fn start(&mut self, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        let blob = graph.add_blob(vec![self.shared; 1000])?;
        for byte in [self.shared, self.own] {
            self.leaves.push(graph.add_node(node("leaf", "leaf", vec![byte], vec![Input::Blob(blob)]))?);
        }
        Ok(())
    }

    fn completed(&mut self, node_id: NodeId, output: &Blob, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        if !self.leaves.contains(&node_id) {
            self.result = Some(output.to_vec());
            return Ok(());
        }
        self.open -= 1;
        if output.is_empty() {
            return Err(PlanError::new("an empty leaf"));
        }
        if self.open == 0 {
            let inputs = self.leaves.iter().map(|leaf| Input::OutputOf(*leaf)).collect();
            graph.add_node(node("leaf", "join", vec![], inputs))?;
            self.leaves.iter().filter(|_| !self.keeps).for_each(|leaf| graph.release(*leaf));
        }
        Ok(())
    }
}

/// A leaf of 200 fails; one of 201 is empty; every other output is the parameters and inputs.
#[derive(Clone, Default)]
struct Leaf(Arc<Mutex<Vec<Vec<u8>>>>);

impl NodeType for Leaf {
    fn kind(&self) -> &'static str {
        "leaf"
    }

    fn run(&self, parameters: &[u8], inputs: &[Blob], _: &RunContext) -> Result<Vec<u8>, NodeFailure> {
        self.0.lock().unwrap().push(parameters.to_vec());
        match parameters {
            [200] => Err(NodeFailure::new("it is 200")),
            [201] => Ok(Vec::new()),
            _ => Ok(parameters.iter().chain(inputs.iter().flat_map(|input| input.iter().take(2))).copied().collect()),
        }
    }
}

/// The fits of a test, and their results in order.
#[derive(Default)]
struct Bench {
    coming: Vec<Fit>,
    next: u32,
    most_active: usize,
    most_ready: usize,
    is_fail_fast: bool,
    /// The number of a part that stays.
    stays: Option<u32>,
    /// How many may start until the test raises it; does not apply to a part that is waited for.
    there: Option<u32>,
    safe: Vec<u32>,
    /// Whether it was asked for the safe parts after the last one had ended.
    is_asked_last: bool,
    ended: Vec<(String, Result<Vec<u8>, String>)>,
}

impl Bench {
    fn new(mut fits: Vec<Fit>) -> Self {
        fits.reverse();
        Self { coming: fits, most_active: 2, most_ready: 4, ..Self::default() }
    }
}

impl Parts for Bench {
    type Planner = Fit;

    fn next(&mut self, wait: bool) -> Result<Next<Fit>, PlanError> {
        if !wait && self.there.is_some_and(|there| self.next >= there) {
            return Ok(Next::NotYet);
        }
        let Some(planner) = self.coming.pop() else { return Ok(Next::End) };
        let number = self.next;
        self.next += 1;
        Ok(Next::Part(Box::new(Part {
            number,
            name: format!("fit-{number}"),
            planner,
            stays: self.stays == Some(number),
        })))
    }

    fn wants_more(&self, active: usize, ready: usize) -> bool {
        active < self.most_active && ready < self.most_ready
    }

    fn completed(&mut self, part: Part<Fit>) -> Result<(), PlanError> {
        self.safe.push(part.number);
        self.ended.push((part.name, Ok(part.planner.result.expect("a result"))));
        Ok(())
    }

    fn failed(&mut self, part: Part<Fit>, failure: PartFailure) -> Result<(), PlanError> {
        self.ended.push((part.name, Err(failure.to_string())));
        if self.is_fail_fast { Err(PlanError::new("one has failed")) } else { Ok(()) }
    }

    fn newly_safe(&mut self, is_last: bool) -> Vec<u32> {
        assert!(!is_last || self.coming.is_empty(), "more parts come");
        self.is_asked_last |= is_last;
        std::mem::take(&mut self.safe)
    }
}

fn run(bench: Bench, execution: Execution) -> (Bench, Vec<Vec<u8>>) {
    let leaf = Leaf::default();
    let registry = Registry::default().with(leaf.clone());
    let parts = run_in_process(Many::new(bench), &registry, execution).unwrap().into_parts();
    assert!(parts.is_asked_last);
    let ran = leaf.0.lock().unwrap().clone();
    (parts, ran)
}

fn alone(shared: u8, own: u8) -> Vec<u8> {
    let registry = Registry::default().with(Leaf::default());
    run_in_process(Fit::new(shared, own), &registry, Execution::Sequential).unwrap().result.unwrap()
}

#[test]
fn every_part_gets_what_it_gets_alone_and_equal_nodes_run_once() {
    for execution in [Execution::Sequential, Execution::Parallel] {
        let fits = [(1, 2), (1, 3), (1, 2), (4, 4), (1, 2)];
        let bench = Bench::new(fits.map(|(shared, own)| Fit::new(shared, own)).into());
        let (bench, ran) = run(Bench { most_active: 5, most_ready: 100, ..bench }, execution);
        let mut ended = bench.ended;
        ended.sort();
        let expected = fits.map(|(shared, own)| Ok(alone(shared, own)));
        assert_eq!(ended.into_iter().map(|(_, result)| result).collect::<Vec<_>>(), expected);
        // 1, 2 and their join; 3 and its join; 4 twice, as alone, and its join.
        assert_eq!(ran.len(), 8, "{ran:?}");
    }
}

#[test]
fn earlier_parts_end_earlier_and_parts_start_only_when_needed() {
    let fits = (0..20).map(|i| Fit::new(2 * i, 2 * i + 1)).collect();
    let (bench, _) = run(Bench::new(fits), Execution::Sequential);
    let names: Vec<String> = bench.ended.into_iter().map(|(name, _)| name).collect();
    assert_eq!(names, (0..20).map(|i| format!("fit-{i}")).collect::<Vec<_>>());

    // Two at a time: the third adds its nodes when the first has ended.
    let fits = (0..3).map(|i| Fit::new(2 * i, 2 * i + 1)).collect();
    let mut graph = Graph::new();
    Many::new(Bench::new(fits)).start(&mut GraphEdit::new(&mut graph)).unwrap();
    assert_eq!((graph.len(), graph.spec(NodeId(3)).unwrap().priority), (4, 1));
    let label = &graph.spec(NodeId(3)).unwrap().label;
    assert_eq!((label.part.as_deref(), &*label.name), (Some("fit-1"), "leaf"));
}

#[test]
fn part_that_is_ready_late_starts_without_waiting_for_the_end_of_a_node() {
    let mut graph = Graph::new();
    let mut planner = Many::new(Bench { there: Some(1), ..Bench::new(vec![Fit::new(1, 2), Fit::new(3, 4)]) });
    planner.start(&mut GraphEdit::new(&mut graph)).unwrap();
    planner.look_again(&mut GraphEdit::new(&mut graph)).unwrap();
    assert_eq!(graph.len(), 2, "the second one is not ready yet");
    planner.parts.there = None;
    planner.look_again(&mut GraphEdit::new(&mut graph)).unwrap();
    assert_eq!(graph.len(), 4);
}

#[test]
fn part_that_stays_holds_its_nodes_for_later_parts_and_lets_the_run_end() {
    for stays in [None, Some(0)] {
        let fits = [(1, 2), (3, 4), (5, 6), (1, 2)].map(|(shared, own)| Fit { keeps: true, ..Fit::new(shared, own) });
        let bench = Bench { stays, most_active: 2, ..Bench::new(fits.into()) };
        let (bench, ran) = run(bench, Execution::Sequential);
        let names: Vec<&str> = bench.ended.iter().map(|(name, _)| &**name).collect();
        let last = bench.ended.last().unwrap().1.clone();
        assert_eq!(last, Ok(alone(1, 2)));
        if stays.is_some() {
            assert_eq!((names, ran.len()), (vec!["fit-1", "fit-2", "fit-3"], 9));
        } else {
            assert_eq!((names.len(), ran.len()), (4, 12), "nodes that are not held run again");
        }
    }
}

#[test]
fn failure_ends_the_parts_that_need_the_node_and_no_other() {
    let fits = vec![Fit::new(1, 2), Fit::new(200, 3), Fit::new(4, 200), Fit::new(5, 201), Fit::new(1, 7)];
    let (bench, _) = run(Bench { most_active: 5, most_ready: 100, ..Bench::new(fits) }, Execution::Sequential);
    let result = |name: &str| bench.ended.iter().find(|(other, _)| other == name).unwrap().1.clone();
    assert_eq!(bench.ended.len(), 5);
    assert_eq!((result("fit-0"), result("fit-4")), (Ok(alone(1, 2)), Ok(alone(1, 7))));
    for name in ["fit-1", "fit-2"] {
        assert_eq!(result(name), Err("leaf \"leaf\" failed: it is 200".to_owned()));
    }
    assert_eq!(result("fit-3"), Err("an empty leaf".to_owned()));
}

#[test]
fn parts_may_end_the_run_at_the_first_failure() {
    let bench = Bench { is_fail_fast: true, ..Bench::new(vec![Fit::new(1, 200), Fit::new(2, 3)]) };
    let registry = Registry::default().with(Leaf::default());
    let error = run_in_process(Many::new(bench), &registry, Execution::Sequential).map(|_| ()).unwrap_err();
    assert_eq!(error.to_string(), "one has failed");
}

/// Runs a graph node by node and returns its largest number of stored bytes, and the number at its end. Every node is forgotten once.
fn kept_bytes(fits: u8) -> (usize, usize) {
    let registry = Registry::default().with(Leaf::default());
    let mut planner = Many::new(Bench::new((0..fits).map(|i| Fit::new(i, i + 100)).collect()));
    let (mut graph, mut most, mut forgotten) = (Graph::new(), 0, Vec::new());
    planner.start(&mut GraphEdit::new(&mut graph)).unwrap();
    while let Some(change) = graph.next_change() {
        match change {
            Change::Ready(node) => {
                let (spec, inputs) = (graph.spec(node).unwrap().clone(), graph.input_blobs(node).unwrap());
                let context = RunContext::new(Arc::new(DecodedCache::new(0)));
                graph.complete(node, registry.run(&spec.kind, &spec.parameters, &inputs, &context).unwrap());
            }
            Change::Completed(node) => {
                let output = graph.output(node).cloned().unwrap();
                planner.completed(node, &output, &mut GraphEdit::new(&mut graph)).unwrap();
            }
            Change::Forgotten(node) => forgotten.push(node),
            Change::Added(_) | Change::Failed(_) => {}
        }
        most = most.max(graph.blob_bytes());
    }
    assert!(graph.is_drained() && (0..graph.len() as u64).all(|n| !graph.is_open(NodeId(n))));
    forgotten.sort_unstable();
    assert_eq!(forgotten, (0..graph.len() as u64).map(NodeId).collect::<Vec<_>>());
    (most, graph.blob_bytes())
}

#[test]
fn everything_that_ended_parts_held_is_dropped() {
    let (most, left) = kept_bytes(50);
    assert!(most < 3000 && left == 0, "{most} {left}");
}

#[test]
fn shared_nodes_are_forgotten_with_the_last_part_that_added_them() {
    let mut graph = Graph::new();
    let mut planner = Many::new(Bench::new(vec![Fit::new(1, 2), Fit::new(1, 200)]));
    planner.start(&mut GraphEdit::new(&mut graph)).unwrap();
    let complete = |planner: &mut Many<Bench>, graph: &mut Graph, node: u64| {
        graph.complete(NodeId(node), Blob::new(vec![7]));
        planner.completed(NodeId(node), &Blob::new(vec![7]), &mut GraphEdit::new(graph)).unwrap();
    };
    // Nodes: 0 shared, 1 of the first, 2 of the second, 3 the join of the first.
    for node in [0, 1, 3] {
        complete(&mut planner, &mut graph, node);
    }
    let forgotten = |graph: &mut Graph| {
        let changes = std::iter::from_fn(|| graph.next_change());
        changes.filter(|change| matches!(change, Change::Forgotten(_))).collect::<Vec<_>>()
    };
    assert_eq!(
        forgotten(&mut graph),
        [1, 3].map(|node| Change::Forgotten(NodeId(node))),
        "the second may need node 0 again"
    );
    complete(&mut planner, &mut graph, 2);
    complete(&mut planner, &mut graph, 4);
    assert_eq!(forgotten(&mut graph), [0, 2, 4].map(|node| Change::Forgotten(NodeId(node))));
}

#[test]
fn cancelled_nodes_of_a_failed_part_do_not_fail_other_parts() {
    let mut graph = Graph::new();
    let mut planner = Many::new(Bench::new(vec![Fit::new(1, 2), Fit::new(1, 3)]));
    planner.start(&mut GraphEdit::new(&mut graph)).unwrap();
    while graph.next_change().is_some() {}
    // Nodes: 1 (shared), 2 of the first, 3 of the second.
    graph.fail(NodeId(1), FailureReason::Crashed { crashes: 3 });
    assert_eq!(graph.next_change(), Some(Change::Failed(NodeId(1))));
    planner.failed(NodeId(1), &FailureReason::Crashed { crashes: 3 }, &mut GraphEdit::new(&mut graph)).unwrap();
    assert!(graph.is_open(NodeId(0)) && graph.is_open(NodeId(2)), "the second part needs them");
    assert!(graph.next_change().is_none());
    // Now no part needs the shared node.
    graph.fail(NodeId(2), FailureReason::Crashed { crashes: 3 });
    graph.next_change();
    planner.failed(NodeId(2), &FailureReason::Crashed { crashes: 3 }, &mut GraphEdit::new(&mut graph)).unwrap();
    assert!(matches!(graph.state(NodeId(0)), Some(NodeState::Failed(reason)) if reason.is_cancellation()));
    assert_eq!(planner.into_parts().ended.len(), 2);
}
