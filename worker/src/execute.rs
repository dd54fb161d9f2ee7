//! Executes jobs on the compute pool.

use std::sync::Arc;

use lookalike::graph::{Blob, DecodedCache, NodeFailure, Registry, RunContext};
use tokio::sync::mpsc::UnboundedSender;

use crate::world::Pool;

/// One execution of one node, with everything that it needs.
#[derive(Debug)]
pub(crate) struct Job {
    /// Identifies this execution within the process.
    pub(crate) serial: u64,
    pub(crate) kind: String,
    pub(crate) parameters: Vec<u8>,
    pub(crate) inputs: Vec<Blob>,
    pub(crate) context: RunContext,
}

/// An execution that has ended.
#[derive(Debug)]
pub(crate) struct Completed {
    pub(crate) serial: u64,
    pub(crate) result: Result<Blob, NodeFailure>,
}

/// Runs jobs on a pool.
#[derive(Debug)]
pub(crate) struct Executor<P> {
    pool: P,
    registry: Arc<Registry>,
    decoded: Arc<DecodedCache>,
    completed: UnboundedSender<Completed>,
}

impl<P: Pool> Executor<P> {
    pub(crate) fn new(
        pool: P,
        registry: Registry,
        decoded_bytes: usize,
        completed: UnboundedSender<Completed>,
    ) -> Self {
        Self { pool, registry: Arc::new(registry), decoded: Arc::new(DecodedCache::new(decoded_bytes)), completed }
    }

    /// The context of one execution.
    pub(crate) fn context(&self) -> RunContext {
        RunContext::new(Arc::clone(&self.decoded))
    }

    /// Start to execute a job. Its result is sent to the channel.
    pub(crate) fn start(&self, job: Job) {
        let registry = Arc::clone(&self.registry);
        let completed = self.completed.clone();
        self.pool.spawn(move || {
            let result = registry.run(&job.kind, &job.parameters, &job.inputs, &job.context);
            // The receiver is dropped when the process is about to end.
            let _ = completed.send(Completed { serial: job.serial, result });
        });
    }
}
