//! Local worker processes: started with the run, restarted when they die, ended with the run.
//!
//! Each worker has a leash: a pipe to its stdin. A byte in the pipe means that the run is over; its end without a byte means that
//! the coordinator was killed. In both cases the worker ends at once. Each worker is in its own process group, so that Ctrl-C at
//! the terminal reaches only the coordinator, which ends its workers in order.

mod worked;

use std::ffi::OsString;
use std::io;
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::process::{ExitStatus, Stdio};
use std::time::Duration;

use thiserror::Error;
use tokio::io::AsyncWriteExt;
use tokio::process::{Child, ChildStdin, Command};
use tokio::sync::mpsc::Sender;
use tokio::task::JoinSet;
use tokio::time::{Instant, sleep, timeout};
use tokio_util::sync::CancellationToken;
use tracing::{debug, warn};

pub(crate) use self::worked::Worked;
use crate::events::RunEvent;
use crate::reactor::Event;
use crate::rpc::Inbound;

/// The count of quick deaths is reset by a worker that lived this long or has executed a node. (If a node kills its workers,
/// that node eventually fails.)
const HEALTHY_LIFE: Duration = Duration::from_secs(10);
/// A worker is not restarted after this many consecutive quick deaths.
const MAX_QUICK_DEATHS: u32 = 8;
/// The pause after the first death. It doubles with each further one.
const FIRST_PAUSE: Duration = Duration::from_millis(100);
/// The longest pause.
const LONGEST_PAUSE: Duration = Duration::from_secs(5);
/// How long a worker may take to end by itself before it is killed.
const FAREWELL_TIME: Duration = Duration::from_secs(2);
/// How long a local worker tries to reconnect to its coordinator, as an option on its command line.
const RECONNECT_FOR: &str = "60s";
/// Written to the leash when the run is over.
const RUN_IS_OVER: &[u8] = b".";
/// The exit code of a worker for which another attempt would also fail: bad usage, or refused.
const NO_RETRY: i32 = 2;

/// The command that starts a worker process, without the flags that every worker gets.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WorkerCommand {
    /// The program.
    pub program: PathBuf,
    /// Its first arguments, such as `worker`.
    pub arguments: Vec<OsString>,
}

impl WorkerCommand {
    /// This program as a worker: `lookalike worker`.
    ///
    /// # Errors
    /// When the system does not provide the path of this program.
    pub fn this_program() -> io::Result<Self> {
        Ok(Self { program: std::env::current_exe()?, arguments: vec!["worker".into()] })
    }
}

/// A local worker process that cannot be started at all.
#[derive(Debug, Error)]
#[error("cannot start a worker process of {}", program.display())]
pub struct SpawnError {
    /// The program.
    pub program: PathBuf,
    /// The error of the system.
    pub source: io::Error,
}

/// The number of local workers, and how to start them.
#[derive(Clone, Debug)]
pub(crate) struct LocalWorkers {
    pub(crate) count: usize,
    pub(crate) command: WorkerCommand,
    pub(crate) access: PathBuf,
    /// The log filter, as `--log` takes it.
    pub(crate) log: Option<String>,
    /// The coordinator's address as seen from this machine.
    pub(crate) address: String,
    pub(crate) threads: NonZeroUsize,
    /// Whether other workers may join if all local ones are given up.
    pub(crate) others_may_come: bool,
    pub(crate) worked: Worked,
}

/// The threads of each of `workers` workers, so that together they use each core once.
pub(crate) fn threads_per_worker(workers: usize) -> NonZeroUsize {
    let cores = std::thread::available_parallelism().map_or(1, NonZeroUsize::get);
    NonZeroUsize::new(cores / workers.max(1)).unwrap_or(NonZeroUsize::MIN)
}

impl LocalWorkers {
    /// Start the workers. If the program cannot be started at all, this fails at once.
    pub(crate) fn start(&self, inbound: &Sender<Inbound>, stop: &CancellationToken) -> Result<JoinSet<()>, SpawnError> {
        let mut first = Vec::new();
        for _ in 0..self.count {
            let process = self.spawn();
            first.push(process.map_err(|source| SpawnError { program: self.command.program.clone(), source })?);
        }
        let mut given_up = JoinSet::new();
        for process in first {
            given_up.spawn(self.clone().keep_alive(process, inbound.clone(), stop.clone()));
        }
        let mut keeping = JoinSet::new();
        let (inbound, others_may_come) = (inbound.clone(), self.others_may_come);
        if self.count > 0 {
            keeping.spawn(async move { watch(given_up, inbound, others_may_come).await });
        }
        Ok(keeping)
    }

