//! A run on real worker processes whose coordinator is in the test's own process.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use lookalike::protocol::Access;
use lookalike_coordinator::events::RunEvent;
use lookalike_coordinator::policy::{Policy, Speculation};
use lookalike_coordinator::runner::{RunError, RunnerOptions, run};
use lookalike_coordinator::spawn::WorkerCommand;
use lookalike_coordinator::state::RunSummary;
use tempfile::TempDir;

use crate::PATIENCE;
use crate::nodes::registry;
use crate::plan::{Leaves, TestPlanner};

/// The result of a run: the output of its last node and its summary, or its error.
pub type Outcome = Result<(Option<Vec<u8>>, RunSummary), RunError>;

/// A run in progress, in its own thread.
#[derive(Debug)]
pub struct Cluster {
    folder: TempDir,
    events: Receiver<RunEvent>,
    thread: JoinHandle<Outcome>,
}

/// Options for a run with `workers` workers of `program`, which must be `lookalike-test-cluster`. [`Cluster::start`] sets the access
/// file.
#[must_use]
pub fn options(program: &str, workers: usize) -> RunnerOptions {
    let command = WorkerCommand { program: program.into(), arguments: vec!["worker".into()] };
    RunnerOptions {
        worker_command: Some(command),
        handle_signals: false,
        policy: policy(),
        ..RunnerOptions::new(workers, PathBuf::new())
    }
}

/// The default policy without speculation, because a node that a test holds at a gate is not slow.
#[must_use]
pub fn policy() -> Policy {
    let defaults = Policy::default();
    Policy { speculation: Speculation { factor: None, ..defaults.speculation }, ..defaults }
}

impl Cluster {
    /// Start a run.
    ///
    /// # Panics
    /// When there is no temporary folder.
    #[must_use]
    pub fn start(leaves: Leaves, options: RunnerOptions) -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let options = RunnerOptions { access_file: folder.path().join("access.json"), ..options };
        let (sender, events) = channel();
        let thread = std::thread::spawn(move || {
            let runtime = tokio::runtime::Runtime::new().expect("a tokio runtime");
            let observer = move |event: &RunEvent| _ = sender.send(event.clone());
            let outcome = runtime.block_on(run(options, TestPlanner::new(leaves), Arc::new(registry()), observer));
            outcome.map(|(planner, summary)| (planner.result, summary))
        });
        Self { folder, events, thread }
    }

    /// Wait for the first event for which `pick` returns a value.
    ///
    /// # Panics
    /// When no such event comes in time, or the run ends before.
    pub fn wait_for<T>(&self, mut pick: impl FnMut(&RunEvent) -> Option<T>) -> T {
        loop {
            let event = self.events.recv_timeout(PATIENCE).expect("an event in time");
            if let Some(picked) = pick(&event) {
                return picked;
            }
        }
    }

    /// Watch for this duration and check that `pick` accepts no event.
    ///
    /// # Panics
    /// When `pick` accepts an event, or the run ends.
    pub fn assert_none_for(&self, time: Duration, mut pick: impl FnMut(&RunEvent) -> bool) {
        let until = Instant::now() + time;
        loop {
            match self.events.recv_timeout(until.saturating_duration_since(Instant::now())) {
                Ok(event) => assert!(!pick(&event), "{event:?}"),
                Err(RecvTimeoutError::Timeout) => return,
                Err(RecvTimeoutError::Disconnected) => panic!("the run has ended"),
            }
        }
    }

    /// Wait until the coordinator listens, and return its address.
    pub fn address(&self) -> String {
        self.wait_for(|event| match event {
            RunEvent::Listening { address, .. } => Some(address.clone()),
            _ => None,
        })
    }

    /// The path of the access file, which exists once the coordinator listens.
    #[must_use]
    pub fn access_file(&self) -> PathBuf {
        self.folder.path().join("access.json")
    }

    /// The content of the access file.
    ///
    /// # Panics
    /// When it does not exist or is not an access file.
    #[must_use]
    pub fn access(&self) -> Access {
        read_access(&self.access_file())
    }

    /// A folder that exists as long as the cluster.
    #[must_use]
    pub fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// Wait for the end of the run: the events not yet read by [`Self::wait_for`], and the outcome.
    ///
    /// # Panics
    /// When it does not end in time, or its thread panics.
    #[must_use = "the outcome may be an error"]
    pub fn outcome(self) -> (Vec<RunEvent>, Outcome) {
        let mut rest = Vec::new();
        loop {
            match self.events.recv_timeout(PATIENCE) {
                Ok(event) => rest.push(event),
                Err(RecvTimeoutError::Disconnected) => break,
                Err(RecvTimeoutError::Timeout) => panic!("the run does not end: {rest:?}"),
            }
        }
        (rest, self.thread.join().expect("a run that does not panic"))
    }

    /// Wait for the successful end of the run: result and summary.
    ///
    /// # Panics
    /// When the run fails.
    #[must_use]
    pub fn finish(self) -> (Option<Vec<u8>>, RunSummary) {
        let (_, outcome) = self.outcome();
        outcome.expect("a run that succeeds")
    }

    /// Wait for the end of the run and return its error.
    ///
    /// # Panics
    /// When the run succeeds.
    #[must_use]
    pub fn error(self) -> RunError {
        let (_, outcome) = self.outcome();
        outcome.expect_err("a run that fails")
    }
}

/// Read an access file.
///
/// # Panics
/// When it does not exist or is not an access file.
#[must_use]
pub fn read_access(path: &Path) -> Access {
    Access::parse(&std::fs::read_to_string(path).expect("an access file")).expect("a valid access file")
}
