//! False peers on either end of a connection: they are not admitted or are disconnected, they cost little, and the run continues.

mod false_results;
mod false_workers;
mod impostors;
mod refusals;
mod secrets;
mod unauthenticated;

use lookalike_coordinator::limits::Limits;
use lookalike_coordinator::runner::RunnerOptions;
use lookalike_tests::cluster::{Cluster, options};
use lookalike_tests::gate::Gate;
use lookalike_tests::plan::Leaves;
use lookalike_tests::process::Process;
use std::path::Path;
use std::process::Command;

const PROGRAM: &str = env!("CARGO_BIN_EXE_lookalike-test-cluster");
const WORKER: &str = env!("CARGO_BIN_EXE_lookalike-worker-under-test");

/// A run whose only node waits at the gate, on a real local worker; other workers may join.
fn run_at_the_gate(gate: &Gate) -> Cluster {
    run_within(gate, 1, Limits::default())
}

/// A run whose only node waits at the gate, with this many local workers.
fn run_within(gate: &Gate, workers: usize, limits: Limits) -> Cluster {
    let leaves = Leaves::Gates { count: 1, address: gate.address().to_string() };
    let listen = Some(([127, 0, 0, 1], 0).into());
    let cluster = Cluster::start(leaves, RunnerOptions { listen, limits, ..options(PROGRAM, workers) });
    cluster.address();
    cluster
}

/// A real worker with the nodes of this suite.
fn worker(access: &Path) -> Process {
    Process::start(Command::new(PROGRAM).args(["worker", "--threads", "1", "--access"]).arg(access))
}
