//! A whole run in this process, without workers: the reference that every distributed run must equal bit for bit.

use std::collections::BTreeSet;
use std::sync::Arc;

use rayon::prelude::*;

use super::{
    Blob, Change, DecodedCache, FailureReason, Graph, GraphEdit, NodeFailure, NodeId, NodeState, PlanError, Planner,
    Registry, RunContext,
};

/// How many encoded bytes of inputs are kept decoded in one process (128 MiB).
const DECODED_BOUND_BYTES: usize = 128 << 20;

/// In which order ready nodes run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Execution {
    /// One after the other, the earliest ready node first.
    Sequential,
    /// All ready nodes together on the current rayon pool, then the nodes that follow from them.
    Parallel,
}

/// Run the planner's graph to its end in this process, regardless of the placement of its nodes.
///
/// # Errors
/// Those of the planner, which by default ends the run when a node fails.
pub fn run_in_process<P: Planner>(mut planner: P, registry: &Registry, execution: Execution) -> Result<P, PlanError> {
    let mut graph = Graph::new();
    let decoded = Arc::new(DecodedCache::new(DECODED_BOUND_BYTES));
    // By priority, then by number.
    let mut ready = BTreeSet::new();
    planner.start(&mut GraphEdit::new(&mut graph))?;
    loop {
        notify(&mut planner, &mut graph, &mut ready)?;
        // A node may have been cancelled after it became ready.
        let next = std::iter::from_fn(|| ready.pop_first()).map(|(_, node)| node).filter(|node| graph.is_open(*node));
        let chosen: Vec<NodeId> = match execution {
            Execution::Sequential => next.take(1).collect(),
            Execution::Parallel => next.collect(),
        };
        if chosen.is_empty() {
            return Ok(planner);
        }
        let run_one = |node: &NodeId| run_node(&graph, *node, registry, &decoded);
        let results: Vec<_> = match execution {
            Execution::Sequential => chosen.iter().map(run_one).collect(),
            Execution::Parallel => chosen.par_iter().map(run_one).collect(),
        };
        for (node, result) in chosen.into_iter().zip(results) {
            match result {
                // Each node runs once, so it is open here and the output cannot be refused.
                Ok(output) => _ = graph.complete(node, output),
                Err(failure) => graph.fail(node, FailureReason::Node(failure)),
            }
        }
    }
}

/// Report all changes to the planner, which may cause more changes, and collect the nodes that became ready.
fn notify<P: Planner>(
    planner: &mut P,
    graph: &mut Graph,
    ready: &mut BTreeSet<(u32, NodeId)>,
) -> Result<(), PlanError> {
    while let Some(change) = graph.next_change() {
        match change {
            Change::Added(_) | Change::Forgotten(_) => {}
            Change::Ready(node) => {
                let priority = graph.spec(node).map_or(0, |spec| spec.priority);
                ready.insert((priority, node));
            }
            Change::Completed(node) => {
                if let Some(output) = graph.output(node).cloned() {
                    planner.completed(node, &output, &mut GraphEdit::new(graph))?;
                }
            }
            Change::Failed(node) => {
                if let Some(NodeState::Failed(reason)) = graph.state(node).cloned()
                    && !reason.is_cancellation()
                {
                    planner.failed(node, &reason, &mut GraphEdit::new(graph))?;
                }
            }
        }
    }
    Ok(())
}

fn run_node(
    graph: &Graph,
    node: NodeId,
    registry: &Registry,
    decoded: &Arc<DecodedCache>,
) -> Result<Blob, NodeFailure> {
    let missing = || NodeFailure::new("an input of a ready node is missing: a bug in the job graph, please report it");
    let spec = graph.spec(node).ok_or_else(missing)?;
    let inputs = graph.input_blobs(node).ok_or_else(missing)?;
    registry.run(&spec.kind, &spec.parameters, &inputs, &RunContext::new(Arc::clone(decoded)))
}
