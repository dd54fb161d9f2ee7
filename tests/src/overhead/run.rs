//! The time that nodes without work take.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use lookalike::graph::Planner;
use lookalike_coordinator::events::RunEvent;
use lookalike_coordinator::journal::{JOURNAL_FILE, JournalOptions, RunIdentity};
use lookalike_coordinator::runner::{RunnerOptions, run};
use lookalike_coordinator::spawn::WorkerCommand;
use lookalike_coordinator::state::RunSummary;
use nix::sys::resource::UsageWho;
use serde_json::{Value, json};

use super::planner::{Rounds, cpu_time};
use super::{ROUND, Result, WORKERS, registry};

/// Rounds of nodes that do no work.
pub(super) fn round_trip(rounds: usize) -> Result<Value> {
    let folder = tempfile::tempdir()?;
    let (planner, _) = measure(std::iter::repeat_n(ROUND, rounds.max(1)), folder.path())?;
    let mut took: Vec<f64> = planner.measured.iter().map(|round| round.elapsed.as_secs_f64() * 1e3).collect();
    took.sort_by(f64::total_cmp);
    let at = |percent: usize| took[(took.len() - 1) * percent / 100];
    let cpu: Duration = planner.measured.iter().map(|round| round.cpu).sum();
    Ok(json!({
        "measurement": "round-trip",
        "nodes": ROUND,
        "rounds": took.len(),
        "median_ms": rounded(at(50)),
        "minimum_ms": rounded(at(0)),
        "p99_ms": rounded(at(99)),
        "coordinator_cpu_us_per_node": rounded(micros(cpu, took.len() * ROUND)),
    }))
}

/// Many nodes that do no work.
pub(super) fn throughput(nodes: usize) -> Result<Value> {
    let folder = tempfile::tempdir()?;
    let (planner, summary) = measure([nodes.max(10)], folder.path())?;
    let round = planner.measured.first().ok_or("expected a round to have been measured")?;
    let marks = std::iter::once(&Duration::ZERO).chain(&round.tenths);
    let tenths = marks.zip(&round.tenths).map(|(from, to)| rounded(micros(*to - *from, nodes / 10)));
    let journal = std::fs::metadata(folder.path().join(JOURNAL_FILE))?.len();
    Ok(json!({
        "measurement": "throughput",
        "nodes": nodes,
        "seconds": round.elapsed.as_secs_f64(),
        "nodes_per_second": rounded(nodes as f64 / round.elapsed.as_secs_f64()),
        "tenths_us_per_node": tenths.collect::<Vec<_>>(),
        "coordinator_cpu_us_per_node": rounded(micros(round.cpu, nodes)),
        "workers_cpu_us_per_node": rounded(micros(cpu_time(UsageWho::RUSAGE_CHILDREN), summary.completed_nodes)),
        "coordinator_peak_mib": rounded(peak_kib()? / 1024.0),
        "journal_mib": rounded(journal as f64 / f64::from(1 << 20)),
        "attempts_beyond_one": summary.attempts - summary.completed_nodes as u64,
    }))
}

/// Run rounds of these sizes on real workers.
fn measure(sizes: impl IntoIterator<Item = usize>, folder: &Path) -> Result<(Rounds, RunSummary)> {
    let joined = Arc::new(AtomicUsize::new(0));
    let planner = Rounds::new(sizes, Arc::clone(&joined));
    drive(options(folder, false)?, planner, move |event| {
        if matches!(event, RunEvent::WorkerJoined { .. }) {
            joined.fetch_add(1, Ordering::Relaxed);
        }
    })
}

/// Run a plan in a runtime of its own.
pub(super) fn drive<P: Planner>(
    options: RunnerOptions,
    planner: P,
    observer: impl FnMut(&RunEvent),
) -> Result<(P, RunSummary)> {
    let runtime = tokio::runtime::Runtime::new()?;
    Ok(runtime.block_on(run(options, planner, Arc::new(registry()), observer))?)
}

/// The options of a run in this folder.
pub(super) fn options(folder: &Path, resume: bool) -> Result<RunnerOptions> {
    let command = WorkerCommand { program: std::env::current_exe()?, arguments: vec!["worker".into()] };
    let journal = JournalOptions::new(folder.join(JOURNAL_FILE), RunIdentity::default());
    Ok(RunnerOptions {
        worker_command: Some(command),
        threads_per_worker: Some(std::num::NonZeroUsize::MIN),
        handle_signals: false,
        journal: Some(JournalOptions { resume, ..journal }),
        ..RunnerOptions::new(WORKERS, folder.join("access.json"))
    })
}

fn micros(time: Duration, nodes: usize) -> f64 {
    time.as_secs_f64() * 1e6 / nodes as f64
}

/// Rounded to three decimals: more digits were not measured.
pub(super) fn rounded(value: f64) -> f64 {
    (value * 1e3).round() / 1e3
}

/// The peak memory of this process.
fn peak_kib() -> Result<f64> {
    let status = std::fs::read_to_string("/proc/self/status")?;
    let line =
        status.lines().find_map(|line| line.strip_prefix("VmHWM:")).ok_or("expected VmHWM in /proc/self/status")?;
    Ok(line.trim().trim_end_matches(" kB").parse()?)
}
