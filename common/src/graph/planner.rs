//! The planner: decides which nodes there are.

use super::{Blob, FailureReason, GraphEdit, NodeId, NodeSpec, PlanError};

/// Decides which nodes a run has. The run ends when no node is open.
///
/// Nodes finish in any order, so the planner is told in any order: what it makes of the outputs must depend on the
/// outputs alone, never on their order or on the numbers of the nodes.
pub trait Planner {
    /// Add the first nodes.
    ///
    /// # Errors
    /// What makes the run impossible; it ends the run.
    fn start(&mut self, graph: &mut GraphEdit<'_>) -> Result<(), PlanError>;

    /// A node has this output; more nodes may follow from it. Called once per completed node.
    ///
    /// # Errors
    /// When the output is not what it should be; it ends the run.
    fn completed(&mut self, node: NodeId, output: &Blob, graph: &mut GraphEdit<'_>) -> Result<(), PlanError>;

    /// A node failed. Called once per failed node, also for those that only lack its output, but not for those that were cancelled
    /// because the planner released them. A planner of several fits overrides this to give up only the fit that the node
    /// belongs to.
    ///
    /// # Errors
    /// Unless overridden, an error that names the node: it ends the run.
    fn failed(&mut self, node: NodeId, reason: &FailureReason, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        let (kind, label) = graph.spec(node).map(|spec| (spec.kind.clone(), spec.label.clone())).unwrap_or_default();
        Err(PlanError::NodeFailed { kind, label, reason: reason.clone() })
    }

    /// Something outside of the run may have changed that the planner waits for, such as inputs that are being read: more nodes may
    /// follow. May be called at any time after [`start`](Self::start). By default nothing changes.
    ///
    /// # Errors
    /// What makes the run impossible; it ends the run.
    fn look_again(&mut self, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        let _ = graph;
        Ok(())
    }

    /// Whether a second run of this node would tell whether its output is right, for the share of nodes that a run verifies.
    /// Not worth it where [`completed`](Self::completed) computes the output's claims again. By default every node.
    fn is_verified_by_repetition(&self, spec: &NodeSpec) -> bool {
        let _ = spec;
        true
    }
}
