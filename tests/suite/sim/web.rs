//! The graph of a simulated run: a random web of small nodes that grows as outputs arrive. Its final form depends only on the seed, not
//! on the order of outputs.

use std::collections::BTreeMap;

use lookalike::graph::{
    Blob, BlobHash, FailureReason, GraphEdit, Input, NodeFailure, NodeId, NodeSpec, NodeType, Placement, PlanError,
    Planner, Registry, RunContext,
};

use super::chance::Chance;
use super::world::kill_this_host;

/// How deep the web grows below its roots.
const DEPTH: usize = 3;

/// The kinds of its nodes.
#[must_use]
pub(super) fn registry() -> Registry {
    Registry::default().with(Mix).with(Fail).with(Panic).with(Deadly)
}

/// The label of a node that may or may not run, because the end of another node cancels it.
const FRINGE: &str = "fringe";

/// Plans the web and keeps the outcome of each node, by its label.
#[derive(Debug)]
pub(super) struct Web {
    seed: u64,
    roots: Vec<NodeId>,
    blobs: Vec<BlobHash>,
    fringe: Option<NodeId>,
    /// The hash of the output, or the reason for its absence.
    pub(super) results: BTreeMap<String, String>,
}

impl Web {
    pub(super) fn new(seed: u64) -> Self {
        Self { seed, roots: Vec::new(), blobs: Vec::new(), fringe: None, results: BTreeMap::new() }
    }

    fn add(&self, graph: &mut GraphEdit<'_>, label: String, inputs: Vec<Input>) -> Result<NodeId, PlanError> {
        let stream = BlobHash::of(label.as_bytes()).0.iter().take(8).fold(0, |word, byte| word << 8 | u64::from(*byte));
        let mut chance = Chance::new(self.seed, stream);
        let lot = chance.share();
        let kind = match label.as_str() {
            FRINGE => "mix",
            _ if lot < 0.005 => "deadly",
            _ if lot < 0.02 => "panic",
            _ if lot < 0.04 => "fail",
            _ => "mix",
        };
        let is_here = kind != "deadly" && chance.happens(0.15);
        let placement = if is_here { Placement::Coordinator } else { Placement::Worker };
        let bytes = match chance.share() {
            lot if lot < 0.85 => chance.between(32, 2000),
            lot if lot < 0.98 => chance.between(10_000, 100_000),
            _ => chance.between(1 << 20, 3 << 20),
        };
        let parameters = [&bytes.to_le_bytes(), label.as_bytes()].concat();
        let priority = u32::try_from(chance.between(0, 2)).unwrap_or(0);
        graph.add_node(NodeSpec { kind: kind.into(), label: label.into(), parameters, inputs, placement, priority })
    }
}

impl Planner for Web {
    fn start(&mut self, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        let mut chance = Chance::new(self.seed, 1);
        for index in 0..chance.between(1, 4) {
            let length = chance.of(&[100, 100, 20_000, 400_000]);
            let bytes = (0..=250_u8).cycle().skip(usize::try_from(index).unwrap_or(0)).take(length).collect();
            self.blobs.push(graph.add_blob(bytes)?);
        }
        for root in 0..chance.between(4, 16) {
            let mut inputs = vec![Input::Blob(chance.of(&self.blobs))];
            if !self.roots.is_empty() && chance.happens(0.3) {
                inputs.push(Input::OutputOf(chance.of(&self.roots)));
            }
            let node = self.add(graph, format!("n{root}"), inputs)?;
            self.roots.push(node);
        }
        let inputs = vec![Input::Blob(self.blobs[0])];
        self.fringe = Some(self.add(graph, FRINGE.into(), inputs)?);
        Ok(())
    }

    fn completed(&mut self, node: NodeId, output: &Blob, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        let label = graph.spec(node).map(|spec| spec.label.to_string()).unwrap_or_default();
        if label == FRINGE {
            return Ok(());
        }
        let told = self.results.insert(label.clone(), hex(&output.hash()));
        assert!(told.is_none(), "{label} was completed twice");
        if self.roots.first() == Some(&node) {
            self.fringe.take().into_iter().for_each(|fringe| graph.release(fringe));
        }
        // What is added here depends on the output, not on which other nodes are done.
        let [first, second, ..] = output.hash().0;
        if label.matches('.').count() < DEPTH {
            for child in 0..first % 3 {
                let root = self.roots[usize::from(second) % self.roots.len()];
                let mut inputs =
                    vec![Input::OutputOf(node), Input::Blob(self.blobs[usize::from(child) % self.blobs.len()])];
                if second.is_multiple_of(2) {
                    inputs.push(Input::OutputOf(root));
                }
                self.add(graph, format!("{label}.{child}"), inputs)?;
            }
        }
        if !self.roots.contains(&node) {
            graph.release(node);
        }
        Ok(())
    }

    fn failed(&mut self, node: NodeId, reason: &FailureReason, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        let (kind, label) =
            graph.spec(node).map(|spec| (spec.kind.clone(), spec.label.to_string())).unwrap_or_default();
        let why = match reason {
            FailureReason::Crashed { .. } if kind == "deadly" => "deadly".into(),
            // If several inputs fail, the one that is named depends on which failed first.
            FailureReason::InputFailed { .. } => "without an input".into(),
            reason => reason.to_string(),
        };
        let told = self.results.insert(label.clone(), why);
        assert!(told.is_none(), "{label} has failed twice");
        if self.roots.first() == Some(&node) {
            self.fringe.take().into_iter().for_each(|fringe| graph.release(fringe));
        }
        Ok(())
    }

    fn is_verified_by_repetition(&self, spec: &NodeSpec) -> bool {
        spec.kind == "mix"
    }
}

fn hex(hash: &BlobHash) -> String {
    hash.0.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// As many bytes as the number at the start of the parameters, made from all parameters and inputs.
struct Mix;

impl NodeType for Mix {
    fn kind(&self) -> &'static str {
        "mix"
    }

    fn run(&self, parameters: &[u8], inputs: &[Blob], _: &RunContext) -> Result<Vec<u8>, NodeFailure> {
        let named: Vec<u8> = parameters.iter().copied().chain(inputs.iter().flat_map(|input| input.hash().0)).collect();
        let length = parameters.first_chunk().map_or(32, |length| u64::from_le_bytes(*length));
        let seed = BlobHash::of(&named).0;
        Ok(seed.iter().copied().cycle().take(usize::try_from(length).unwrap_or(32)).collect())
    }
}

/// An application error.
struct Fail;

impl NodeType for Fail {
    fn kind(&self) -> &'static str {
        "fail"
    }

    fn run(&self, _: &[u8], _: &[Blob], _: &RunContext) -> Result<Vec<u8>, NodeFailure> {
        Err(NodeFailure::new("asked to fail"))
    }
}

/// Panics.
struct Panic;

impl NodeType for Panic {
    fn kind(&self) -> &'static str {
        "panic"
    }

    fn run(&self, _: &[u8], _: &[Blob], _: &RunContext) -> Result<Vec<u8>, NodeFailure> {
        // A panic without a message on stderr, because there are many.
        std::panic::resume_unwind(Box::new("asked to panic"))
    }
}

/// Ends the process that executes it. In the test's own process it only returns an error.
struct Deadly;

impl NodeType for Deadly {
    fn kind(&self) -> &'static str {
        "deadly"
    }

    fn run(&self, _: &[u8], _: &[Blob], _: &RunContext) -> Result<Vec<u8>, NodeFailure> {
        kill_this_host();
        Err(NodeFailure::new("deadly"))
    }
}
