//! The graph itself: nodes, their states, the blobs, and the queue of changes that its owner has not read.
//!
//! A node or a blob is *held* from its addition until its release. A blob or an output that is not held is dropped when the last open
//! node that reads it closes. An open node that is not held is cancelled when the last open node that waits for it closes.
//!
//! Inputs can only name existing nodes, so the graph has no cycles, and as long as a node is open, some node is ready.

use std::collections::VecDeque;

use super::{
    Blob, BlobHash, FailureReason, Input, MAX_BLOB_BYTES, MAX_INPUTS, MAX_NAME_BYTES, MAX_PARAMETER_BYTES, NodeFailure,
    NodeId, NodeKey, NodeSpec, Placement, PlanError, store::BlobStore,
};

/// The state of a node.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum NodeState {
    /// Some input is missing.
    Waiting,
    /// All inputs are available; it can run, or is running.
    Ready,
    /// It has an output, the blob of this hash.
    Completed(BlobHash),
    /// It will never have an output.
    Failed(FailureReason),
}

/// A change of a node. Changes are queued in the order in which they happened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// It was added.
    Added(NodeId),
    /// All its inputs are available.
    Ready(NodeId),
    /// It has an output.
    Completed(NodeId),
    /// It failed, or an input of it failed.
    Failed(NodeId),
    /// Its output will never be needed again, not even when the run is resumed.
    Forgotten(NodeId),
}

/// The answer of [`Graph::complete`] to an output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Completion {
    /// It is the node's output.
    Accepted,
    /// The node already has an output, which is equal bit for bit.
    Duplicate,
    /// The node already has a different output: one of the computations was wrong or not a pure function of its inputs.
    Different {
        /// The first output, which is kept.
        first: BlobHash,
    },
    /// The node has failed, is waiting for inputs, or is unknown, so it cannot have an output.
    Refused,
}

/// The nodes of a run, the blobs that they read and write, and the queue of unread changes.
#[derive(Debug, Default)]
pub struct Graph {
    nodes: Vec<Node>,
    blobs: BlobStore,
    changes: VecDeque<Change>,
    open: usize,
    ready_for_workers: usize,
}

#[derive(Debug)]
struct Node {
    spec: NodeSpec,
    state: NodeState,
    awaited_inputs: usize,
    dependents: Vec<NodeId>,
    /// How often the node is held. A holder may read its output and add nodes that read it.
    holders: usize,
}

/// The inputs of a new node, by their state.
#[derive(Default)]
struct Inputs {
    /// Available blobs.
    read: Vec<BlobHash>,
    /// Open nodes.
    awaited: Vec<NodeId>,
    /// A node that has failed.
    failed: Option<NodeId>,
}

impl Graph {
    /// A graph without nodes and blobs.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Hold a blob, so that nodes can name it as an input. Equal bytes are stored once, and must be released as often as they were
    /// added.
    ///
    /// # Errors
    /// When it is longer than [`MAX_BLOB_BYTES`].
    pub fn add_blob(&mut self, bytes: Vec<u8>) -> Result<BlobHash, PlanError> {
        self.add(Blob::new(bytes))
    }

    /// As [`add_blob`](Self::add_blob), for a blob that is already hashed.
    ///
    /// # Errors
    /// When it is longer than [`MAX_BLOB_BYTES`].
    pub fn add(&mut self, blob: Blob) -> Result<BlobHash, PlanError> {
        check_limit("blob", blob.len(), MAX_BLOB_BYTES)?;
        let hash = blob.hash();
        self.blobs.add(blob, 1);
        Ok(hash)
    }

    /// Release a blob that was added: it is dropped once no open node reads it.
    pub fn release_blob(&mut self, hash: BlobHash) {
        self.blobs.release(hash);
    }

    /// Add a node, and hold it. It is ready at once if all its inputs are available, and failed at once if one of them has failed.
    ///
    /// # Errors
    /// If an input is unknown or was released, or a size limit is exceeded.
    pub fn add_node(&mut self, spec: NodeSpec) -> Result<NodeId, PlanError> {
        check_limit("kind", spec.kind.len(), MAX_NAME_BYTES)?;
        check_limit("label", spec.label.bytes(), MAX_NAME_BYTES)?;
        check_limit("parameters", spec.parameters.len(), MAX_PARAMETER_BYTES)?;
        check_limit("inputs", spec.inputs.len(), MAX_INPUTS)?;
        let Inputs { read, awaited, failed } = self.look_at_inputs(&spec)?;
        let node = NodeId(self.nodes.len() as u64);
        for source in &awaited {
            self.at_mut(*source).dependents.push(node);
        }
        for hash in read {
            self.blobs.retain(hash);
        }
        let awaited_inputs = awaited.len();
        self.nodes.push(Node { spec, state: NodeState::Waiting, awaited_inputs, dependents: Vec::new(), holders: 1 });
        self.open += 1;
        self.changes.push_back(Change::Added(node));
        if let Some(source) = failed {
            self.fail(node, self.input_failed(source));
        } else if awaited_inputs == 0 {
            self.make_ready(node);
        }
        Ok(node)
    }

