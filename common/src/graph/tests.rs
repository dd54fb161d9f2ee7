use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use super::*;

/// Outputs the sum of its parameters and of all bytes of its inputs, as eight bytes.
struct Sum;

impl NodeType for Sum {
    fn kind(&self) -> &'static str {
        "sum"
    }

    fn run(&self, parameters: &[u8], inputs: &[Blob], context: &RunContext) -> Result<Vec<u8>, NodeFailure> {
        context.check()?;
        let bytes = parameters.iter().chain(inputs.iter().flat_map(|input| input.iter()));
        Ok(bytes.map(|byte| u64::from(*byte)).sum::<u64>().to_le_bytes().to_vec())
    }
}

/// Fails or panics, depending on its parameters.
struct Trouble;

impl NodeType for Trouble {
    fn kind(&self) -> &'static str {
        "trouble"
    }

    fn run(&self, parameters: &[u8], _: &[Blob], _: &RunContext) -> Result<Vec<u8>, NodeFailure> {
        assert_ne!(parameters, b"panic", "asked to");
        Err(NodeFailure::new("asked to fail"))
    }
}

/// Adds one node per byte of a blob, then one node that joins their outputs.
#[derive(Default)]
struct FanOut {
    width: u8,
    leaves: Vec<NodeId>,
    finished: usize,
    total: Option<u64>,
}

impl Planner for FanOut {
    fn start(&mut self, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        let shared = graph.add_blob(vec![1; 10])?;
        for index in 0..self.width {
            self.leaves.push(graph.add_node(spec("sum", &[index], vec![Input::Blob(shared)]))?);
        }
        Ok(())
    }

    fn completed(&mut self, node: NodeId, output: &Blob, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        if self.leaves.contains(&node) {
            self.finished += 1;
            if self.finished == self.leaves.len() {
                let outputs = self.leaves.iter().map(|leaf| Input::OutputOf(*leaf)).collect();
                graph.add_node(spec("sum", &[], outputs))?;
            }
            return Ok(());
        }
        let bytes: [u8; 8] = output.as_ref().try_into().map_err(|_| PlanError::new("expected eight bytes"))?;
        self.total = Some(u64::from_le_bytes(bytes));
        Ok(())
    }
}

fn spec(kind: &str, parameters: &[u8], inputs: Vec<Input>) -> NodeSpec {
    let label = format!("{kind} {parameters:?}");
    let (kind, parameters) = (kind.into(), parameters.to_vec());
    NodeSpec { kind, label: label.into(), parameters, inputs, placement: Placement::Worker, priority: 0 }
}

fn registry() -> Registry {
    Registry::default().with(Sum).with(Trouble)
}

fn changes(graph: &mut Graph) -> Vec<Change> {
    std::iter::from_fn(|| graph.next_change()).collect()
}

#[test]
fn planner_that_adds_nodes_runs_to_its_end_in_both_orders() {
    for execution in [Execution::Sequential, Execution::Parallel] {
        let planner = run_in_process(FanOut { width: 5, ..FanOut::default() }, &registry(), execution).unwrap();
        // The leaves output 10, 11, 12, 13 and 14, so their join is 60.
        assert_eq!(planner.total, Some(60), "{execution:?}");
    }
}

#[test]
fn node_becomes_ready_when_its_last_input_is_available() {
    let mut graph = Graph::new();
    let first = graph.add_node(spec("sum", &[1], vec![])).unwrap();
    let second = graph.add_node(spec("sum", &[2], vec![])).unwrap();
    let twice = [first, second, second].map(Input::OutputOf).to_vec();
    let join = graph.add_node(spec("sum", &[], twice)).unwrap();
    changes(&mut graph);
    assert_eq!(graph.complete(second, Blob::new(vec![2])), Completion::Accepted);
    assert_eq!(changes(&mut graph), [Change::Completed(second)]);
    assert!(graph.input_blobs(join).is_none());
    assert_eq!(graph.complete(first, Blob::new(vec![1])), Completion::Accepted);
    assert_eq!(changes(&mut graph), [Change::Completed(first), Change::Ready(join)]);
    let inputs: Vec<_> = graph.input_blobs(join).unwrap().iter().map(|blob| blob.to_vec()).collect();
    assert_eq!(inputs, [vec![1], vec![2], vec![2]]);
    graph.complete(join, Blob::new(vec![5]));
    changes(&mut graph);
    assert!(graph.is_drained());
}

