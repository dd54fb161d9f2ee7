//! Real worker processes: whatever happens to them, the result is that of a run in a single process.

use std::process::Command;
use std::time::{Duration, SystemTime};

use lookalike_coordinator::access::Credentials;
use lookalike_coordinator::events::RunEvent;
use lookalike_coordinator::policy::Policy;
use lookalike_coordinator::reactor::Stop;
use lookalike_coordinator::runner::{RunError, RunnerOptions};
use lookalike_coordinator::spawn::WorkerCommand;
use lookalike_tests::cluster::{Cluster, options, policy};
use lookalike_tests::gate::{Gate, Waiting};
use lookalike_tests::plan::{Leaves, TestPlanner};
use lookalike_tests::process::{Process, signal, stderr};

const PROGRAM: &str = env!("CARGO_BIN_EXE_lookalike-test-cluster");
const WORKER: &str = env!("CARGO_BIN_EXE_lookalike-worker-under-test");

fn gates(gate: &Gate, count: usize) -> Leaves {
    Leaves::Gates { count, address: gate.address().to_string() }
}

/// The result of a plan of gates; a gate has the same output in any run.
fn gates_reference(count: usize) -> Option<Vec<u8>> {
    let gate = Gate::new();
    let leaves = gates(&gate, count);
    let keeper = std::thread::spawn(move || (0..count).for_each(|_| gate.next().release()));
    let reference = TestPlanner::reference(leaves);
    keeper.join().expect("every gate is passed");
    reference
}

fn local_listener() -> RunnerOptions {
    RunnerOptions { listen: Some(([127, 0, 0, 1], 0).into()), ..options(PROGRAM, 0) }
}

fn worker(cluster: &Cluster) -> Process {
    Process::start(Command::new(PROGRAM).args(["worker", "--threads", "1", "--access"]).arg(cluster.access_file()))
}

fn wait_for_deaths(workers: [Waiting; 2]) {
    workers.into_iter().for_each(Waiting::wait_for_death);
}

#[test]
fn one_two_and_five_workers_give_the_bytes_of_a_single_process() {
    let leaves = Leaves::Digests { count: 21, shared_bytes: 300_000 };
    let reference = TestPlanner::reference(leaves.clone());
    for workers in [1, 2, 5] {
        let (result, summary) = Cluster::start(leaves.clone(), options(PROGRAM, workers)).finish();
        assert_eq!(result, reference, "{workers} workers");
        assert_eq!(summary.completed_nodes, 23);
    }
}

#[test]
fn large_blob_is_sent_once_per_worker_and_large_outputs_are_returned() {
    // More than one frame, and not a multiple of a part.
    let leaves = Leaves::Large { bytes: 20_000_001 };
    let (result, summary) = Cluster::start(leaves.clone(), options(PROGRAM, 1)).finish();
    assert_eq!(result, TestPlanner::reference(leaves));
    // The blob, and the digest computed by the coordinator.
    assert_eq!((summary.blobs_sent, summary.blob_bytes_sent), (2, 20_000_001 + 32));
    assert_eq!(summary.output_bytes_received, 2 * 20_000_001 + 32);
}

#[test]
fn worker_killed_while_executing_is_restarted_and_its_node_is_rerun() {
    let gate = Gate::new();
    let cluster = Cluster::start(gates(&gate, 1), options(PROGRAM, 1));
    let first = gate.next();
    let killed = first.process();
    signal(killed, "KILL");
    first.wait_for_death();
    let status = cluster.wait_for(|event| match event {
        RunEvent::LocalWorkerEnded { process, status, restart_after: Some(_) } if *process == killed => {
            Some(status.clone())
        }
        _ => None,
    });
    assert!(status.contains("SIGKILL"), "{status}");
    let second = gate.next();
    assert_ne!(second.process(), killed);
    second.release();
    let (result, summary) = cluster.finish();
    assert_eq!(result, gates_reference(1));
    assert_eq!((summary.requeued_nodes, summary.workers_joined), (1, 2));
}

