//! Real workers that are stopped, asked to end, or wrong: no node is lost or counted as the cause, and results are those of a run in a
//! single process.

use std::process::Command;
use std::time::Duration;

use lookalike::graph::FailureReason;
use lookalike_coordinator::events::{Departure, RunEvent};
use lookalike_coordinator::policy::{Policy, Speculation};
use lookalike_coordinator::runner::{RunError, RunnerOptions};
use lookalike_tests::cluster::{Cluster, options, policy};
use lookalike_tests::gate::Gate;
use lookalike_tests::plan::{Leaves, TestPlanner};
use lookalike_tests::process::{Process, signal, stderr};

const PROGRAM: &str = env!("CARGO_BIN_EXE_lookalike-test-cluster");

fn gates(gate: &Gate, count: usize) -> Leaves {
    Leaves::Gates { count, address: gate.address().to_string() }
}

/// The result of one gate; a gate has the same output in any run.
fn reference() -> Option<Vec<u8>> {
    let gate = Gate::new();
    let leaves = gates(&gate, 1);
    let keeper = std::thread::spawn(move || gate.next().release());
    let reference = TestPlanner::reference(leaves);
    keeper.join().expect("the gate is passed");
    reference
}

/// A lease that is short for a stopped worker, and long for one that waits for a processor. With speculation, because the last node may
/// be assigned to a worker that is still at the gate and then has to run elsewhere.
fn impatient() -> Policy {
    let speculation = Speculation { after: Duration::from_secs(1), ..Speculation::default() };
    Policy { heartbeat: Duration::from_millis(100), lost_after: Duration::from_secs(3), speculation, ..policy() }
}

fn wait_for_drain(cluster: &Cluster) {
    cluster.wait_for(|event| matches!(event, RunEvent::WorkerDraining { .. }).then_some(()));
}

fn departure(cluster: &Cluster) -> Departure {
    cluster.wait_for(|event| match event {
        RunEvent::WorkerLeft { departure, .. } => Some(departure.clone()),
        _ => None,
    })
}

fn deaths_when_requeued(cluster: &Cluster) -> u32 {
    cluster.wait_for(|event| match event {
        RunEvent::NodeRequeued { crashes, .. } => Some(*crashes),
        _ => None,
    })
}

#[test]
fn stopped_worker_is_lost_after_its_lease() {
    let gate = Gate::new();
    let cluster = Cluster::start(gates(&gate, 1), RunnerOptions { policy: impatient(), ..options(PROGRAM, 2) });
    let first = gate.next();
    signal(first.process(), "STOP");
    let second = gate.next();
    assert_ne!(second.process(), first.process());
    second.release();
    assert_eq!(cluster.finish().0, reference());
    // The run has ended, and the coordinator has killed the stopped process.
    first.wait_for_death();
}

#[test]
fn late_result_of_a_continued_worker_is_accepted() {
    let gate = Gate::new();
    let cluster = Cluster::start(gates(&gate, 1), RunnerOptions { policy: impatient(), ..options(PROGRAM, 2) });
    let first = gate.next();
    signal(first.process(), "STOP");
    assert_eq!(departure(&cluster), Departure::Silent);
    let second = gate.next();
    signal(first.process(), "CONT");
    first.release();
    // The second worker never answers: the first worker's result ends the run.
    let (result, summary) = cluster.finish();
    assert_eq!((result, summary.requeued_nodes), (reference(), 1));
    assert_eq!(summary.workers_joined, 3);
    second.wait_for_death();
}

#[test]
fn worker_asked_to_end_finishes_its_executing_nodes() {
    for name in ["TERM", "INT"] {
        let gate = Gate::new();
        let listen = Some(([127, 0, 0, 1], 0).into());
        let cluster = Cluster::start(gates(&gate, 1), RunnerOptions { listen, ..options(PROGRAM, 0) });
        cluster.address();
        let mut command = Command::new(PROGRAM);
        let worker = Process::start(command.args(["worker", "--threads", "1", "--access"]).arg(cluster.access_file()));
        let waiting = gate.next();
        signal(worker.id(), name);
        wait_for_drain(&cluster);
        waiting.release();
        assert_eq!(departure(&cluster), Departure::Goodbye);
        let output = worker.output();
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        assert!(stderr(&output).contains("asked to end: finishing the nodes being computed"), "{}", stderr(&output));
        // The last node needs another worker.
        let another = Process::start(Command::new(PROGRAM).args(["worker", "--access"]).arg(cluster.access_file()));
        let (result, summary) = cluster.finish();
        assert_eq!((result, summary.requeued_nodes), (reference(), 0));
        assert_eq!(another.output().status.code(), Some(0));
    }
}