#[test]
fn key_of_a_node_depends_on_its_inputs_and_not_on_its_number() {
    let join_of = |outputs: [u8; 2], labels: [&str; 2]| {
        let mut graph = Graph::new();
        let leaves = labels.map(|label| graph.add_node(NodeSpec { label: label.into(), ..spec("sum", &[1], vec![]) }));
        let leaves = leaves.map(Result::unwrap);
        let join = graph.add_node(spec("sum", &[], leaves.map(Input::OutputOf).to_vec())).unwrap();
        assert!(graph.key(join).is_none() && graph.key(NodeId(9)).is_none());
        assert_eq!(graph.key(leaves[0]), graph.key(leaves[1]));
        for (leaf, output) in leaves.into_iter().zip(outputs) {
            graph.complete(leaf, Blob::new(vec![output]));
        }
        graph.key(join).unwrap()
    };
    assert_eq!(join_of([1, 2], ["a", "b"]), join_of([1, 2], ["x", "y"]));
    assert_ne!(join_of([1, 2], ["a", "b"]), join_of([2, 1], ["a", "b"]));
}

#[test]
fn second_output_is_compared_bit_for_bit() {
    let mut graph = Graph::new();
    let node = graph.add_node(spec("sum", &[1], vec![])).unwrap();
    let waiting = graph.add_node(spec("sum", &[], vec![Input::OutputOf(node)])).unwrap();
    assert_eq!(graph.complete(waiting, Blob::new(vec![1])), Completion::Refused);
    assert_eq!(graph.complete(node, Blob::new(vec![1])), Completion::Accepted);
    assert_eq!(graph.complete(node, Blob::new(vec![1])), Completion::Duplicate);
    let first = BlobHash::of(&[1]);
    assert_eq!(graph.complete(node, Blob::new(vec![2])), Completion::Different { first });
    assert_eq!(graph.output(node).unwrap().as_ref(), [1]);
    assert_eq!(graph.complete(NodeId(9), Blob::new(vec![])), Completion::Refused);
}

#[test]
fn failure_fails_every_node_that_waits_for_it() {
    let mut graph = Graph::new();
    let root = graph.add_node(spec("trouble", &[], vec![])).unwrap();
    let child = graph.add_node(spec("sum", &[], vec![Input::OutputOf(root)])).unwrap();
    let grandchild = graph.add_node(spec("sum", &[], vec![Input::OutputOf(child), Input::OutputOf(root)])).unwrap();
    let bystander = graph.add_node(spec("sum", &[], vec![])).unwrap();
    changes(&mut graph);
    graph.fail(root, FailureReason::Node(NodeFailure::new("no")));
    assert_eq!(changes(&mut graph), [root, child, grandchild].map(Change::Failed));
    assert!(graph.is_open(bystander));
    let late = graph.add_node(spec("sum", &[], vec![Input::OutputOf(child)])).unwrap();
    assert_eq!(changes(&mut graph), [Change::Added(late), Change::Failed(late)]);
    assert!(!graph.is_open(late) && !graph.is_open(grandchild));
}

