//! Runs whose coordinator was killed, and the next coordinator: local workers end with the first one, remote ones join the second, only
//! journalled results count, and the run does not wait for a worker that never returns.

use std::fs;
use std::io::Write;
use std::net::TcpListener;
use std::process::{Command, Output, Stdio};
use std::thread::{available_parallelism, sleep};
use std::time::{Duration, Instant, SystemTime};

use lookalike_coordinator::access::Credentials;
use lookalike_tests::PATIENCE;
use lookalike_tests::cluster::read_access;
use lookalike_tests::gate::{Gate, Waiting};
use lookalike_tests::journal::JournalView;
use lookalike_tests::plan::{Leaves, TestPlanner};
use lookalike_tests::process::{Process, signal, stderr};
use tempfile::TempDir;

const PROGRAM: &str = env!("CARGO_BIN_EXE_lookalike-test-cluster");
const WORKER: &str = env!("CARGO_BIN_EXE_lookalike-worker-under-test");

/// How many nodes wait at the gate in the test of all phases.
const GATES: usize = 4;

/// A run of this many gates with this many local workers, started or resumed.
fn coordinator(gate: &Gate, leaves: usize, workers: usize, folder: &TempDir) -> Process {
    let address = gate.address().to_string();
    let arguments = ["resume", &leaves.to_string(), &address, &workers.to_string()].map(str::to_owned);
    Process::start(Command::new(PROGRAM).args(arguments).arg(folder.path().join("access.json")))
}

/// The output of a resumed run. A run that hangs is killed and fails the test.
fn finish(mut coordinator: Process, what: &str) -> Output {
    let until = Instant::now() + PATIENCE;
    while !coordinator.has_ended() {
        assert!(Instant::now() < until, "{what}: the run hangs: it has not ended after {PATIENCE:?}");
        sleep(Duration::from_millis(20));
    }
    coordinator.output()
}

/// The output printed at the end of a run of this many gates; it does not depend on the gate's address, which is a parameter of the
/// nodes.
fn reference(leaves: usize) -> String {
    let gate = Gate::new();
    let address = gate.address().to_string();
    let keeper = std::thread::spawn(move || (0..leaves).for_each(|_| gate.next().release()));
    let result = TestPlanner::reference(Leaves::Gates { count: leaves, address });
    keeper.join().expect("every gate is passed");
    format!("{result:?}\n")
}

/// Start a run of four gates with `before` workers, kill its coordinator after `passed` gates, resume it with `after` workers.
fn kill_and_resume(passed: usize, before: usize, after: usize, expected: &str) {
    let what = format!("killed after {passed} of {GATES} nodes, {before} workers before and {after} after");
    let (gate, folder) = (Gate::new(), tempfile::tempdir().unwrap());
    let first = coordinator(&gate, GATES, before, &folder);
    (0..passed).for_each(|_| gate.next().release());
    let executing: Vec<Waiting> = (0..before.min(GATES - passed)).map(|_| gate.next()).collect();
    first.kill();
    let access = fs::read(folder.path().join("access.json")).unwrap();
    // Without delay: workers of the first coordinator may still be ending.
    let second = coordinator(&gate, GATES, after, &folder);
    executing.into_iter().for_each(Waiting::wait_for_death);
    let keeper = gate.keep(Waiting::release);
    let output = finish(second, &what);
    keeper.stop();
    assert_eq!(output.status.code(), Some(0), "{what}: {}", stderr(&output));
    assert_eq!(String::from_utf8_lossy(&output.stdout), expected, "{what}");
    assert_eq!(JournalView::of(folder.path()).run_twice(), 0, "{what}");
    assert!(fs::read(folder.path().join("access.json")).unwrap() == access, "{what}");
}

#[test]
fn run_killed_at_every_phase_is_resumed_by_fewer_as_many_and_more_workers() {
    let expected = reference(GATES);
    for passed in 0..GATES {
        for (before, after) in [(3, 1), (2, 2), (1, 3)] {
            kill_and_resume(passed, before, after, &expected);
        }
    }
}

/// A regression in 2 of 8 runs: six workers were executing when their coordinator was killed, and one was started for the next
/// coordinator within seconds. A node stayed reserved for a worker that never returned, and the run waited for ever although a worker was
/// idle.
#[test]
fn run_of_six_workers_resumed_at_once_by_one_assigns_every_ready_node() {
    let expected = reference(6);
    for _ in 0..4 {
        let (gate, folder) = (Gate::new(), tempfile::tempdir().unwrap());
        let first = coordinator(&gate, 6, 6, &folder);
        let executing: Vec<Waiting> = (0..6).map(|_| gate.next()).collect();
        first.kill();
        let second = coordinator(&gate, 6, 1, &folder);
        executing.into_iter().for_each(Waiting::wait_for_death);
        let keeper = gate.keep(Waiting::release);
        let output = finish(second, "six workers, then one");
        keeper.stop();
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        assert_eq!(String::from_utf8_lossy(&output.stdout), expected);
    }
}