#[test]
fn node_that_aborts_its_process_once_succeeds_elsewhere() {
    let folder = tempfile::tempdir().unwrap();
    let marker = folder.path().join("marker").to_string_lossy().into_owned();
    let leaves = Leaves::Abort { marker };
    let (result, summary) = Cluster::start(leaves.clone(), options(PROGRAM, 2)).finish();
    assert_eq!(result, TestPlanner::reference(leaves));
    assert_eq!(summary.requeued_nodes, 1);
}

#[test]
fn node_that_always_aborts_its_process_fails_and_is_named() {
    let error = Cluster::start(Leaves::Abort { marker: String::new() }, options(PROGRAM, 2)).error();
    let message = error.to_string();
    assert!(message.starts_with("abort \"leaf 0\" failed: 3 worker processes died"), "{message}");
    assert_eq!(error.exit_code(), 3);
}

#[test]
fn application_error_ends_the_run_names_the_node_and_is_not_retried() {
    let leaves = Leaves::Fail { message: "the photo is black".into() };
    let (events, outcome) = Cluster::start(leaves, options(PROGRAM, 2)).outcome();
    let error = outcome.unwrap_err();
    assert_eq!(error.to_string(), "fail \"leaf 0\" failed: the photo is black");
    assert_eq!(error.exit_code(), 2);
    assert_eq!(events.iter().filter(|event| matches!(event, RunEvent::NodeStarted { .. })).count(), 1);
}

#[test]
fn panic_and_unknown_kind_are_reported_as_bugs_not_as_bad_input() {
    let cases = [
        (Leaves::Panic, "panic \"leaf 0\" failed: it panicked: asked to panic; this is a bug in lookalike"),
        (Leaves::Unknown, "nonsense \"leaf 0\" failed: unknown node kind \"nonsense\""),
    ];
    for (leaves, expected) in cases {
        let error = Cluster::start(leaves, options(PROGRAM, 1)).error();
        let message = error.to_string();
        assert!(message.starts_with(expected) && message.contains("a bug in lookalike"), "{message}");
        assert_eq!(error.exit_code(), 3);
    }
}

#[test]
fn progress_of_a_node_in_the_coordinators_process_is_reported_while_it_runs() {
    let gate = Gate::new();
    let leaves = Leaves::GateHere { address: gate.address().to_string() };
    let cluster = Cluster::start(leaves, options(PROGRAM, 1));
    let waiting = gate.next();
    assert_eq!(waiting.process(), std::process::id());
    let told = cluster.wait_for(|event| match event {
        RunEvent::NodeProgress { permille, .. } => Some(*permille),
        _ => None,
    });
    assert_eq!(told, 250);
    waiting.release();
    assert!(cluster.finish().0.is_some());
}

#[test]
fn remote_workers_join_and_end_with_the_run() {
    let gate = Gate::new();
    let cluster = Cluster::start(gates(&gate, 2), local_listener());
    cluster.address();
    let workers = [worker(&cluster), worker(&cluster)];
    // Each worker executes one node at a time, so two nodes at the gate need both.
    let waiting = [gate.next(), gate.next()];
    assert_ne!(waiting[0].process(), waiting[1].process());
    waiting.into_iter().for_each(Waiting::release);
    let (result, summary) = cluster.finish();
    assert_eq!((result, summary.workers_joined), (gates_reference(2), 2));
    for worker in workers {
        let output = worker.output();
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    }
}

#[test]
fn run_without_workers_ends_with_an_error() {
    let policy =
        Policy { wait_for_workers: Duration::from_millis(300), remind_every: Duration::from_millis(100), ..policy() };
    let leaves = Leaves::Digests { count: 1, shared_bytes: 1 };
    let (events, outcome) = Cluster::start(leaves, RunnerOptions { policy, ..local_listener() }).outcome();
    let error = outcome.unwrap_err();
    assert!(matches!(error, RunError::Stop(Stop::NoWorkerCame { .. })), "{error}");
    assert_eq!(error.exit_code(), 3);
    assert!(events.iter().any(|event| matches!(event, RunEvent::WaitingForWorkers { .. })), "{events:?}");
}

