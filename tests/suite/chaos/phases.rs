//! A worker killed at each point of its session; a proxy that stops after a number of bytes determines the point.

use std::time::Duration;

use lookalike_coordinator::events::{Departure, RunEvent};
use lookalike_coordinator::policy::Policy;
use lookalike_coordinator::runner::RunnerOptions;
use lookalike_tests::cluster::{Cluster, policy};
use lookalike_tests::gate::{Gate, Waiting};
use lookalike_tests::plan::{Leaves, TestPlanner};
use lookalike_tests::process::Process;
use lookalike_tests::proxy::{Proxy, Way};

use super::{
    deaths_when_requeued, departure, gates, gates_reference, run_for_others, wait_for_result, wait_for_start,
    wait_for_worker, without_workers, worker_at,
};

/// No heartbeat is sent during a test, so the bytes from the worker are those that the test is about.
fn quiet() -> RunnerOptions {
    let policy = Policy { heartbeat: Duration::from_secs(60), lost_after: Duration::from_secs(300), ..policy() };
    RunnerOptions { policy, ..without_workers() }
}

/// The largest blob of the plans here.
const SHARED_BYTES: usize = 300_000;

#[test]
fn worker_killed_at_any_byte_of_handshake_or_transfer_counts_no_crash() {
    let leaves = Leaves::Digests { count: 3, shared_bytes: SHARED_BYTES };
    let (cluster, address) = run_for_others(leaves.clone(), quiet());
    let proxy = Proxy::to(&address);
    // The worker's TLS hello is more than 200 bytes, and the worker sends 150 more before it requests the blob; the coordinator sends
    // less than 2000 bytes before the blob.
    let up = [0, 1, 100, 200, 250, 300, 350].map(|bytes| (Way::Up, bytes));
    let down = [0, 1, 200, 600, 800, 1000, 2_500, 20_000, 65_536, 150_000, 290_000].map(|bytes| (Way::Down, bytes));
    for (way, bytes) in up.into_iter().chain(down) {
        proxy.heal();
        proxy.allow(way, Some(bytes));
        let worker = worker_at(&cluster.access_file(), &proxy.address());
        let _ = proxy.wait_for_stop(way);
        worker.kill();
        proxy.cut();
    }
    proxy.heal();
    let worker = worker_at(&cluster.access_file(), &proxy.address());
    let (events, outcome) = cluster.outcome();
    let (result, summary) = outcome.unwrap();
    assert_eq!(result, TestPlanner::reference(leaves));
    assert_eq!(worker.output().status.code(), Some(0));
    let blamed = |event: &&RunEvent| matches!(event, RunEvent::NodeRequeued { crashes: 1.., .. });
    assert!(!events.iter().any(|event| blamed(&event)), "{events:?}");
    // Workers that had got as far as the blob held leases.
    assert!(summary.requeued_nodes >= 5, "{summary:?}");
    assert_eq!((summary.suspected_nodes, summary.duplicate_results), (0, 0));
}

/// A run of this many gates, and a worker behind a proxy that waits at the first gate.
fn at_the_gate(gate: &Gate, count: usize, options: RunnerOptions) -> (Cluster, Proxy, Process, Waiting) {
    let (cluster, address) = run_for_others(gates(gate, count), options);
    let proxy = Proxy::to(&address);
    let worker = worker_at(&cluster.access_file(), &proxy.address());
    let waiting = gate.next();
    wait_for_start(&cluster);
    (cluster, proxy, worker, waiting)
}

