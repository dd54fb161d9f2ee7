//! Replayed sessions, and workers that answer for other workers or other epochs, or send far too much.

use std::io::Write;
use std::process::Command;
use std::thread::available_parallelism;
use std::time::Duration;

use lookalike::graph::BlobHash;
use lookalike::protocol::{Executing, FailureKind, FrameTag, Hello, LeaseName, ToCoordinator, ToWorker};
use lookalike_coordinator::events::{Departure, RunEvent};
use lookalike_coordinator::limits::Limits;
use lookalike_coordinator::policy::Policy;
use lookalike_coordinator::reactor::Stop;
use lookalike_coordinator::runner::{RunError, RunnerOptions};
use lookalike_tests::cluster::{Cluster, options, policy, read_access};
use lookalike_tests::gate::{Gate, Waiting};
use lookalike_tests::journal::JournalView;
use lookalike_tests::plan::{Leaves, TestPlanner};
use lookalike_tests::process::{Process, stderr};
use lookalike_tests::proxy::Proxy;
use lookalike_tests::raw_peer::{
    TlsClient, connect, connect_tls, greet, hear, hello, join, read_to_the_end, say, say_frame,
};

use super::{PROGRAM, run_at_the_gate, run_within, worker};

/// Report this output of a node.
fn claim(false_worker: &mut TlsClient, lease: LeaseName, output: &[u8]) {
    let (hash, length) = (BlobHash::of(output).0, output.len() as u64);
    say(false_worker, &ToCoordinator::Finished { lease, hash, length });
    say_frame(false_worker, FrameTag::Part, output);
}

#[test]
fn replayed_session_is_not_admitted() {
    let gate = Gate::new();
    let cluster = run_within(&gate, 0, Limits::default());
    let address = cluster.access().address;
    let proxy = Proxy::to(&address);
    let mut command = Command::new(PROGRAM);
    command.args(["worker", "--threads", "1", "--address", &proxy.address(), "--access"]);
    let worker = Process::start(command.arg(cluster.access_file()));
    let waiting = gate.next();
    let record = proxy.record();
    assert!(record.len() > 400, "{} bytes of a session", record.len());
    for cut in [record.len(), record.len() / 2] {
        let mut again = connect(&address).unwrap();
        // The connection may be closed before all is sent.
        let _ = again.write_all(&record[..cut]);
        let _ = again.shutdown(std::net::Shutdown::Write);
        let _ = read_to_the_end(again);
    }
    waiting.release();
    let (result, summary) = cluster.finish();
    assert!(result.is_some());
    assert_eq!(summary.workers_joined, 1);
    assert_eq!(worker.output().status.code(), Some(0));
}

#[test]
fn false_result_for_the_node_of_another_worker_is_detected_by_verification() {
    let gate = Gate::new();
    let policy = Policy { verify_fraction: 1.0, ..policy() };
    let leaves = Leaves::Gates { count: 1, address: gate.address().to_string() };
    let listen = Some(([127, 0, 0, 1], 0).into());
    let cluster = Cluster::start(leaves, RunnerOptions { listen, policy, ..options(PROGRAM, 1) });
    let waiting = gate.next();
    let mut false_worker = join(&cluster.access(), 1);
    let name = LeaseName { node: 0, attempt: 1, epoch: 1 };
    claim(&mut false_worker, name, b"not passed");
    hear(&mut false_worker, |message| (message == ToWorker::Acknowledge(name)).then_some(()));
    waiting.release();
    let error = cluster.error();
    assert!(matches!(error, RunError::Stop(Stop::ResultsDiffer { .. })), "{error}");
}

#[test]
fn differing_second_result_ends_the_run_and_the_node_is_rerun_on_resume() {
    let (gate, folder) = (Gate::new(), tempfile::tempdir().unwrap());
    let access = folder.path().join("access.json");
    let coordinator = || {
        let arguments = ["resume", "5", &gate.address().to_string(), "1"].map(str::to_owned);
        Process::start(Command::new(PROGRAM).args(arguments).arg(&access))
    };
    let first = coordinator();
    gate.next().release();
    // The false worker answers for a node whose output is in the journal.
    let journal = JournalView::of(folder.path());
    let node = loop {
        let known = "SELECT node FROM node_list JOIN results ON lower(hex(results.key)) = node_list.key";
        if let Some(node) = journal.column::<u64>(known).first() {
            break *node;
        }
        std::thread::sleep(Duration::from_millis(20));
    };
    drop(journal);
    let mut false_worker = join(&read_access(&access), 1);
    claim(&mut false_worker, LeaseName { node, attempt: 1, epoch: 1 }, b"not passed");
    let output = first.output();
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    let expected = format!("two results of gate \"leaf {node}\" differ");
    assert!(stderr(&output).contains(&expected), "{}", stderr(&output));
    drop(false_worker);
    let second = coordinator();
    let keeper = gate.keep(Waiting::release);
    let output = second.output();
    keeper.stop();
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let gate = Gate::new();
    let leaves = Leaves::Gates { count: 5, address: gate.address().to_string() };
    let keeper = gate.keep(Waiting::release);
    let reference = TestPlanner::reference(leaves);
    keeper.stop();
    assert_eq!(String::from_utf8_lossy(&output.stdout), format!("{reference:?}\n"));
}

