//! The graph itself: nodes, their states, the blobs, and the changes that its owner has not yet looked at.
//!
//! Inputs can only name nodes that exist, so the graph has no cycles by construction and drains by itself: as long as a
//! node is open, some node is ready.

use std::collections::{BTreeMap, VecDeque};

use super::{
    Blob, BlobHash, FailureReason, Input, MAX_BLOB_BYTES, MAX_INPUTS, MAX_NAME_BYTES, MAX_PARAMETER_BYTES, NodeId,
    NodeKey, NodeSpec, PlanError,
};

/// Where a node is on its way.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum NodeState {
    /// Some input is not there yet.
    Waiting,
    /// All inputs are there; it may run, or is running.
    Ready,
    /// It has an output, the blob of this name.
    Completed(BlobHash),
    /// It has no output and never will.
    Failed(FailureReason),
}

/// Something that happened to a node, in the order in which it happened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// It was added.
    Added(NodeId),
    /// Its inputs are all there.
    Ready(NodeId),
    /// Its output is there.
    Completed(NodeId),
    /// It failed, itself or through an input.
    Failed(NodeId),
}

/// What became of an output that was handed to [`Graph::complete`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Completion {
    /// It is the node's output.
    Accepted,
    /// The node already has this very output, bit for bit.
    Duplicate,
    /// The node already has another output: some computation was not a pure function of its inputs.
    Different {
        /// The output that came first and stays.
        first: BlobHash,
    },
    /// The node has failed, or is waiting for inputs, or is unknown: it cannot have an output.
    Refused,
}

/// The nodes of a run, the blobs they read and write, and the changes since the owner last asked.
#[derive(Debug, Default)]
pub struct Graph {
    nodes: Vec<Node>,
    blobs: BTreeMap<BlobHash, Blob>,
    changes: VecDeque<Change>,
    open: usize,
}

#[derive(Debug)]
struct Node {
    spec: NodeSpec,
    state: NodeState,
    awaited_inputs: usize,
    dependents: Vec<NodeId>,
}

impl Graph {
    /// A graph without nodes and blobs.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Keep a blob, so that nodes can name it as an input. Equal bytes are kept once.
    ///
    /// # Errors
    /// When it is longer than [`MAX_BLOB_BYTES`].
    pub fn add_blob(&mut self, bytes: Vec<u8>) -> Result<BlobHash, PlanError> {
        check_limit("blob", bytes.len(), MAX_BLOB_BYTES)?;
        Ok(self.keep(Blob::new(bytes)))
    }

    /// Add a node. It is ready at once if its inputs are there, and failed at once if one of them has failed.
    ///
    /// # Errors
    /// When an input is unknown or a size limit is passed.
    pub fn add_node(&mut self, spec: NodeSpec) -> Result<NodeId, PlanError> {
        check_limit("kind", spec.kind.len(), MAX_NAME_BYTES)?;
        check_limit("label", spec.label.len(), MAX_NAME_BYTES)?;
        check_limit("parameters", spec.parameters.len(), MAX_PARAMETER_BYTES)?;
        check_limit("inputs", spec.inputs.len(), MAX_INPUTS)?;
        let mut failed_input = None;
        let mut awaited = Vec::new();
        for input in &spec.inputs {
            match *input {
                Input::Blob(hash) if !self.blobs.contains_key(&hash) => {
                    return Err(PlanError::UnknownBlob { label: spec.label, hash });
                }
                Input::Blob(_) => {}
                Input::OutputOf(source) => match self.state(source) {
                    None => return Err(PlanError::UnknownInput { label: spec.label, node: source }),
                    Some(NodeState::Failed(_)) => failed_input = failed_input.or(Some(source)),
                    Some(NodeState::Completed(_)) => {}
                    Some(NodeState::Waiting | NodeState::Ready) => awaited.push(source),
                },
            }
        }
        let node = NodeId(self.nodes.len() as u64);
        for source in &awaited {
            self.at_mut(*source).dependents.push(node);
        }
        let state = if awaited.is_empty() { NodeState::Ready } else { NodeState::Waiting };
        let is_ready = awaited.is_empty() && failed_input.is_none();
        self.nodes.push(Node { spec, state, awaited_inputs: awaited.len(), dependents: Vec::new() });
        self.open += 1;
        self.changes.push_back(Change::Added(node));
        if let Some(source) = failed_input {
            self.fail(node, self.input_failed(source));
        } else if is_ready {
            self.changes.push_back(Change::Ready(node));
        }
        Ok(node)
    }

