//! Runs nodes in the coordinator's own process.

use std::collections::BTreeMap;
use std::sync::Arc;

use lookalike::graph::{Blob, DecodedCache, NodeId, NodeSpec, Registry, RunContext};
use lookalike_worker::world::Pool;
use tokio::sync::mpsc::UnboundedSender;

use crate::events::{RunEvent, Site};
use crate::reactor::Event;

/// How many encoded bytes of inputs are kept decoded (128 MiB).
const DECODED_BOUND_BYTES: usize = 128 << 20;

/// The nodes that run in this process, and what they need.
pub(super) struct Here<P> {
    /// Not tokio's blocking threads: parallel iterators use a pool anyway, and a runtime waits for its blocking threads before it
    /// ends, while an interrupted run should not wait for a node.
    pool: P,
    registry: Arc<Registry>,
    decoded: Arc<DecodedCache>,
    /// The context of each running node, for its progress and its cancellation, with the progress that was reported last.
    contexts: BTreeMap<NodeId, (RunContext, u16)>,
    results: UnboundedSender<Event>,
}

impl<P: Pool> Here<P> {
    /// Create the state for nodes whose outputs are sent to `results`.
    pub(super) fn new(pool: P, registry: Arc<Registry>, results: UnboundedSender<Event>) -> Self {
        let decoded = Arc::new(DecodedCache::new(DECODED_BOUND_BYTES));
        Self { pool, registry, decoded, contexts: BTreeMap::new(), results }
    }

    /// Run a node.
    pub(super) fn start(&mut self, node: NodeId, attempt: u32, spec: NodeSpec, inputs: Vec<Blob>) {
        let context = RunContext::new(Arc::clone(&self.decoded));
        self.contexts.insert(node, (context.clone(), 0));
        let (registry, results) = (Arc::clone(&self.registry), self.results.clone());
        self.pool.spawn(move || {
            let site = Site::Coordinator;
            let result = match registry.run(&spec.kind, &spec.parameters, &inputs, &context) {
                Ok(output) => Event::Finished { site, node, attempt, output },
                Err(failure) => Event::Failed { site, node, attempt, failure },
            };
            // An error means that the run is over.
            let _ = results.send(result);
        });
    }

    /// Whether no node is running.
    pub(super) fn is_idle(&self) -> bool {
        self.contexts.is_empty()
    }

    /// Report the progress of nodes where it has changed. (That of nodes on workers arrives with heartbeats.)
    pub(super) fn tell_progress(&mut self, mut observer: impl FnMut(&RunEvent)) {
        for (node, (context, told)) in &mut self.contexts {
            let permille = u16::try_from(context.progress_permille()).unwrap_or(1000);
            if std::mem::replace(told, permille) != permille {
                observer(&RunEvent::NodeProgress { node: *node, permille });
            }
        }
    }

    /// Drop the context of a node that has ended.
    pub(super) fn forget(&mut self, ended: &Event) {
        if let Event::Finished { node, .. } | Event::Failed { node, .. } = ended {
            self.contexts.remove(node);
        }
    }

    /// Ask a node to stop. It still sends an answer.
    pub(super) fn cancel_one(&self, node: NodeId) {
        self.contexts.get(&node).into_iter().for_each(|(context, _)| context.cancel());
    }

    /// Ask all nodes to stop. They still send answers.
    pub(super) fn cancel(&self) {
        self.contexts.values().for_each(|(context, _)| context.cancel());
    }
}
