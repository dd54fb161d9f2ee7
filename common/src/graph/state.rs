//! The graph itself: nodes, their states, the blobs, and the changes that its owner has not yet looked at.
//!
//! A node is *held* by whoever added it until it is released, and so is a blob. What nobody holds is not kept: an output or a blob
//! goes with the last open node that reads it, an open node is cancelled with the last open node that waits for it.
//!
//! Inputs can only name nodes that exist, so the graph has no cycles by construction and drains by itself: as long as a
//! node is open, some node is ready.

use std::collections::VecDeque;

use super::{
    Blob, BlobHash, FailureReason, Input, MAX_BLOB_BYTES, MAX_INPUTS, MAX_NAME_BYTES, MAX_PARAMETER_BYTES, NodeFailure,
    NodeId, NodeKey, NodeSpec, Placement, PlanError, store::BlobStore,
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
    /// Its output will never be needed again, not even by a run that begins anew from what this one has left.
    Forgotten(NodeId),
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
    /// How many hold the node: each may read its output or add nodes that read it.
    holders: usize,
}

/// What the inputs of a new node are like.
#[derive(Default)]
struct Inputs {
    /// Blobs that are there.
    read: Vec<BlobHash>,
    /// Nodes that are open.
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

    /// Keep a blob until it is released, so that nodes can name it as an input. Equal bytes are kept once, and released as often
    /// as they were added.
    ///
    /// # Errors
    /// When it is longer than [`MAX_BLOB_BYTES`].
    pub fn add_blob(&mut self, bytes: Vec<u8>) -> Result<BlobHash, PlanError> {
        self.add(Blob::new(bytes))
    }

    /// Keep a blob that was hashed before, as [`add_blob`](Self::add_blob) does.
    ///
    /// # Errors
    /// When it is longer than [`MAX_BLOB_BYTES`].
    pub fn add(&mut self, blob: Blob) -> Result<BlobHash, PlanError> {
        check_limit("blob", blob.len(), MAX_BLOB_BYTES)?;
        let hash = blob.hash();
        self.blobs.add(blob, 1);
        Ok(hash)
    }

    /// Hold a blob that was added no more: once no open node reads it, it is let go.
    pub fn release_blob(&mut self, hash: BlobHash) {
        self.blobs.release(hash);
    }

    /// Add a node, and hold it. It is ready at once if its inputs are there, and failed at once if one of them has failed.
    ///
    /// # Errors
    /// When an input is unknown or was released, or a size limit is passed.
    pub fn add_node(&mut self, spec: NodeSpec) -> Result<NodeId, PlanError> {
        check_limit("kind", spec.kind.len(), MAX_NAME_BYTES)?;
        check_limit("label", spec.label.len(), MAX_NAME_BYTES)?;
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
        let label = || spec.label.clone();
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

    /// Hold a node once more, unless it is too late: it has failed, or its output was let go. Whether it is held.
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

    /// Hold a node once less. When nobody holds it any more, its output is let go once no open node reads it; an open node is
    /// cancelled unless another open node waits for it.
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

    /// Whether a node is open though nobody holds it and no open node waits for it.
    fn is_unwanted(&self, node: NodeId) -> bool {
        let is_awaited = |held: &Node| held.dependents.iter().any(|dependent| self.is_open(*dependent));
        self.is_open(node) && self.get(node).is_some_and(|held| held.holders == 0 && !is_awaited(held))
    }

    /// Say that the output of a completed node will never be needed again, not even by a run that begins anew from what this one has
    /// left. It has to be released as well.
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

    /// Close an open node: what it reads may go.
    fn close(&mut self, node: NodeId, state: NodeState) {
        let closed = self.at_mut(node);
        let was_ready = closed.state == NodeState::Ready && closed.spec.placement == Placement::Worker;
        closed.state = state;
        self.open -= 1;
        self.ready_for_workers -= usize::from(was_ready);
        // The specification stays where it is while its inputs are looked at.
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

    /// Hand in an output of a node. Any computation of a ready node will do: all of them are equal.
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

    /// Close an open node without an output, and with it every node that waits for it; what only they were waiting for and nobody
    /// holds is cancelled. Does nothing to a closed node.
    pub fn fail(&mut self, node: NodeId, reason: FailureReason) {
        let mut failing = VecDeque::from([(node, reason)]);
        // The inputs of what has failed.
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

    /// The output of a completed node, unless it was let go.
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

    /// How many nodes are ready or running, of those that workers run.
    #[must_use]
    pub fn ready_for_workers(&self) -> usize {
        self.ready_for_workers
    }

    /// The size of all blobs that are kept, in bytes. Looks at every one of them.
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

    /// Whether no node is open and no change is unread: nothing more can happen.
    #[must_use]
    pub fn is_drained(&self) -> bool {
        self.open == 0 && self.changes.is_empty()
    }

    fn input_failed(&self, node: NodeId) -> FailureReason {
        let label = self.spec(node).map(|spec| spec.label.clone()).unwrap_or_default();
        FailureReason::InputFailed { node, label }
    }

    fn get(&self, node: NodeId) -> Option<&Node> {
        self.nodes.get(usize::try_from(node.0).ok()?)
    }

    fn get_mut(&mut self, node: NodeId) -> Option<&mut Node> {
        self.nodes.get_mut(usize::try_from(node.0).ok()?)
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
