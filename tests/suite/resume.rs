//! Workers that outlive their coordinator, and the next one of the run: what each has in hand is neither lost nor run twice.

use std::fs;
use std::io::Write;
use std::net::TcpListener;
use std::process::{Command, Stdio};
use std::time::SystemTime;

use lookalike_coordinator::access::Credentials;
use lookalike_tests::cluster::read_access;
use lookalike_tests::gate::{Gate, Waiting};
use lookalike_tests::journal::JournalView;
use lookalike_tests::plan::{Leaves, TestPlanner};
use lookalike_tests::process::{Process, signal, stderr};
use tempfile::TempDir;

const PROGRAM: &str = env!("CARGO_BIN_EXE_lookalike-test-cluster");
const WORKER: &str = env!("CARGO_BIN_EXE_lookalike-worker-under-test");

/// A run of so many gates with two workers, begun or gone on with.
fn coordinator(gate: &Gate, leaves: usize, folder: &TempDir) -> Process {
    let arguments = ["resume", &leaves.to_string(), &gate.address().to_string(), "2"].map(str::to_owned);
    Process::start(Command::new(PROGRAM).args(arguments).arg(folder.path().join("access.json")))
}

/// What the program prints at the end of a run of so many gates: the address of the gate is part of the nodes, not of their outputs.
fn reference(leaves: usize) -> String {
    let gate = Gate::new();
    let address = gate.address().to_string();
    let keeper = std::thread::spawn(move || (0..leaves).for_each(|_| gate.next().release()));
    let result = TestPlanner::reference(Leaves::Gates { count: leaves, address });
    keeper.join().expect("every gate is passed");
    format!("{result:?}\n")
}

#[test]
fn survivors_bring_what_they_have_finished_and_go_on_with_what_they_have_in_hand() {
    let (gate, folder) = (Gate::new(), tempfile::tempdir().unwrap());
    let first = coordinator(&gate, 3, &folder);
    let [finishes, goes_on] = [gate.next(), gate.next()];
    let survivors = [finishes.process(), goes_on.process()];
    first.kill();
    let access = fs::read(folder.path().join("access.json")).unwrap();
    // Finished while there is no coordinator.
    finishes.release();
    let second = coordinator(&gate, 3, &folder);
    let last = gate.next();
    assert!(survivors.contains(&last.process()), "a new worker was started though both had survived");
    goes_on.release();
    last.release();
    let output = second.output();
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert_eq!(String::from_utf8_lossy(&output.stdout), reference(3));
    // Three nodes, three executions, two coordinators.
    assert!(gate.is_deserted());
    let journal = JournalView::of(folder.path());
    assert_eq!(journal.number("SELECT count(*) FROM local_workers WHERE epoch = 2"), 0);
    assert!(fs::read(folder.path().join("access.json")).unwrap() == access);
}

#[test]
fn survivor_that_dies_is_replaced_like_any_other_worker() {
    let (gate, folder) = (Gate::new(), tempfile::tempdir().unwrap());
    let first = coordinator(&gate, 2, &folder);
    let [dies, survives] = [gate.next(), gate.next()];
    first.kill();
    let second = coordinator(&gate, 2, &folder);
    survives.release();
    let killed = dies.process();
    signal(killed, "KILL");
    dies.wait_for_death();
    let again = gate.next();
    assert_ne!(again.process(), killed);
    again.release();
    let output = second.output();
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert_eq!(String::from_utf8_lossy(&output.stdout), reference(2));
}

#[test]
fn coordinator_that_ends_in_order_takes_its_workers_with_it_though_they_might_survive() {
    for name in ["INT", "TERM"] {
        let (gate, folder) = (Gate::new(), tempfile::tempdir().unwrap());
        let coordinator = coordinator(&gate, 2, &folder);
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
fn port_that_somebody_else_has_is_named_with_what_to_do() {
    let (gate, folder) = (Gate::new(), tempfile::tempdir().unwrap());
    let first = coordinator(&gate, 2, &folder);
    let workers = [gate.next(), gate.next()];
    first.kill();
    for worker in workers {
        signal(worker.process(), "KILL");
        worker.wait_for_death();
    }
    let address = read_access(&folder.path().join("access.json")).address;
    let squatter = TcpListener::bind(&address).unwrap();
    let refused = coordinator(&gate, 2, &folder).output();
    assert_eq!(refused.status.code(), Some(2), "{}", stderr(&refused));
    let expected = format!("cannot listen on {address}, where the workers of this run look for their coordinator");
    assert!(stderr(&refused).contains(&expected), "{}", stderr(&refused));
    drop(squatter);
    let second = coordinator(&gate, 2, &folder);
    [gate.next(), gate.next()].into_iter().for_each(Waiting::release);
    assert_eq!(second.output().status.code(), Some(0));
    assert_eq!(read_access(&folder.path().join("access.json")).address, address);
}

#[test]
fn worker_whose_coordinator_was_killed_waits_for_another_and_then_gives_up() {
    let folder = tempfile::tempdir().unwrap();
    let access = folder.path().join("access.json");
    // A port where nobody listens any more.
    let address = Gate::new().address().to_string();
    Credentials::new(address, SystemTime::now()).unwrap().write(&access).unwrap();
    let worker = |reconnect_for: &str| {
        let mut command = Command::new(WORKER);
        command.args(["--reconnect-for", reconnect_for, "--leash", "--survive", "--access"]).arg(&access);
        command.stdin(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap()
    };
    let mut killed = worker("300ms");
    drop(killed.stdin.take());
    assert_eq!(killed.wait().unwrap().code(), Some(3));
    // Told that the run is over, it does not wait.
    let mut told = worker("10min");
    told.stdin.take().unwrap().write_all(b".").unwrap();
    assert_eq!(told.wait().unwrap().code(), Some(0));
}
