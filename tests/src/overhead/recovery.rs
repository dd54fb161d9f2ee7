//! How soon a run continues after one of its processes was killed or stopped.

use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use lookalike::graph::{Blob, GraphEdit, NodeId, PlanError, Planner};
use lookalike_coordinator::events::{RunEvent, Site};
use lookalike_coordinator::policy::Policy;
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use serde_json::{Value, json};

use super::planner::node;
use super::run::{drive, options, rounded};
use super::{PAUSE, Result, WORKERS};
use crate::journal::JournalView;

/// The default number of nodes: some seconds of work for two threads.
pub(super) const NODES: usize = 500;

/// How many nodes are done before the fault.
const BEFORE: usize = 50;

/// This many nodes that take a short time each.
struct Pauses(usize);

impl Planner for Pauses {
    fn start(&mut self, graph: &mut GraphEdit<'_>) -> std::result::Result<(), PlanError> {
        (0..self.0 as u64).try_for_each(|number| graph.add_node(node("pause", number)).map(|_| ()))
    }

    fn completed(&mut self, _: NodeId, _: &Blob, _: &mut GraphEdit<'_>) -> std::result::Result<(), PlanError> {
        Ok(())
    }
}

/// Times recorded of a run whose worker is sent a signal.
#[derive(Default)]
struct Seen {
    processes: Vec<u32>,
    finished: usize,
    sent: Option<Instant>,
    left: Option<Duration>,
    requeued: Vec<NodeId>,
    rerun: Option<Duration>,
}

impl Seen {
    fn note(&mut self, event: &RunEvent, signal: Signal) {
        match event {
            RunEvent::WorkerJoined { process, .. } => self.processes.push(*process),
            RunEvent::NodeFinished { .. } => {
                self.finished += 1;
                let victim = self.processes.first().and_then(|process| i32::try_from(*process).ok());
                if let Some(victim) = victim.filter(|_| self.finished >= BEFORE && self.sent.is_none()) {
                    self.sent = Some(Instant::now());
                    // If the process is gone already, the result lacks the fault and shows it.
                    let _ = kill(Pid::from_raw(victim), signal);
                }
            }
            RunEvent::WorkerLeft { .. } => self.left = self.left.or_else(|| Some(self.sent?.elapsed())),
            RunEvent::NodeRequeued { name, .. } => self.requeued.push(name.node),
            RunEvent::NodeStarted { name, site: Site::Worker(_) } if self.requeued.contains(&name.node) => {
                self.rerun = self.rerun.or_else(|| Some(self.sent?.elapsed()));
            }
            _ => {}
        }
    }
}

/// Send a signal to one of two workers in the middle of a run.
pub(super) fn worker_is_sent(name: &str, nodes: usize) -> Result<Value> {
    let signal: Signal = format!("SIG{name}").parse()?;
    let folder = tempfile::tempdir()?;
    let seen = Arc::new(Mutex::new(Seen::default()));
    let observed = Arc::clone(&seen);
    let observer = move |event: &RunEvent| observed.lock().unwrap_or_else(PoisonError::into_inner).note(event, signal);
    let (_, summary) = drive(options(folder.path(), false)?, Pauses(nodes), observer)?;
    let seen = seen.lock().unwrap_or_else(PoisonError::into_inner);
    if signal == Signal::SIGSTOP {
        // A stopped worker cannot be told to end.
        let victim = seen.processes.first().and_then(|process| i32::try_from(*process).ok());
        victim.into_iter().for_each(|victim| _ = kill(Pid::from_raw(victim), Signal::SIGKILL));
    }
    let (Some(left), Some(rerun)) = (seen.left, seen.rerun) else {
        return Err("expected a worker to leave, and its nodes to run elsewhere".into());
    };
    let policy = Policy::default();
    let lost = JournalView::of(folder.path()).number("SELECT count(*) FROM attempts WHERE outcome = 2");
    Ok(json!({
        "measurement": format!("worker-SIG{name}"),
        "noticed_ms": milliseconds(left),
        "noticed_heartbeats": rounded(left.as_secs_f64() / policy.heartbeat.as_secs_f64()),
        "rerun_ms": milliseconds(rerun),
        "nodes": nodes,
        "completed": summary.completed_nodes,
        "leases_lost": lost,
        "finished_nodes_run_twice": finished_twice(folder.path()),
    }))
}

