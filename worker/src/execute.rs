//! Jobs to results: the compute pool.

use std::num::NonZeroUsize;
use std::sync::Arc;

use lookalike::graph::{Blob, DecodedCache, NodeFailure, Registry, RunContext};
use rayon::{ThreadPool, ThreadPoolBuilder};
use tokio::sync::mpsc::UnboundedSender;

/// One execution of one node: all it needs.
#[derive(Debug)]
pub(crate) struct Job {
    /// Names this execution within the process.
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

/// Runs jobs on a rayon pool of its own. Dropped, it does not wait for running jobs: they end with the process.
#[derive(Debug)]
pub(crate) struct Executor {
    pool: ThreadPool,
    registry: Arc<Registry>,
    decoded: Arc<DecodedCache>,
    completed: UnboundedSender<Completed>,
}

impl Executor {
    pub(crate) fn new(
        threads: NonZeroUsize,
        registry: Registry,
        decoded_bytes: usize,
        completed: UnboundedSender<Completed>,
    ) -> Result<Self, rayon::ThreadPoolBuildError> {
        let name = |index| format!("compute-{index}");
        let pool = ThreadPoolBuilder::new().num_threads(threads.get()).thread_name(name).build()?;
        Ok(Self { pool, registry: Arc::new(registry), decoded: Arc::new(DecodedCache::new(decoded_bytes)), completed })
    }

    /// The surroundings for one execution.
    pub(crate) fn context(&self) -> RunContext {
        RunContext::new(Arc::clone(&self.decoded))
    }

    /// Begin to execute a job. Its result goes to the channel; its parallel iterators use the pool.
    pub(crate) fn start(&self, job: Job) {
        let registry = Arc::clone(&self.registry);
        let completed = self.completed.clone();
        self.pool.spawn_fifo(move || {
            let result = registry.run(&job.kind, &job.parameters, &job.inputs, &job.context);
            // Nobody listens any more when the process is about to end.
            let _ = completed.send(Completed { serial: job.serial, result });
        });
    }
}