#[test]
fn node_of_a_killed_worker_is_rerun_unless_its_whole_result_arrived() {
    let gate = Gate::new();
    let (cluster, proxy, worker, waiting) = at_the_gate(&gate, 1, quiet());
    // Killed while it executes.
    worker.kill();
    assert_eq!(departure(&cluster), Departure::Lost);
    assert_eq!(deaths_when_requeued(&cluster), 1);
    waiting.wait_for_death();
    // Killed while its whole result is held back; the result is lost with it.
    let worker = worker_at(&cluster.access_file(), &proxy.address());
    let waiting = gate.next();
    wait_for_start(&cluster);
    proxy.allow(Way::Up, Some(proxy.passed(Way::Up)));
    waiting.release();
    let _ = proxy.wait_for_stop(Way::Up);
    worker.kill();
    proxy.cut();
    assert_eq!(deaths_when_requeued(&cluster), 2);
    // Killed when half of its result has arrived: half a result is never accepted.
    proxy.heal();
    let worker = worker_at(&cluster.access_file(), &proxy.address());
    let waiting = gate.next();
    wait_for_start(&cluster);
    proxy.allow(Way::Up, Some(proxy.passed(Way::Up) + 20));
    waiting.release();
    let _ = proxy.wait_for_stop(Way::Up);
    worker.kill();
    proxy.cut();
    assert_eq!(deaths_when_requeued(&cluster), 3);
    // Killed after its result has arrived.
    proxy.heal();
    let worker = worker_at(&cluster.access_file(), &proxy.address());
    let waiting = gate.next();
    wait_for_start(&cluster);
    // The proxy lets nothing more through to the worker, so it does not execute the last node.
    proxy.allow(Way::Down, Some(proxy.passed(Way::Down)));
    waiting.release();
    assert_eq!(wait_for_result(&cluster), "leaf 0");
    // The last node is assigned to it now.
    assert_eq!(wait_for_result(&cluster), "of all leaves");
    worker.kill();
    proxy.cut();
    assert_eq!(deaths_when_requeued(&cluster), 0);
    proxy.heal();
    let last = worker_at(&cluster.access_file(), &proxy.address());
    let (result, summary) = cluster.finish();
    assert_eq!(result, gates_reference(1));
    assert_eq!((summary.completed_nodes, summary.workers_joined), (3, 5));
    assert!(gate.is_deserted());
    assert_eq!(last.output().status.code(), Some(0));
}

#[test]
fn result_whose_acknowledgement_was_lost_is_resent_and_dropped() {
    let gate = Gate::new();
    let (cluster, proxy, worker, waiting) = at_the_gate(&gate, 2, quiet());
    proxy.allow(Way::Down, Some(proxy.passed(Way::Down)));
    waiting.release();
    wait_for_result(&cluster);
    let second = gate.next();
    let _ = proxy.wait_for_stop(Way::Down);
    proxy.renew();
    wait_for_worker(&cluster);
    // It continues with the second node, which is assigned to it again.
    wait_for_start(&cluster);
    second.release();
    let keeper = gate.keep(Waiting::release);
    let (result, summary) = cluster.finish();
    keeper.stop();
    assert_eq!(result, gates_reference(2));
    assert_eq!(summary.duplicate_results, 1, "{summary:?}");
    assert_eq!(worker.output().status.code(), Some(0));
}

#[test]
fn late_equal_result_after_a_lost_lease_is_dropped() {
    let gate = Gate::new();
    // One lease at a time.
    let policy = Policy {
        heartbeat: Duration::from_millis(100),
        lost_after: Duration::from_secs(3),
        spare_leases: 0,
        ..policy()
    };
    let options = RunnerOptions { policy, ..without_workers() };
    let (cluster, proxy, worker, first) = at_the_gate(&gate, 3, options);
    // The worker and its connection are alive, but no bytes pass.
    proxy.silence();
    assert_eq!(departure(&cluster), Departure::Silent);
    assert_eq!(deaths_when_requeued(&cluster), 0);
    first.release();
    let _ = proxy.wait_for_stop(Way::Up);
    let other = worker_at(&cluster.access_file(), &cluster.access().address);
    gate.next().release();
    assert_eq!(wait_for_result(&cluster), "leaf 0");
    let second = gate.next();
    wait_for_start(&cluster);
    proxy.renew();
    // It returns the first node and then starts the third.
    let third = gate.next();
    wait_for_start(&cluster);
    let keeper = gate.keep(Waiting::release);
    [second, third].into_iter().for_each(Waiting::release);
    let (result, summary) = cluster.finish();
    keeper.stop();
    assert_eq!(result, gates_reference(3));
    assert_eq!((summary.duplicate_results, summary.suspected_nodes), (1, 0), "{summary:?}");
    for worker in [worker, other] {
        assert_eq!(worker.output().status.code(), Some(0));
    }
}