#[test]
fn remote_worker_drops_its_nodes_and_joins_the_next_coordinator_as_a_new_member() {
    let (gate, folder) = (Gate::new(), tempfile::tempdir().unwrap());
    // A single local worker has a thread for each core.
    let threads = available_parallelism().map_or(1, usize::from);
    let leaves = threads + 2;
    let first = coordinator(&gate, leaves, 1, &folder);
    let local: Vec<Waiting> = (0..threads).map(|_| gate.next()).collect();
    let mut command = Command::new(PROGRAM);
    let remote = command.args(["worker", "--threads", "2", "--access"]).arg(folder.path().join("access.json"));
    let remote = Process::start(remote);
    let remote_id = remote.id();
    let [finishes, executes] = [gate.next(), gate.next()];
    assert!([&finishes, &executes].iter().all(|waiting| waiting.process() == remote_id));
    first.kill();
    local.into_iter().for_each(Waiting::wait_for_death);
    // The node finishes while there is no coordinator, so its result is not journalled and is lost.
    finishes.release();
    let second = coordinator(&gate, leaves, 1, &folder);
    // The old execution keeps its thread until it ends, so one thread more than those of the local worker executes.
    let waiting: Vec<Waiting> = (0..=threads).map(|_| gate.next()).collect();
    assert_eq!(waiting.iter().filter(|waiting| waiting.process() == remote_id).count(), 1, "the remote worker joined");
    waiting.into_iter().for_each(Waiting::release);
    (threads + 1..leaves).for_each(|_| gate.next().release());
    // Its output is dropped.
    executes.release();
    let output = finish(second, "a remote worker");
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert_eq!(String::from_utf8_lossy(&output.stdout), reference(leaves));
    assert_eq!(remote.output().status.code(), Some(0), "told that the run is over");
    let journal = JournalView::of(folder.path());
    assert_eq!(journal.run_twice(), 0);
    assert_eq!(journal.number("SELECT count(*) FROM node_list WHERE epoch = 2 AND state = 'recalled'"), 0);
    let joined = format!("SELECT count(DISTINCT epoch) FROM workers WHERE process = {remote_id}");
    assert_eq!(journal.number(&joined), 2);
    assert!(gate.is_deserted());
}

#[test]
fn interrupted_coordinator_ends_its_workers_and_is_journalled() {
    for name in ["INT", "TERM"] {
        let (gate, folder) = (Gate::new(), tempfile::tempdir().unwrap());
        let coordinator = coordinator(&gate, 2, 2, &folder);
        let workers = [gate.next(), gate.next()];
        signal(coordinator.id(), name);
        let output = coordinator.output();
        assert_eq!(output.status.code(), Some(130), "{}", stderr(&output));
        workers.into_iter().for_each(Waiting::wait_for_death);
        let ended: Vec<String> = JournalView::of(folder.path()).column("SELECT ended FROM epochs");
        assert_eq!(ended, ["interrupted"]);
    }
}

#[test]
fn occupied_port_is_named_with_a_remedy() {
    let (gate, folder) = (Gate::new(), tempfile::tempdir().unwrap());
    let first = coordinator(&gate, 2, 2, &folder);
    let workers = [gate.next(), gate.next()];
    first.kill();
    workers.into_iter().for_each(Waiting::wait_for_death);
    let address = read_access(&folder.path().join("access.json")).address;
    let squatter = TcpListener::bind(&address).unwrap();
    let refused = coordinator(&gate, 2, 2, &folder).output();
    assert_eq!(refused.status.code(), Some(2), "{}", stderr(&refused));
    let expected = format!("cannot listen on {address}, the address to which the workers of this run connect");
    assert!(stderr(&refused).contains(&expected), "{}", stderr(&refused));
    drop(squatter);
    let second = coordinator(&gate, 2, 2, &folder);
    [gate.next(), gate.next()].into_iter().for_each(Waiting::release);
    assert_eq!(second.output().status.code(), Some(0));
    assert_eq!(read_access(&folder.path().join("access.json")).address, address);
}

#[test]
fn local_worker_ends_with_its_coordinator_and_a_remote_one_tries_to_reconnect() {
    let folder = tempfile::tempdir().unwrap();
    let access = folder.path().join("access.json");
    // A port where no process listens any more.
    let address = Gate::new().address().to_string();
    Credentials::new(address, SystemTime::now()).unwrap().write(&access).unwrap();
    let worker = |arguments: &[&str]| {
        let mut command = Command::new(WORKER);
        command.args(arguments).arg("--access").arg(&access);
        command.stdin(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap()
    };
    let local = ["--reconnect-for", "10min", "--leash"];
    let mut killed = worker(&local);
    drop(killed.stdin.take());
    assert_eq!(killed.wait().unwrap().code(), Some(0));
    let mut told = worker(&local);
    told.stdin.take().unwrap().write_all(b".").unwrap();
    assert_eq!(told.wait().unwrap().code(), Some(0));
    let mut remote = worker(&["--reconnect-for", "300ms"]);
    drop(remote.stdin.take());
    assert_eq!(remote.wait().unwrap().code(), Some(3));
}