    fn look_at_inputs(&self, spec: &NodeSpec) -> Result<Inputs, PlanError> {
        let label = || spec.label.to_string();
        let Inputs { mut read, mut awaited, mut failed } = Inputs::default();
        for input in &spec.inputs {
            match *input {
                Input::Blob(hash) if self.blob(hash).is_none() => {
                    return Err(PlanError::UnknownBlob { label: label(), hash });
                }
                Input::Blob(hash) => read.push(hash),
                Input::OutputOf(source) => match self.state(source) {
                    None => return Err(PlanError::UnknownInput { label: label(), node: source }),
                    Some(NodeState::Failed(_)) => failed = failed.or(Some(source)),
                    Some(NodeState::Completed(hash)) if self.blob(*hash).is_none() => {
                        return Err(PlanError::Released { label: label(), node: source });
                    }
                    Some(NodeState::Completed(hash)) => read.push(*hash),
                    Some(NodeState::Waiting | NodeState::Ready) => awaited.push(source),
                },
            }
        }
        Ok(Inputs { read, awaited, failed })
    }

    /// Hold a node once more. Returns false, without effect, if it has failed or its output was dropped.
    pub fn hold(&mut self, node: NodeId) -> bool {
        let output = match self.state(node) {
            Some(NodeState::Completed(hash)) if self.blob(*hash).is_some() => Some(*hash),
            Some(NodeState::Waiting | NodeState::Ready) => None,
            Some(NodeState::Completed(_) | NodeState::Failed(_)) | None => return false,
        };
        let held = self.at_mut(node);
        held.holders += 1;
        if let (1, Some(hash)) = (held.holders, output) {
            self.blobs.retain(hash);
        }
        true
    }

    /// Release a node once. After the last release, its output is dropped once no open node reads it, and an open node is cancelled
    /// unless another open node waits for it.
    pub fn release(&mut self, node: NodeId) {
        let Some(held) = self.get_mut(node) else { return };
        if held.holders == 0 {
            return;
        }
        held.holders -= 1;
        if let (0, NodeState::Completed(hash)) = (held.holders, &held.state) {
            let hash = *hash;
            self.blobs.release(hash);
        }
        if self.is_unwanted(node) {
            self.fail(node, FailureReason::Node(NodeFailure::Cancelled));
        }
    }

    /// Whether a node is open, is not held, and no open node waits for it.
    fn is_unwanted(&self, node: NodeId) -> bool {
        let is_awaited = |held: &Node| held.dependents.iter().any(|dependent| self.is_open(*dependent));
        self.is_open(node) && self.get(node).is_some_and(|held| held.holders == 0 && !is_awaited(held))
    }

    /// Declare that the output of a completed node will never be needed again, not even when the run is resumed. This does not release
    /// the node.
    pub fn forget(&mut self, node: NodeId) {
        if matches!(self.state(node), Some(NodeState::Completed(_))) {
            self.changes.push_back(Change::Forgotten(node));
        }
    }

    fn make_ready(&mut self, node: NodeId) {
        let waiting = self.at_mut(node);
        waiting.state = NodeState::Ready;
        self.ready_for_workers += usize::from(waiting.spec.placement == Placement::Worker);
        self.changes.push_back(Change::Ready(node));
    }

    /// Close an open node and release its inputs.
    fn close(&mut self, node: NodeId, state: NodeState) {
        let closed = self.at_mut(node);
        let was_ready = closed.state == NodeState::Ready && closed.spec.placement == Placement::Worker;
        closed.state = state;
        self.open -= 1;
        self.ready_for_workers -= usize::from(was_ready);
        // Take the inputs out of the node, because the loop borrows the graph; they are put back below.
        let inputs = std::mem::take(&mut self.at_mut(node).spec.inputs);
        for input in &inputs {
            match *input {
                Input::Blob(hash) => self.blobs.release(hash),
                Input::OutputOf(source) => {
                    if let Some(NodeState::Completed(hash)) = self.state(source) {
                        let hash = *hash;
                        self.blobs.release(hash);
                    }
                }
            }
        }
        self.at_mut(node).spec.inputs = inputs;
    }

