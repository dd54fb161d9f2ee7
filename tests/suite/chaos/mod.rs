//! Faults of real processes at every moment that can be observed from outside: the result is that of a run in a single process, nothing
//! is lost, and nothing acknowledged is done twice.

mod fits;
mod network;
mod phases;
mod random;
mod random_kills;
mod resume;

use std::path::Path;
use std::process::Command;

use lookalike_coordinator::events::{Departure, RunEvent};
use lookalike_coordinator::runner::RunnerOptions;
use lookalike_tests::cluster::{Cluster, options};
use lookalike_tests::gate::Gate;
use lookalike_tests::plan::{Leaves, TestPlanner};
use lookalike_tests::process::Process;

const PROGRAM: &str = env!("CARGO_BIN_EXE_lookalike-test-cluster");

fn gates(gate: &Gate, count: usize) -> Leaves {
    Leaves::Gates { count, address: gate.address().to_string() }
}

/// The result of a plan of gates; a gate has the same output in any run.
fn gates_reference(count: usize) -> Option<Vec<u8>> {
    let gate = Gate::new();
    let leaves = gates(&gate, count);
    let keeper = gate.keep(|waiting| waiting.release());
    let reference = TestPlanner::reference(leaves);
    keeper.stop();
    reference
}

/// A run without local workers.
fn run_for_others(leaves: Leaves, options: RunnerOptions) -> (Cluster, String) {
    let listen = options.listen.or(Some(([127, 0, 0, 1], 0).into()));
    let cluster = Cluster::start(leaves, RunnerOptions { listen, ..options });
    let address = cluster.address();
    (cluster, address)
}

fn without_workers() -> RunnerOptions {
    options(PROGRAM, 0)
}

/// A worker with one thread that connects to its coordinator at this address.
fn worker_at(access: &Path, address: &str) -> Process {
    let mut command = Command::new(PROGRAM);
    Process::start(command.args(["worker", "--threads", "1", "--address", address, "--access"]).arg(access))
}

fn departure(cluster: &Cluster) -> Departure {
    cluster.wait_for(|event| match event {
        RunEvent::WorkerLeft { departure, .. } => Some(departure.clone()),
        _ => None,
    })
}

/// Wait until a node is re-queued: how many worker deaths are counted for it.
fn deaths_when_requeued(cluster: &Cluster) -> u32 {
    cluster.wait_for(|event| match event {
        RunEvent::NodeRequeued { crashes, .. } => Some(*crashes),
        _ => None,
    })
}

fn wait_for_worker(cluster: &Cluster) {
    cluster.wait_for(|event| matches!(event, RunEvent::WorkerJoined { .. }).then_some(()));
}

fn wait_for_start(cluster: &Cluster) {
    cluster.wait_for(|event| matches!(event, RunEvent::NodeStarted { .. }).then_some(()));
}

/// Wait until a node has its output, and return its label.
fn wait_for_result(cluster: &Cluster) -> String {
    cluster.wait_for(|event| match event {
        RunEvent::NodeFinished { name, .. } => Some(name.label.to_string()),
        _ => None,
    })
}