#[test]
fn result_for_a_lease_of_an_earlier_epoch_is_a_violation() {
    let (gate, folder) = (Gate::new(), tempfile::tempdir().unwrap());
    let access = folder.path().join("access.json");
    let coordinator = || {
        let arguments = ["resume", "2", &gate.address().to_string(), "1"].map(str::to_owned);
        Process::start(Command::new(PROGRAM).args(arguments).arg(&access))
    };
    let first = coordinator();
    // The local worker has a thread for each core; both of its connections must be gone before the next one is looked at.
    let threads = available_parallelism().map_or(1, usize::from);
    let waiting: Vec<Waiting> = (0..threads.min(2)).map(|_| gate.next()).collect();
    first.kill();
    waiting.into_iter().for_each(Waiting::wait_for_death);
    let second = coordinator();
    let waiting = gate.next();
    let mut false_worker = join(&read_access(&access), 1);
    claim(&mut false_worker, LeaseName { node: 0, attempt: 1, epoch: 1 }, b"not passed");
    let _ = read_to_the_end(false_worker);
    waiting.release();
    gate.next().release();
    let output = second.output();
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let journal = JournalView::of(folder.path());
    let why: Vec<String> = journal.column("SELECT why FROM workers WHERE epoch = 2 AND why LIKE '%protocol%'");
    assert!(why.iter().any(|why| why.contains("one of epoch 1 in epoch 2")), "{why:?}");
}

#[test]
fn result_for_a_lease_of_another_epoch_is_a_violation() {
    let gate = Gate::new();
    let cluster = run_at_the_gate(&gate);
    let waiting = gate.next();
    for epoch in [0, 2, u64::MAX] {
        let mut false_worker = join(&cluster.access(), 1);
        claim(&mut false_worker, LeaseName { node: 0, attempt: 1, epoch }, b"not passed");
        let departure = cluster.wait_for(|event| match event {
            RunEvent::WorkerLeft { departure, .. } => Some(departure.clone()),
            _ => None,
        });
        assert!(matches!(departure, Departure::Violation(_)), "{departure:?}");
    }
    waiting.release();
    assert!(cluster.finish().0.is_some());
}

#[test]
fn worker_that_floods_its_coordinator_does_not_block_other_workers() {
    let gate = Gate::new();
    let cluster = run_at_the_gate(&gate);
    let waiting = gate.next();
    let mut false_worker = join(&cluster.access(), 1);
    let lease = LeaseName { node: 7, attempt: 1, epoch: 1 };
    let beat = ToCoordinator::Heartbeat { executing: vec![Executing { lease, permille: u16::MAX }; 1000] };
    for _ in 0..200 {
        say(&mut false_worker, &beat);
        say(&mut false_worker, &ToCoordinator::Started(lease));
    }
    let empty = ToCoordinator::Heartbeat { executing: Vec::new() };
    (0..10_000).for_each(|_| say(&mut false_worker, &empty));
    // Despite these messages, a worker on another connection joins without delay.
    let honest = worker(&cluster.access_file());
    let joined = |event: &RunEvent| matches!(event, RunEvent::WorkerJoined { threads: 1, .. }).then_some(());
    (0..2).for_each(|_| cluster.wait_for(joined));
    waiting.release();
    let (result, summary) = cluster.finish();
    assert!(result.is_some());
    assert_eq!((summary.workers_joined, summary.requeued_nodes), (3, 0), "{summary:?}");
    assert_eq!(honest.output().status.code(), Some(0));
}

#[test]
fn oversized_hello_is_truncated() {
    let gate = Gate::new();
    let cluster = run_at_the_gate(&gate);
    let waiting = gate.next();
    let access = cluster.access();
    // A hello about as long as a frame may be, from a worker that reports 2^32 - 1 threads.
    let mut loud = connect_tls(&access).unwrap();
    greet(&mut loud, &access.secret, |_| {}).unwrap();
    let build = "x".repeat(2_000_000);
    say(&mut loud, &ToCoordinator::Hello(Hello { build, process: u32::MAX, ..hello(u32::MAX) }));
    let joined = cluster.wait_for(|event| match event {
        RunEvent::WorkerJoined { threads, process: u32::MAX, .. } => Some(*threads),
        _ => None,
    });
    assert!(joined <= 4096, "{joined} threads");
    drop(loud);
    // Wait until it has left, so that it is assigned no node.
    cluster.wait_for(|event| matches!(event, RunEvent::WorkerLeft { .. }).then_some(()));
    waiting.release();
    assert!(cluster.finish().0.is_some());
}

#[test]
fn oversized_error_message_is_truncated() {
    let listen = Some(([127, 0, 0, 1], 0).into());
    let policy = Policy { grace: Duration::from_secs(5), ..policy() };
    let leaves = Leaves::Digests { count: 1, shared_bytes: 1 };
    let cluster = Cluster::start(leaves, RunnerOptions { listen, policy, ..options(PROGRAM, 0) });
    cluster.address();
    let mut false_worker = join(&cluster.access(), 1);
    let lease = hear(&mut false_worker, |message| match message {
        ToWorker::Assign(assignment) => Some(assignment.lease),
        _ => None,
    });
    let message = "x".repeat(2_000_000);
    say(&mut false_worker, &ToCoordinator::Failed { lease, kind: FailureKind::Application, message });
    let text = cluster.error().to_string();
    assert!(text.contains("xxx") && text.len() < 20_000, "{} bytes", text.len());
}