/// How many nodes have finished more than once.
fn finished_twice(folder: &Path) -> u64 {
    JournalView::of(folder).number(
        "SELECT count(*) FROM (SELECT 1 FROM attempts WHERE outcome = 0 GROUP BY epoch, node HAVING count(*) > 1)",
    )
}

/// Kill a coordinator in the middle of its run, and start the next one.
pub(super) fn coordinator_is_killed(nodes: usize) -> Result<Value> {
    let folder = tempfile::tempdir()?;
    let mut first = Coordinator::start(folder.path(), nodes)?;
    first.wait_for("finished", BEFORE)?;
    first.child.kill()?;
    first.child.wait()?;
    let began = Instant::now();
    let mut second = Coordinator::start(folder.path(), nodes)?;
    second.wait_for("joined", WORKERS)?;
    let back = began.elapsed();
    second.wait_for("finished", 1)?;
    let new = began.elapsed();
    // To its end.
    while second.line()?.is_some() {}
    if !second.child.wait()?.success() {
        return Err("expected the second coordinator to complete the run".into());
    }
    let journal = JournalView::of(folder.path());
    let results = journal.number("SELECT count(*) FROM results");
    Ok(json!({
        "measurement": "coordinator-SIGKILL",
        "all_workers_back_ms": milliseconds(back),
        "first_new_result_ms": milliseconds(new),
        "node_ms": milliseconds(PAUSE),
        "nodes": nodes,
        "results": results,
        "finished_before": journal.number("SELECT count(*) FROM results WHERE epoch = 1"),
        "finished_nodes_run_twice": journal.run_twice() + finished_twice(folder.path()),
    }))
}

/// A coordinator in a process of its own, which reports events line by line.
struct Coordinator {
    child: Child,
    lines: BufReader<std::process::ChildStdout>,
}

impl Coordinator {
    fn start(folder: &Path, nodes: usize) -> Result<Self> {
        let mut command = Command::new(std::env::current_exe()?);
        let mut child = command.arg("coordinate").arg(folder).arg(nodes.to_string()).stdout(Stdio::piped()).spawn()?;
        let stdout = child.stdout.take().ok_or("expected a standard output")?;
        Ok(Self { child, lines: BufReader::new(stdout) })
    }

    fn line(&mut self) -> Result<Option<String>> {
        let mut line = String::new();
        Ok((self.lines.read_line(&mut line)? > 0).then(|| line.trim().to_owned()))
    }

    fn wait_for(&mut self, wanted: &str, mut count: usize) -> Result<()> {
        while count > 0 {
            let line = self.line()?.ok_or_else(|| format!("expected {count} more of {wanted:?}, found the end"))?;
            count -= usize::from(line == wanted);
        }
        Ok(())
    }
}

impl Drop for Coordinator {
    fn drop(&mut self) {
        // An error means that it has ended.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Coordinate the run in this folder and print its events.
pub(super) fn coordinate(folder: &Path, nodes: usize) -> Result<()> {
    drive(options(folder, true)?, Pauses(nodes), |event| {
        let word = match event {
            RunEvent::WorkerJoined { .. } => "joined",
            RunEvent::NodeFinished { .. } => "finished",
            _ => return,
        };
        // A write fails when the measurement is over.
        let _ = writeln!(std::io::stdout(), "{word}");
    })?;
    Ok(())
}

fn milliseconds(time: Duration) -> f64 {
    rounded(time.as_secs_f64() * 1e3)
}
