//! The planner, which adds the nodes of a run.

use super::{Blob, FailureReason, GraphEdit, NodeId, NodeSpec, PlanError};

/// Adds the nodes of a run. The run ends when no node is open.
///
/// Nodes finish in any order. The outcome of a planner must depend on their outputs alone, never on the order or on the numbers of the
/// nodes.
pub trait Planner {
    /// Add the first nodes.
    ///
    /// # Errors
    /// If the run is impossible. The error ends the run.
    fn start(&mut self, graph: &mut GraphEdit<'_>) -> Result<(), PlanError>;

    /// A node has completed with this output; the planner may add more nodes. Called once per completed node.
    ///
    /// # Errors
    /// If the output is wrong. The error ends the run.
    fn completed(&mut self, node: NodeId, output: &Blob, graph: &mut GraphEdit<'_>) -> Result<(), PlanError>;

    /// A node failed. Called once per failed node, including nodes that failed because an input failed, but not for nodes that were
    /// cancelled because the planner released them. A planner of several fits overrides this to end only the fit of the node.
    ///
    /// # Errors
    /// By default an error that names the node. The error ends the run.
    fn failed(&mut self, node: NodeId, reason: &FailureReason, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        let (kind, label) =
            graph.spec(node).map(|spec| (spec.kind.clone(), spec.label.to_string())).unwrap_or_default();
        Err(PlanError::NodeFailed { kind, label, reason: reason.clone() })
    }

    /// Something that the planner waits for outside of the graph may have happened, such as the end of reading inputs; the planner may
    /// add more nodes. May be called at any time after [`start`](Self::start). By default without effect.
    ///
    /// # Errors
    /// If the run is impossible. The error ends the run.
    fn look_again(&mut self, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        let _ = graph;
        Ok(())
    }

    /// Whether a run that verifies a share of its nodes by a second execution should include this node. Not useful if
    /// [`completed`](Self::completed) verifies the output itself. By default true.
    fn is_verified_by_repetition(&self, spec: &NodeSpec) -> bool {
        let _ = spec;
        true
    }
}
