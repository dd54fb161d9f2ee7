//! Who holds what, where several planners share a graph: nodes that are the same are run once, and go when the last planner
//! that asked for them has let go of them.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use super::{Blob, BlobHash, Graph, Input, NodeId, NodeSpec, Placement, PlanError, part_label::part_label};

/// The number of a planner among those that share a graph.
pub(super) type PartId = u32;

/// The books of all planners.
#[derive(Debug, Default)]
pub(super) struct Sharing {
    /// Nodes by what decides their output.
    by_key: BTreeMap<BlobHash, NodeId>,
    nodes: BTreeMap<NodeId, Shared>,
    holdings: BTreeMap<PartId, Holdings>,
    /// Nodes that were complete before a planner asked for them: it has to be told.
    late: VecDeque<(PartId, NodeId)>,
    /// Everything that planners whose results are not safe have ever asked for.
    asked: BTreeMap<PartId, BTreeSet<NodeId>>,
    /// How many of these planners have asked for a node.
    users: BTreeMap<NodeId, usize>,
}

/// A node that some planner holds.
#[derive(Debug)]
struct Shared {
    key: BlobHash,
    /// In the order in which they asked for it.
    parts: Vec<PartId>,
    /// Whether its end was told to those who held it then.
    is_told: bool,
}

/// What a planner holds.
#[derive(Debug, Default)]
struct Holdings {
    nodes: BTreeSet<NodeId>,
    blobs: BTreeSet<BlobHash>,
    /// Nodes of whose end it has not been told.
    awaited: BTreeSet<NodeId>,
}

impl Sharing {
    /// The planners that wait for the end of a node, which will not be told again.
    pub(super) fn end(&mut self, node: NodeId) -> Vec<PartId> {
        let Some(shared) = self.nodes.get_mut(&node) else { return Vec::new() };
        shared.is_told = true;
        shared.parts.clone()
    }

    /// A planner that is to be told of the completion of a node that it asked for too late.
    pub(super) fn next_late(&mut self) -> Option<(PartId, NodeId)> {
        self.late.pop_front()
    }

    /// A planner was told of the end of a node.
    pub(super) fn told(&mut self, part: PartId, node: NodeId) {
        if let Some(holdings) = self.holdings.get_mut(&part) {
            holdings.awaited.remove(&node);
        }
    }

    /// Whether a planner waits for nothing any more.
    pub(super) fn is_idle(&self, part: PartId) -> bool {
        self.holdings.get(&part).is_none_or(|holdings| holdings.awaited.is_empty())
    }

    /// What a planner has made of its nodes is safe: nodes that no other one has asked for, or only such whose results are safe too,
    /// are forgotten.
    pub(super) fn settle(&mut self, part: PartId, graph: &mut Graph) {
        for node in self.asked.remove(&part).unwrap_or_default() {
            let Some(users) = self.users.get_mut(&node) else { continue };
            *users -= 1;
            if *users == 0 {
                self.users.remove(&node);
                graph.forget(node);
            }
        }
    }

    /// A planner asks for a node.
    fn ask(&mut self, part: PartId, node: NodeId) {
        if self.asked.entry(part).or_default().insert(node) {
            *self.users.entry(node).or_default() += 1;
        }
    }

    /// A planner needs nothing any more.
    pub(super) fn release_all(&mut self, part: PartId, graph: &mut Graph) {
        let Some(holdings) = self.holdings.remove(&part) else { return };
        self.late.retain(|(other, _)| *other != part);
        for node in holdings.nodes {
            self.forget(part, node);
            graph.release(node);
        }
        holdings.blobs.into_iter().for_each(|hash| graph.release_blob(hash));
    }