#[test]
fn worker_program_that_cannot_start_is_an_error_at_once() {
    let leaves = Leaves::Digests { count: 1, shared_bytes: 1 };
    let with = |program: &str, argument: &str| {
        let command = WorkerCommand { program: program.into(), arguments: vec!["worker".into(), argument.into()] };
        let options = RunnerOptions { worker_command: Some(command), ..options(PROGRAM, 2) };
        Cluster::start(leaves.clone(), options).error()
    };
    let missing = with("/nonexistent/lookalike", "");
    assert!(matches!(missing, RunError::Spawn(_)), "{missing}");
    let unusable = with(PROGRAM, "--no-such-flag");
    assert!(unusable.to_string().contains("keep dying, the last one with exit status: 2"), "{unusable}");
}

/// A coordinator process with two workers, each executing a node.
fn coordinator_at_work(gate: &Gate, folder: &tempfile::TempDir) -> Process {
    let access = folder.path().join("access.json");
    let arguments = ["gates", "2", &gate.address().to_string(), "2"].map(str::to_owned);
    Process::start(Command::new(PROGRAM).args(arguments).arg(access))
}

#[test]
fn killed_coordinator_leaves_no_worker_behind() {
    let (gate, folder) = (Gate::new(), tempfile::tempdir().unwrap());
    let coordinator = coordinator_at_work(&gate, &folder);
    let workers = [gate.next(), gate.next()];
    signal(coordinator.id(), "KILL");
    wait_for_deaths(workers);
}

#[test]
fn interrupted_coordinator_ends_its_workers_and_reports_it() {
    for name in ["INT", "TERM"] {
        let (gate, folder) = (Gate::new(), tempfile::tempdir().unwrap());
        let coordinator = coordinator_at_work(&gate, &folder);
        let workers = [gate.next(), gate.next()];
        signal(coordinator.id(), name);
        let output = coordinator.output();
        assert_eq!(output.status.code(), Some(130), "{}", stderr(&output));
        assert!(stderr(&output).contains("error: interrupted"), "{}", stderr(&output));
        wait_for_deaths(workers);
    }
}

#[test]
fn worker_without_a_coordinator_gives_up_and_names_the_address() {
    let folder = tempfile::tempdir().unwrap();
    let access = folder.path().join("access.json");
    // A port where no process listens any more.
    let address = Gate::new().address().to_string();
    Credentials::new(address, SystemTime::now()).unwrap().write(&access).unwrap();
    let output =
        Process::start(Command::new(WORKER).args(["--reconnect-for", "300ms", "--access"]).arg(&access)).output();
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    assert!(stderr(&output).contains("gave up on the coordinator at 127.0.0.1:"), "{}", stderr(&output));
}

#[test]
fn worker_with_bad_usage_or_files_exits_with_two() {
    let folder = tempfile::tempdir().unwrap();
    let broken = folder.path().join("broken.json");
    std::fs::write(&broken, "{}").unwrap();
    let missing = folder.path().join("missing.json");
    for (file, expected) in [(&broken, "is not usable"), (&missing, "cannot read the access file")] {
        let output = Process::start(Command::new(WORKER).arg("--access").arg(file)).output();
        assert_eq!(output.status.code(), Some(2));
        assert!(stderr(&output).contains(expected), "{}", stderr(&output));
    }
    for (flag, value) in [("--threads", "0"), ("--reconnect-for", "soon"), ("--log", "worker=loud")] {
        let output = Process::start(Command::new(WORKER).args([flag, value, "--access", "x"])).output();
        assert_eq!(output.status.code(), Some(2), "{flag} {value}");
        assert!(stderr(&output).contains(flag), "{}", stderr(&output));
    }
}
