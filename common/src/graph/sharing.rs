//! Which planner holds which nodes and blobs, if several planners share a graph. Equal nodes run once, and are released with the last
//! planner that holds them.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use super::{Blob, BlobHash, Graph, Input, NodeId, NodeSpec, Placement, PlanError};

/// The number of a planner among those that share a graph.
pub(super) type PartId = u32;

/// The nodes and blobs of all planners.
#[derive(Debug, Default)]
pub(super) struct Sharing {
    /// Nodes by the hash of everything that determines their output and placement.
    by_key: BTreeMap<BlobHash, NodeId>,
    nodes: BTreeMap<NodeId, Shared>,
    holdings: BTreeMap<PartId, Holdings>,
    /// Nodes that had completed before a planner added them; the planner must still be notified.
    late: VecDeque<(PartId, NodeId)>,
    /// All nodes that planners have ever added, for the planners whose results are not safe yet.
    asked: BTreeMap<PartId, BTreeSet<NodeId>>,
    /// How many of these planners have added a node.
    users: BTreeMap<NodeId, usize>,
}

/// A node that some planner holds.
#[derive(Debug)]
struct Shared {
    key: BlobHash,
    /// The parts that hold it, in the order in which they added it.
    parts: Vec<PartId>,
    /// Whether it has ended and its holders were notified.
    is_notified: bool,
}

/// The nodes and blobs that a planner holds.
#[derive(Debug, Default)]
struct Holdings {
    nodes: BTreeSet<NodeId>,
    blobs: BTreeSet<BlobHash>,
    /// Nodes whose end it was not notified of.
    awaited: BTreeSet<NodeId>,
}

impl Sharing {
    /// The planners to notify of the end of a node. Called once per node.
    pub(super) fn end(&mut self, node: NodeId) -> Vec<PartId> {
        let Some(shared) = self.nodes.get_mut(&node) else { return Vec::new() };
        shared.is_notified = true;
        shared.parts.clone()
    }

    /// A planner to notify of a node that had completed before the planner added it.
    pub(super) fn next_late(&mut self) -> Option<(PartId, NodeId)> {
        self.late.pop_front()
    }

    /// A planner was notified of the end of a node.
    pub(super) fn notified(&mut self, part: PartId, node: NodeId) {
        if let Some(holdings) = self.holdings.get_mut(&part) {
            holdings.awaited.remove(&node);
        }
    }

    /// Whether a planner waits for no node.
    pub(super) fn is_idle(&self, part: PartId) -> bool {
        self.holdings.get(&part).is_none_or(|holdings| holdings.awaited.is_empty())
    }

    /// The result of a planner is safe: the outputs of its nodes are forgotten, except nodes that a planner has added whose result is not
    /// safe yet.
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

    /// Records that a planner adds a node.
    fn ask(&mut self, part: PartId, node: NodeId) {
        if self.asked.entry(part).or_default().insert(node) {
            *self.users.entry(node).or_default() += 1;
        }
    }

    /// Releases everything that a planner holds.
    pub(super) fn release_all(&mut self, part: PartId, graph: &mut Graph) {
        let Some(holdings) = self.holdings.remove(&part) else { return };
        self.late.retain(|(other, _)| *other != part);
        for node in holdings.nodes {
            self.forget(part, node);
            graph.release(node);
        }
        holdings.blobs.into_iter().for_each(|hash| graph.release_blob(hash));
    }

    /// Removes a planner from the holders of a node.
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

    /// The access of a planner; its name is put in front of labels.
    pub(super) fn part<'part>(&'part mut self, part: PartId, name: &'part str) -> PartEdit<'part> {
        PartEdit { sharing: self, part, name }
    }
}

/// Edits a graph on behalf of one planner, and records what the planner holds.
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
        let label = spec.label.clone().in_part(self.name);
        let node = graph.add_node(NodeSpec { label, priority: part, ..spec })?;
        self.sharing.by_key.insert(key, node);
        self.sharing.nodes.insert(node, Shared { key, parts: vec![part], is_notified: false });
        self.sharing.ask(part, node);
        self.holdings().nodes.insert(node);
        self.holdings().awaited.insert(node);
        Ok(node)
    }

    /// Holds the node of this key that another part has added, if its output is still available. A planner that adds two equal nodes gets
    /// two nodes, as it would alone.
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
        if shared.is_notified {
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

/// The hash of everything that determines the output of a node, and of its placement, because two planners may need different ones.
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