    /// Restart one worker when it dies, until `stop`. Returns how it ended last if it is given up.
    async fn keep_alive(self, first: Process, inbound: Sender<Inbound>, stop: CancellationToken) -> Option<String> {
        let mut quick_deaths = 0;
        let mut next = Ok(first);
        loop {
            let begin = Instant::now();
            let (process, status, is_hopeless) = match next {
                Ok(mut process) => {
                    let started = RunEvent::LocalWorkerStarted { process: process.id };
                    // An error means that the run is over, and `stop` is cancelled.
                    let _ = inbound.send(Inbound::Tell(started)).await;
                    tokio::select! {
                        ended = process.child.wait() => (process.id, describe(&ended), is_hopeless(&ended)),
                        () = stop.cancelled() => {
                            process.end().await;
                            return None;
                        }
                    }
                }
                Err(error) => (0, format!("an error at its start: {error}"), false),
            };
            if !is_hopeless {
                // Its last messages may still be in transit.
                tokio::select! {
                    () = sleep(FIRST_PAUSE) => {}
                    () = stop.cancelled() => return None,
                }
            }
            let was_well = begin.elapsed() >= HEALTHY_LIFE || self.worked.take(process);
            quick_deaths = if was_well { 1 } else { quick_deaths + 1 };
            let give_up = is_hopeless || quick_deaths >= MAX_QUICK_DEATHS;
            let pause = (FIRST_PAUSE * 2_u32.pow(quick_deaths - 1)).min(LONGEST_PAUSE);
            let restart_after = (!give_up).then_some(pause);
            warn!(process, status, ?restart_after, "a local worker ended");
            let event = RunEvent::LocalWorkerEnded { process, status: status.clone(), restart_after };
            if inbound.send(Inbound::Tell(event)).await.is_err() {
                return None;
            }
            if give_up {
                return Some(status);
            }
            tokio::select! {
                () = sleep(pause - FIRST_PAUSE) => next = self.spawn(),
                () = stop.cancelled() => return None,
            }
        }
    }

    fn spawn(&self) -> io::Result<Process> {
        let mut command = Command::new(&self.command.program);
        command.args(&self.command.arguments).arg("--access").arg(&self.access);
        command.args(["--address", &self.address, "--threads", &self.threads.to_string()]);
        command.args(["--reconnect-for", RECONNECT_FOR, "--leash"]);
        if let Some(log) = &self.log {
            command.arg("--log").arg(log);
        }
        // stdout is reserved for results, which a worker does not print.
        command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::inherit()).kill_on_drop(true);
        #[cfg(unix)]
        command.process_group(0);
        let mut child = command.spawn()?;
        // Take the leash out of the child, because waiting for the child would close it.
        let leash = child.stdin.take();
        let id = child.id().unwrap_or(0);
        debug!(process = id, "started a local worker");
        Ok(Process { id, child, leash })
    }
}

/// Send an event once all workers are given up.
async fn watch(mut keepers: JoinSet<Option<String>>, inbound: Sender<Inbound>, others_may_come: bool) {
    let mut last_status = None;
    while let Some(ended) = keepers.join_next().await {
        match ended {
            Ok(Some(status)) => last_status = Some(status),
            // The run is over.
            Ok(None) | Err(_) => return drain(keepers).await,
        }
    }
    if let Some(last_status) = last_status.filter(|_| !others_may_come) {
        // An error means that the run is over.
        let _ = inbound.send(Inbound::Event(Event::LocalWorkersGivenUp { last_status })).await;
    }
}

async fn drain(mut keepers: JoinSet<Option<String>>) {
    while keepers.join_next().await.is_some() {}
}

struct Process {
    id: u32,
    child: Child,
    leash: Option<ChildStdin>,
}

impl Process {
    /// Let the worker end by itself, and kill it if it does not. When this returns, the process has ended.
    async fn end(mut self) {
        if let Some(mut leash) = self.leash.take() {
            // If the worker has ended already, the write fails, which is fine.
            let _ = leash.write_all(RUN_IS_OVER).await;
        }
        if timeout(FAREWELL_TIME, self.child.wait()).await.is_err() {
            warn!(process = self.id, "a local worker did not end in time: killing it");
            // An error means that it has ended meanwhile.
            let _ = self.child.kill().await;
        }
    }
}

fn describe(ended: &io::Result<ExitStatus>) -> String {
    match ended {
        Ok(status) => status.to_string(),
        Err(error) => format!("an unknown status: {error}"),
    }
}

fn is_hopeless(ended: &io::Result<ExitStatus>) -> bool {
    ended.as_ref().is_ok_and(|status| status.code() == Some(NO_RETRY))
}