#[test]
fn failure_and_panic_end_a_run_by_name() {
    struct One(&'static [u8]);
    impl Planner for One {
        fn start(&mut self, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
            graph.add_node(spec("trouble", self.0, vec![])).map(|_| ())
        }
        fn completed(&mut self, _: NodeId, _: &Blob, _: &mut GraphEdit<'_>) -> Result<(), PlanError> {
            Err(PlanError::new("nothing should complete"))
        }
    }
    let message = |parameters| match run_in_process(One(parameters), &registry(), Execution::Sequential) {
        Ok(_) => String::new(),
        Err(error) => error.to_string(),
    };
    assert_eq!(message(b"fail"), "trouble \"trouble [102, 97, 105, 108]\" failed: asked to fail");
    let panicked = message(b"panic");
    assert!(
        panicked.starts_with("trouble \"trouble [112, 97, 110, 105, 99]\" failed: it panicked: assertion"),
        "{panicked}"
    );
    assert!(panicked.contains("this is a bug in lookalike"), "{panicked}");
}

#[test]
fn specifications_beyond_the_limits_are_refused() {
    let mut graph = Graph::new();
    let unknown = BlobHash::of(b"nowhere");
    assert!(matches!(
        graph.add_node(spec("sum", &[], vec![Input::Blob(unknown)])),
        Err(PlanError::UnknownBlob { hash, .. }) if hash == unknown
    ));
    assert!(matches!(
        graph.add_node(spec("sum", &[], vec![Input::OutputOf(NodeId(0))])),
        Err(PlanError::UnknownInput { .. })
    ));
    let large = NodeSpec { parameters: vec![0; MAX_PARAMETER_BYTES + 1], ..spec("sum", &[], vec![]) };
    assert!(matches!(graph.add_node(large), Err(PlanError::TooLarge { what: "parameters", .. })));
    assert!(graph.is_empty());
}

#[test]
fn unknown_kind_names_the_known_ones() {
    let context = RunContext::new(Arc::new(DecodedCache::new(0)));
    let failure = registry().run("nonsense", &[], &[], &context).unwrap_err();
    assert!(matches!(failure, NodeFailure::UnknownKind { .. }), "{failure:?}");
    assert!(failure.to_string().contains(r#"unknown node kind "nonsense", this process knows ["sum", "trouble"]"#));
}

#[test]
fn input_is_decoded_once_per_type_and_kept_within_the_bound() {
    let cache = DecodedCache::new(100);
    let decodings = AtomicUsize::new(0);
    let decode = |blob: &Blob| -> Arc<usize> {
        let counted = |bytes: &[u8]| {
            decodings.fetch_add(1, Ordering::Relaxed);
            Ok::<_, NodeFailure>(bytes.len())
        };
        cache.get_or_decode(blob, counted).unwrap()
    };
    let [small, medium, large] = [40, 50, 60].map(|length| Blob::new(vec![7; length]));
    assert!(Arc::ptr_eq(&decode(&small), &decode(&small)));
    assert_eq!(decodings.load(Ordering::Relaxed), 1);
    let as_text = cache.get_or_decode(&small, |bytes| Ok::<_, NodeFailure>(format!("{}", bytes.len()))).unwrap();
    assert_eq!(*as_text, "40");
    decode(&medium);
    // 40 (number) + 40 (text) + 50 is over 100: the number of `small` is the least recently used.
    decode(&small);
    assert_eq!(decodings.load(Ordering::Relaxed), 3);
    assert_eq!(*decode(&large), 60);
    let failed: Result<Arc<u8>, _> = cache.get_or_decode(&large, |_| Err(NodeFailure::new("unreadable")));
    assert!(failed.is_err());
}

#[test]
fn blob_with_another_hash_is_refused() {
    assert_eq!(Blob::verified(BlobHash::of(b"a"), b"a".to_vec()).unwrap().hash(), BlobHash::of(b"a"));
    let error = Blob::verified(BlobHash::of(b"a"), b"b".to_vec()).unwrap_err();
    assert_eq!(error.found, BlobHash::of(b"b"));
}

#[test]
fn context_passes_on_cancellation_and_progress() {
    let context = RunContext::new(Arc::new(DecodedCache::new(0)));
    context.report(1, 3);
    assert_eq!((context.progress_permille(), context.check()), (333, Ok(())));
    context.report(5, 0);
    context.clone().cancel();
    assert_eq!((context.progress_permille(), context.check()), (1000, Err(NodeFailure::Cancelled)));
}

#[test]
fn outputs_are_dropped_when_they_are_not_held_and_the_last_reader_is_done() {
    let mut graph = Graph::new();
    let blob = graph.add_blob(vec![1; 100]).unwrap();
    assert_eq!(graph.add_blob(vec![1; 100]).unwrap(), blob);
    let first = graph.add_node(spec("sum", &[1], vec![Input::Blob(blob)])).unwrap();
    let second = graph.add_node(spec("sum", &[2], vec![Input::OutputOf(first), Input::OutputOf(first)])).unwrap();
    graph.release_blob(blob);
    graph.release_blob(blob);
    assert_eq!(graph.blob_bytes(), 100, "an open node reads it");
    graph.complete(first, Blob::new(vec![7; 10]));
    assert_eq!(graph.blob_bytes(), 10);
    graph.release(first);
    assert_eq!(graph.input_blobs(second).unwrap().len(), 2);
    graph.complete(second, Blob::new(vec![8; 3]));
    assert_eq!((graph.blob_bytes(), graph.output(first)), (3, None));
    // Its hash remains, to compare a second output with it.
    assert_eq!(graph.complete(first, Blob::new(vec![7; 10])), Completion::Duplicate);
    let late = graph.add_node(spec("sum", &[3], vec![Input::OutputOf(first)]));
    assert!(matches!(late, Err(PlanError::Released { node, .. }) if node == first));
    assert!(!graph.hold(first) && graph.hold(second));
    graph.release(second);
    assert_eq!(graph.blob_bytes(), 3);
    graph.release(second);
    graph.release(second);
    assert_eq!(graph.blob_bytes(), 0);
}

#[test]
fn unneeded_open_nodes_are_cancelled_with_the_inputs_of_only_these() {
    let mut graph = Graph::new();
    let [shared, own] = [1, 2].map(|byte| graph.add_node(spec("sum", &[byte], vec![])).unwrap());
    let both = [shared, own].map(Input::OutputOf).to_vec();
    let join = graph.add_node(spec("sum", &[3], both)).unwrap();
    let other = graph.add_node(spec("sum", &[4], vec![Input::OutputOf(shared)])).unwrap();
    changes(&mut graph);
    assert_eq!(graph.ready_for_workers(), 2);
    graph.release(shared);
    graph.release(own);
    assert!(changes(&mut graph).is_empty(), "others wait for them");
    graph.release(join);
    assert_eq!(changes(&mut graph), [Change::Failed(join), Change::Failed(own)]);
    assert!(matches!(graph.state(own), Some(NodeState::Failed(reason)) if reason.is_cancellation()));
    assert_eq!(graph.ready_for_workers(), 1);
    graph.complete(shared, Blob::new(vec![1]));
    graph.complete(other, Blob::new(vec![2]));
    changes(&mut graph);
    assert!(graph.is_drained());
    assert_eq!(graph.blob_bytes(), 1);
}

#[test]
fn failure_drops_inputs_and_cancels_nodes_that_are_not_held() {
    let mut graph = Graph::new();
    let blob = graph.add_blob(vec![1; 100]).unwrap();
    let held = graph.add_node(spec("sum", &[1], vec![])).unwrap();
    let released = graph.add_node(spec("sum", &[2], vec![])).unwrap();
    let inputs = vec![Input::Blob(blob), Input::OutputOf(held), Input::OutputOf(released)];
    let join = graph.add_node(spec("sum", &[3], inputs)).unwrap();
    graph.release(released);
    graph.release_blob(blob);
    changes(&mut graph);
    graph.fail(join, FailureReason::Crashed { crashes: 3 });
    assert_eq!(changes(&mut graph), [Change::Failed(join), Change::Failed(released)]);
    assert_eq!(graph.blob_bytes(), 0);
    assert!(graph.is_open(held));
}