    /// Strike a planner off those that hold a node.
    fn forget(&mut self, part: PartId, node: NodeId) {
        let Some(shared) = self.nodes.get_mut(&node) else { return };
        shared.parts.retain(|other| *other != part);
        if !shared.parts.is_empty() {
            return;
        }
        let key = shared.key;
        self.nodes.remove(&node);
        if self.by_key.get(&key) == Some(&node) {
            self.by_key.remove(&key);
        }
    }

    /// An edit on behalf of a planner, whose labels get its name in front.
    pub(super) fn part<'part>(&'part mut self, part: PartId, name: &'part str) -> PartEdit<'part> {
        PartEdit { sharing: self, part, name }
    }
}

/// What edits a graph on behalf of one planner, and keeps the books.
#[derive(Debug)]
pub(super) struct PartEdit<'part> {
    sharing: &'part mut Sharing,
    part: PartId,
    name: &'part str,
}

impl PartEdit<'_> {
    fn holdings(&mut self) -> &mut Holdings {
        self.sharing.holdings.entry(self.part).or_default()
    }

    pub(super) fn keep(&mut self, graph: &mut Graph, blob: Blob) -> Result<BlobHash, PlanError> {
        let hash = blob.hash();
        if self.holdings().blobs.insert(hash) {
            graph.add(blob)?;
        }
        Ok(hash)
    }

    pub(super) fn add_node(&mut self, graph: &mut Graph, spec: NodeSpec) -> Result<NodeId, PlanError> {
        let key = key(&spec);
        let part = self.part;
        if let Some(node) = self.join(graph, key) {
            return Ok(node);
        }
        let label = part_label(self.name, &spec.label);
        let node = graph.add_node(NodeSpec { label, priority: part, ..spec })?;
        self.sharing.by_key.insert(key, node);
        self.sharing.nodes.insert(node, Shared { key, parts: vec![part], is_told: false });
        self.sharing.ask(part, node);
        self.holdings().nodes.insert(node);
        self.holdings().awaited.insert(node);
        Ok(node)
    }

    /// Hold the node of this key that another part has added, if its output can still be had. A planner that adds two equal nodes
    /// gets two, as it would alone.
    fn join(&mut self, graph: &mut Graph, key: BlobHash) -> Option<NodeId> {
        let node = *self.sharing.by_key.get(&key)?;
        if self.holdings().nodes.contains(&node) || !graph.hold(node) {
            return None;
        }
        let part = self.part;
        self.sharing.ask(part, node);
        self.holdings().nodes.insert(node);
        self.holdings().awaited.insert(node);
        let shared = self.sharing.nodes.get_mut(&node)?;
        shared.parts.push(part);
        if shared.is_told {
            self.sharing.late.push_back((part, node));
        }
        Some(node)
    }

    pub(super) fn release(&mut self, graph: &mut Graph, node: NodeId) {
        if self.holdings().nodes.remove(&node) {
            self.holdings().awaited.remove(&node);
            let part = self.part;
            self.sharing.late.retain(|late| *late != (part, node));
            self.sharing.forget(part, node);
            graph.release(node);
        }
    }

    pub(super) fn release_blob(&mut self, graph: &mut Graph, hash: BlobHash) {
        if self.holdings().blobs.remove(&hash) {
            graph.release_blob(hash);
        }
    }
}

/// The name of everything that decides the output of a node, and of its place, for a planner may want it in another.
fn key(spec: &NodeSpec) -> BlobHash {
    let mut hasher = blake3::Hasher::new();
    let mut field = |bytes: &[u8]| {
        hasher.update(&(bytes.len() as u64).to_le_bytes());
        hasher.update(bytes);
    };
    field(spec.kind.as_bytes());
    field(&spec.parameters);
    field(match spec.placement {
        Placement::Worker => b"worker",
        Placement::Coordinator => b"coordinator",
    });
    for input in &spec.inputs {
        match input {
            Input::Blob(hash) => field(&hash.0),
            Input::OutputOf(node) => field(&node.0.to_le_bytes()),
        }
    }
    BlobHash(*hasher.finalize().as_bytes())
}
