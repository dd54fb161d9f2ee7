//! Plans of the cluster suite: leaves on workers, their digest on the coordinator, and a last node on a worker, added when the digest is
//! complete. The result depends on every output.

use lookalike::graph::{
    Blob, Execution, FailureReason, GraphEdit, Input, NodeId, NodeSpec, Placement, PlanError, Planner, run_in_process,
};

use crate::nodes::registry;

/// What the leaves are.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Leaves {
    /// This many digests of one shared blob.
    Digests {
        /// How many.
        count: usize,
        /// The size of the blob.
        shared_bytes: usize,
    },
    /// Two large outputs from a large blob.
    Large {
        /// The size of the blob and of each output.
        bytes: usize,
    },
    /// This many nodes that wait at a gate.
    Gates {
        /// How many.
        count: usize,
        /// Where.
        address: String,
    },
    /// One node that aborts its process unless this file exists; it creates the file before, unless the name is empty.
    Abort {
        /// The file.
        marker: String,
    },
    /// This many nodes that wait at a gate, and possibly one more, `killer`, that always aborts its process. If one fails, the others
    /// continue, and the result is that of those that complete.
    GatesAndKiller {
        /// How many wait at the gate.
        gates: usize,
        /// Whether there is a node that always aborts its process.
        has_killer: bool,
        /// Where the gate is.
        address: String,
    },
    /// This many nodes that abort any process they run in, and a planner that continues without them; then a digest of nothing.
    Killers {
        /// How many.
        count: usize,
    },
    /// One node that waits at a gate in the coordinator's own process.
    GateHere {
        /// Where.
        address: String,
    },
    /// One node that panics.
    Panic,
    /// One node of an unregistered kind.
    Unknown,
    /// One node with an application error.
    Fail {
        /// Its message.
        message: String,
    },
}

/// Plans the nodes of some leaves and keeps the last output.
#[derive(Debug)]
pub struct TestPlanner {
    leaves: Leaves,
    nodes: Vec<NodeId>,
    open_leaves: usize,
    digest: Option<NodeId>,
    /// The output of the last node.
    pub result: Option<Vec<u8>>,
}

impl TestPlanner {
    /// A planner that has not started.
    #[must_use]
    pub fn new(leaves: Leaves) -> Self {
        Self { leaves, nodes: Vec::new(), open_leaves: 0, digest: None, result: None }
    }

    /// The result that any run of these leaves must have, computed in this process.
    ///
    /// # Panics
    /// When the plan fails.
    #[must_use]
    pub fn reference(leaves: Leaves) -> Option<Vec<u8>> {
        let planner = run_in_process(Self::new(leaves), &registry(), Execution::Sequential);
        planner.expect("a plan that works").result
    }
}

impl TestPlanner {
    /// Count a completed leaf; after the last one, add the digest.
    fn leaf_is_done(&mut self, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        self.open_leaves -= 1;
        if self.open_leaves == 0 {
            let inputs = self.nodes.iter().map(|leaf| Input::OutputOf(*leaf)).collect();
            let digest = node("digest", "of all leaves", vec![], inputs);
            self.digest = Some(graph.add_node(NodeSpec { placement: Placement::Coordinator, ..digest })?);
        }
        Ok(())
    }
}

impl Planner for TestPlanner {
    fn start(&mut self, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        let (kind, parameters, shared_bytes) = match &self.leaves {
            Leaves::Digests { count, shared_bytes } => {
                let parameters = (0..*count).map(|index| index.to_le_bytes().to_vec()).collect();
                ("digest", parameters, *shared_bytes)
            }
            Leaves::Large { bytes } => ("grow", vec![(*bytes as u64).to_le_bytes().to_vec(); 2], *bytes),
            Leaves::Gates { count, address } => {
                ("gate", (0..*count).map(|leaf| format!("{address}#{leaf}").into_bytes()).collect(), 0)
            }
            Leaves::GatesAndKiller { gates: count, address, .. } => {
                ("gate", (0..*count).map(|leaf| format!("{address}#{leaf}").into_bytes()).collect(), 0)
            }
            Leaves::Abort { marker } => ("abort", vec![marker.clone().into_bytes()], 0),
            Leaves::Killers { count } => ("abort", vec![Vec::new(); *count], 0),
            Leaves::GateHere { address } => ("gate", vec![address.clone().into_bytes()], 0),
            Leaves::Panic => ("panic", vec![Vec::new()], 0),
            Leaves::Unknown => ("nonsense", vec![Vec::new()], 0),
            Leaves::Fail { message } => ("fail", vec![message.clone().into_bytes()], 0),
        };
        let shared = graph.add_blob((0..=250_u8).cycle().take(shared_bytes).collect())?;
        for (index, parameters) in parameters.into_iter().enumerate() {
            let leaf = node(kind, &format!("leaf {index}"), parameters, vec![Input::Blob(shared)]);
            let is_here = matches!(self.leaves, Leaves::GateHere { .. });
            let placement = if is_here { Placement::Coordinator } else { Placement::Worker };
            self.nodes.push(graph.add_node(NodeSpec { placement, ..leaf })?);
        }
        if matches!(self.leaves, Leaves::GatesAndKiller { has_killer: true, .. }) {
            self.nodes.push(graph.add_node(node("abort", "killer", vec![], vec![]))?);
        }
        self.open_leaves = self.nodes.len();
        Ok(())
    }

    fn completed(&mut self, node_id: NodeId, output: &Blob, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        if self.nodes.contains(&node_id) {
            self.leaf_is_done(graph)?;
        } else if self.digest == Some(node_id) {
            graph.add_node(node("digest", "last", b"last".to_vec(), vec![Input::OutputOf(node_id)]))?;
        } else {
            self.result = Some(output.to_vec());
        }
        Ok(())
    }

    fn failed(&mut self, id: NodeId, reason: &FailureReason, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        if matches!(self.leaves, Leaves::GatesAndKiller { .. } | Leaves::Killers { .. }) {
            self.nodes.retain(|leaf| *leaf != id);
            return self.leaf_is_done(graph);
        }
        let (kind, label) = graph.spec(id).map(|spec| (spec.kind.clone(), spec.label.clone())).unwrap_or_default();
        Err(PlanError::NodeFailed { kind, label: label.to_string(), reason: reason.clone() })
    }
}

fn node(kind: &str, label: &str, parameters: Vec<u8>, inputs: Vec<Input>) -> NodeSpec {
    NodeSpec { kind: kind.into(), label: label.into(), parameters, inputs, placement: Placement::Worker, priority: 0 }
}
