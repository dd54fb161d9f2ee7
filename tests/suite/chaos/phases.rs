//! A worker's life, and its end at each point of it: a wire that stops after so many bytes says where it is.

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

/// No heartbeat comes in between: what goes up the wire is what the test is about.
fn quiet() -> RunnerOptions {
    let policy = Policy { heartbeat: Duration::from_secs(60), lost_after: Duration::from_secs(300), ..policy() };
    RunnerOptions { policy, ..without_workers() }
}

/// The largest blob of the plans here.
const SHARED_BYTES: usize = 300_000;

#[test]
fn worker_killed_at_any_byte_of_handshake_or_transfer_costs_nothing_and_is_held_against_nobody() {
    let leaves = Leaves::Digests { count: 3, shared_bytes: SHARED_BYTES };
    let (cluster, address) = run_for_others(leaves.clone(), quiet());
    let proxy = Proxy::to(&address);
    // The worker's hello of TLS is more than 200 bytes, and it says 150 more before it asks for the blob; the coordinator says less
    // than 2000 before the blob.
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
    // Those that had got as far as the blob held leases.
    assert!(summary.requeued_nodes >= 5, "{summary:?}");
    assert_eq!((summary.suspected_nodes, summary.duplicate_results), (0, 0));
}

/// A run of so many gates, and a worker on a wire that waits at the first.
fn at_the_gate(gate: &Gate, count: usize, options: RunnerOptions) -> (Cluster, Proxy, Process, Waiting) {
    let (cluster, address) = run_for_others(gates(gate, count), options);
    let proxy = Proxy::to(&address);
    let worker = worker_at(&cluster.access_file(), &proxy.address());
    let waiting = gate.next();
    wait_for_start(&cluster);
    (cluster, proxy, worker, waiting)
}

#[test]
fn worker_killed_before_and_after_its_result_is_on_the_wire_has_its_node_run_again_only_if_nobody_has_it() {
    let gate = Gate::new();
    let (cluster, proxy, worker, waiting) = at_the_gate(&gate, 1, quiet());
    // At work.
    worker.kill();
    assert_eq!(departure(&cluster), Departure::Lost);
    assert_eq!(deaths_when_requeued(&cluster), 1);
    waiting.wait_for_death();
    // Its result is on the wire, and is lost with it.
    let worker = worker_at(&cluster.access_file(), &proxy.address());
    let waiting = gate.next();
    wait_for_start(&cluster);
    proxy.allow(Way::Up, Some(proxy.passed(Way::Up)));
    waiting.release();
    let _ = proxy.wait_for_stop(Way::Up);
    worker.kill();
    proxy.cut();
    assert_eq!(deaths_when_requeued(&cluster), 2);
    // Half of its result has arrived: no half is ever taken for a whole.
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
    // It has arrived.
    proxy.heal();
    let worker = worker_at(&cluster.access_file(), &proxy.address());
    let waiting = gate.next();
    wait_for_start(&cluster);
    // Nothing more reaches it, so it does not run the last node as well.
    proxy.allow(Way::Down, Some(proxy.passed(Way::Down)));
    waiting.release();
    assert_eq!(wait_for_result(&cluster), "leaf 0");
    // With this the last node is given to it.
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
fn result_whose_receipt_was_lost_comes_again_and_is_dropped() {
    let gate = Gate::new();
    let (cluster, proxy, worker, waiting) = at_the_gate(&gate, 2, quiet());
    proxy.allow(Way::Down, Some(proxy.passed(Way::Down)));
    waiting.release();
    wait_for_result(&cluster);
    let second = gate.next();
    let _ = proxy.wait_for_stop(Way::Down);
    proxy.renew();
    wait_for_worker(&cluster);
    // It goes on with the second node, as one that is given to it now.
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
fn worker_cut_off_for_longer_than_its_lease_brings_an_equal_result_later_and_it_is_dropped() {
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
    // It is alive, and so is its connection: nothing comes through.
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
    // It brings the first node, and then begins with the third one.
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