    /// Take an output of a node. It may come from any computation of the node, because all of them are equal.
    pub fn complete(&mut self, node: NodeId, output: Blob) -> Completion {
        match self.state(node) {
            Some(NodeState::Ready) => {}
            Some(NodeState::Completed(first)) if *first == output.hash() => return Completion::Duplicate,
            Some(NodeState::Completed(first)) => return Completion::Different { first: *first },
            Some(NodeState::Waiting | NodeState::Failed(_)) | None => return Completion::Refused,
        }
        let completed = self.at_mut(node);
        let is_held = completed.holders > 0;
        let dependents = std::mem::take(&mut completed.dependents);
        let readers = dependents.iter().filter(|dependent| self.is_open(**dependent)).count();
        let hash = output.hash();
        self.blobs.add(output, readers + usize::from(is_held));
        self.close(node, NodeState::Completed(hash));
        self.changes.push_back(Change::Completed(node));
        for dependent in dependents {
            let waiting = self.at_mut(dependent);
            waiting.awaited_inputs -= 1;
            if waiting.awaited_inputs == 0 && waiting.state == NodeState::Waiting {
                self.make_ready(dependent);
            }
        }
        Completion::Accepted
    }

    /// Fail an open node and every node that waits for it. Nodes that are not held and that only these were waiting for are cancelled.
    /// No effect on a closed node.
    pub fn fail(&mut self, node: NodeId, reason: FailureReason) {
        let mut failing = VecDeque::from([(node, reason)]);
        // Inputs of the failed nodes.
        let mut inputs = Vec::new();
        loop {
            while let Some((node, reason)) = failing.pop_front() {
                if !self.is_open(node) {
                    continue;
                }
                self.close(node, NodeState::Failed(reason));
                self.changes.push_back(Change::Failed(node));
                let failed = self.at_mut(node);
                let dependents = std::mem::take(&mut failed.dependents);
                inputs.extend(failed.spec.inputs.iter().filter_map(Input::node));
                failing.extend(dependents.into_iter().map(|dependent| (dependent, self.input_failed(node))));
            }
            let Some(source) = inputs.pop() else { return };
            if self.is_unwanted(source) {
                failing.push_back((source, FailureReason::Node(NodeFailure::Cancelled)));
            }
        }
    }

    /// Takes the oldest unread change.
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

    /// The output of a completed node, unless it was dropped.
    #[must_use]
    pub fn output(&self, node: NodeId) -> Option<&Blob> {
        match self.state(node)? {
            NodeState::Completed(hash) => self.blob(*hash),
            _ => None,
        }
    }

    /// A blob by its hash.
    #[must_use]
    pub fn blob(&self, hash: BlobHash) -> Option<&Blob> {
        self.blobs.get(hash)
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

    /// The hashes of a node's inputs, in the order of its specification; `None` while an input has no output. They remain available
    /// after the blobs are dropped.
    #[must_use]
    pub fn input_hashes(&self, node: NodeId) -> Option<Vec<BlobHash>> {
        let hash_of = |input: &Input| match *input {
            Input::Blob(hash) => Some(hash),
            Input::OutputOf(source) => match self.state(source)? {
                NodeState::Completed(hash) => Some(*hash),
                _ => None,
            },
        };
        self.spec(node)?.inputs.iter().map(hash_of).collect()
    }

    /// The key of what a node computes; `None` while an input has no output. It remains available after blobs are dropped.
    #[must_use]
    pub fn key(&self, node: NodeId) -> Option<NodeKey> {
        let spec = self.spec(node)?;
        Some(NodeKey::of(&spec.kind, &spec.parameters, self.input_hashes(node)?))
    }

    /// Whether a node has neither an output nor a failure yet.
    #[must_use]
    pub fn is_open(&self, node: NodeId) -> bool {
        matches!(self.state(node), Some(NodeState::Waiting | NodeState::Ready))
    }

    /// How many nodes placed on workers are ready or running.
    #[must_use]
    pub fn ready_for_workers(&self) -> usize {
        self.ready_for_workers
    }

    /// The size of all stored blobs, in bytes; takes time linear in their number.
    #[must_use]
    pub fn blob_bytes(&self) -> usize {
        self.blobs.bytes()
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

    /// Whether no node is open and no change is unread, so that the run is over.
    #[must_use]
    pub fn is_drained(&self) -> bool {
        self.open == 0 && self.changes.is_empty()
    }

    fn input_failed(&self, node: NodeId) -> FailureReason {
        let label = self.spec(node).map(|spec| spec.label.to_string()).unwrap_or_default();
        FailureReason::InputFailed { node, label }
    }

    fn get(&self, node: NodeId) -> Option<&Node> {
        self.nodes.get(usize::try_from(node.0).ok()?)
    }

    fn get_mut(&mut self, node: NodeId) -> Option<&mut Node> {
        self.nodes.get_mut(usize::try_from(node.0).ok()?)
    }

    /// A node that is known to exist because its number comes from this graph.
    fn at_mut(&mut self, node: NodeId) -> &mut Node {
        let index = usize::try_from(node.0).unwrap_or(usize::MAX);
        &mut self.nodes[index]
    }
}

fn check_limit(what: &'static str, found: usize, limit: usize) -> Result<(), PlanError> {
    if found > limit { Err(PlanError::TooLarge { what, found, limit }) } else { Ok(()) }
}