#[test]
fn worker_asked_twice_ends_at_once_without_a_crash_counted_for_its_node() {
    let gate = Gate::new();
    let cluster = Cluster::start(gates(&gate, 1), options(PROGRAM, 1));
    let first = gate.next();
    signal(first.process(), "TERM");
    wait_for_drain(&cluster);
    signal(first.process(), "TERM");
    assert_eq!(departure(&cluster), Departure::Goodbye);
    assert_eq!(deaths_when_requeued(&cluster), 0);
    first.wait_for_death();
    gate.next().release();
    assert_eq!(cluster.finish().0, reference());
}

#[test]
fn worker_whose_drain_time_is_over_returns_its_executing_nodes() {
    let gate = Gate::new();
    let policy = Policy { drain_time: Duration::from_millis(300), ..policy() };
    let cluster = Cluster::start(gates(&gate, 1), RunnerOptions { policy, ..options(PROGRAM, 1) });
    let first = gate.next();
    signal(first.process(), "TERM");
    assert_eq!(departure(&cluster), Departure::Goodbye);
    assert_eq!(deaths_when_requeued(&cluster), 0);
    first.wait_for_death();
    gate.next().release();
    assert_eq!(cluster.finish().0, reference());
}

#[test]
fn worker_killed_while_draining_counts_no_crash_for_its_node() {
    let gate = Gate::new();
    let cluster = Cluster::start(gates(&gate, 1), options(PROGRAM, 1));
    let first = gate.next();
    signal(first.process(), "TERM");
    wait_for_drain(&cluster);
    // As Slurm does when the time limit is reached.
    signal(first.process(), "KILL");
    assert_eq!(departure(&cluster), Departure::Lost);
    assert_eq!(deaths_when_requeued(&cluster), 0);
    gate.next().release();
    assert_eq!(cluster.finish().0, reference());
}

#[test]
fn nodes_that_kill_their_workers_fail_and_local_workers_are_restarted() {
    // At least fifteen deaths, more than a local worker that dies by itself may have before it is given up.
    let cluster = Cluster::start(Leaves::Killers { count: 3 }, options(PROGRAM, 1));
    let (events, outcome) = cluster.outcome();
    let (result, summary) = outcome.unwrap();
    assert!(result.is_some());
    let failed: Vec<_> = events
        .iter()
        .filter_map(|event| match event {
            RunEvent::NodeFailed { name, reason } => Some((name.label.to_string(), reason.clone())),
            _ => None,
        })
        .collect();
    assert_eq!((failed.len(), summary.failed_nodes, summary.suspected_nodes), (3, 3, 3));
    assert!(failed.iter().all(|(_, reason)| *reason == FailureReason::Crashed { crashes: 3 }), "{failed:?}");
    assert!(summary.workers_joined >= 16, "{summary:?}");
}

#[test]
fn run_with_all_outputs_verified_gives_the_same_bytes() {
    let leaves = Leaves::Digests { count: 21, shared_bytes: 300_000 };
    let reference = TestPlanner::reference(leaves.clone());
    for workers in [1, 2, 3] {
        let policy = Policy { verify_fraction: 1.0, ..policy() };
        let options = RunnerOptions { policy, ..options(PROGRAM, workers) };
        let (result, summary) = Cluster::start(leaves.clone(), options).finish();
        assert_eq!(result, reference, "{workers} workers");
        // The digests and the last node; the coordinator does not verify its own node.
        assert_eq!((summary.completed_nodes, summary.verified_nodes), (23, 22));
    }
}

#[test]
fn inconsistent_policy_is_refused_before_anything_is_started() {
    let policy = Policy { lost_after: Duration::from_secs(1), ..policy() };
    let error = Cluster::start(Leaves::Panic, RunnerOptions { policy, ..options(PROGRAM, 1) }).error();
    assert!(matches!(error, RunError::Policy(_)), "{error}");
    assert_eq!(error.exit_code(), 2);
}