    /// Hand in an output of a node. Any computation of a ready node will do: all of them are equal.
    pub fn complete(&mut self, node: NodeId, output: Blob) -> Completion {
        match self.state(node) {
            Some(NodeState::Ready) => {}
            Some(NodeState::Completed(first)) if *first == output.hash() => return Completion::Duplicate,
            Some(NodeState::Completed(first)) => return Completion::Different { first: *first },
            Some(NodeState::Waiting | NodeState::Failed(_)) | None => return Completion::Refused,
        }
        let hash = self.keep(output);
        self.open -= 1;
        self.changes.push_back(Change::Completed(node));
        let completed = self.at_mut(node);
        completed.state = NodeState::Completed(hash);
        for dependent in std::mem::take(&mut completed.dependents) {
            let waiting = self.at_mut(dependent);
            waiting.awaited_inputs -= 1;
            if waiting.awaited_inputs == 0 && waiting.state == NodeState::Waiting {
                waiting.state = NodeState::Ready;
                self.changes.push_back(Change::Ready(dependent));
            }
        }
        Completion::Accepted
    }

    /// Close an open node without an output, and with it every node that waits for it. Does nothing to a closed node.
    pub fn fail(&mut self, node: NodeId, reason: FailureReason) {
        let mut failing = VecDeque::from([(node, reason)]);
        while let Some((node, reason)) = failing.pop_front() {
            if !self.is_open(node) {
                continue;
            }
            let failed = self.at_mut(node);
            failed.state = NodeState::Failed(reason);
            let dependents = std::mem::take(&mut failed.dependents);
            self.open -= 1;
            self.changes.push_back(Change::Failed(node));
            failing.extend(dependents.into_iter().map(|dependent| (dependent, self.input_failed(node))));
        }
    }

    /// The oldest change that was not looked at yet.
    pub fn next_change(&mut self) -> Option<Change> {
        self.changes.pop_front()
    }

    /// The state of a node; `None` for an unknown one.
    #[must_use]
    pub fn state(&self, node: NodeId) -> Option<&NodeState> {
        Some(&self.get(node)?.state)
    }

    /// The description of a node; `None` for an unknown one.
    #[must_use]
    pub fn spec(&self, node: NodeId) -> Option<&NodeSpec> {
        Some(&self.get(node)?.spec)
    }

    /// The output of a completed node.
    #[must_use]
    pub fn output(&self, node: NodeId) -> Option<&Blob> {
        match self.state(node)? {
            NodeState::Completed(hash) => self.blob(*hash),
            _ => None,
        }
    }

    /// A blob by its name.
    #[must_use]
    pub fn blob(&self, hash: BlobHash) -> Option<&Blob> {
        self.blobs.get(&hash)
    }

    /// The input blobs of a node, in the order of its specification; `None` while one of them is missing.
    #[must_use]
    pub fn input_blobs(&self, node: NodeId) -> Option<Vec<Blob>> {
        let blob_of = |input: &Input| match *input {
            Input::Blob(hash) => self.blob(hash).cloned(),
            Input::OutputOf(source) => self.output(source).cloned(),
        };
        self.get(node)?.spec.inputs.iter().map(blob_of).collect()
    }

    /// What a node computes; `None` while an input is missing. It stays the same when blobs are gone.
    #[must_use]
    pub fn key(&self, node: NodeId) -> Option<NodeKey> {
        let spec = self.spec(node)?;
        let hash_of = |input: &Input| match *input {
            Input::Blob(hash) => Some(hash),
            Input::OutputOf(source) => match self.state(source)? {
                NodeState::Completed(hash) => Some(*hash),
                _ => None,
            },
        };
        let inputs: Vec<BlobHash> = spec.inputs.iter().map(hash_of).collect::<Option<_>>()?;
        Some(NodeKey::of(&spec.kind, &spec.parameters, inputs))
    }

    /// Whether a node has neither an output nor a failure yet.
    #[must_use]
    pub fn is_open(&self, node: NodeId) -> bool {
        matches!(self.state(node), Some(NodeState::Waiting | NodeState::Ready))
    }

    /// How many nodes there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Whether there are no nodes at all.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Whether no node is open and no change is unread: nothing more can happen.
    #[must_use]
    pub fn is_drained(&self) -> bool {
        self.open == 0 && self.changes.is_empty()
    }

    fn keep(&mut self, blob: Blob) -> BlobHash {
        let hash = blob.hash();
        self.blobs.entry(hash).or_insert(blob);
        hash
    }

    fn input_failed(&self, node: NodeId) -> FailureReason {
        let label = self.spec(node).map(|spec| spec.label.clone()).unwrap_or_default();
        FailureReason::InputFailed { node, label }
    }

    fn get(&self, node: NodeId) -> Option<&Node> {
        self.nodes.get(usize::try_from(node.0).ok()?)
    }

    /// A node that is known to exist because this graph itself wrote its number down.
    fn at_mut(&mut self, node: NodeId) -> &mut Node {
        let index = usize::try_from(node.0).unwrap_or(usize::MAX);
        &mut self.nodes[index]
    }
}

fn check_limit(what: &'static str, found: usize, limit: usize) -> Result<(), PlanError> {
    if found > limit { Err(PlanError::TooLarge { what, found, limit }) } else { Ok(()) }
}
