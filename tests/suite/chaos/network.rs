//! A worker in a network namespace, and faults of the line to it. Needs root and iproute2; without them the tests print so and pass.

use std::time::Duration;

use lookalike_coordinator::events::{Departure, RunEvent};
use lookalike_coordinator::policy::Policy;
use lookalike_coordinator::runner::RunnerOptions;
use lookalike_tests::cluster::{Cluster, policy};
use lookalike_tests::gate::{Gate, Waiting};
use lookalike_tests::netns::Namespace;
use lookalike_tests::process::Process;

use super::{
    PROGRAM, deaths_when_requeued, departure, gates, gates_reference, run_for_others, wait_for_start, wait_for_worker,
    without_workers, worker_at,
};

/// A worker in a namespace, at the first gate of a run.
struct Scene {
    // Dropped in this order: the processes in the namespace, then the namespace.
    worker: Process,
    waiting: Waiting,
    gate: Gate,
    cluster: Cluster,
    namespace: Namespace,
}

/// `None` where namespaces cannot be created.
fn scene(nodes: usize, lost_after: Duration) -> Option<Scene> {
    let namespace = Namespace::new()?;
    let gate = Gate::at(namespace.control());
    let policy = Policy { heartbeat: Duration::from_millis(100), lost_after, spare_leases: 0, ..policy() };
    let listen = Some((namespace.line(), 0).into());
    let options = RunnerOptions { policy, listen, ..without_workers() };
    let (cluster, _) = run_for_others(gates(&gate, nodes), options);
    let mut command = namespace.command(PROGRAM);
    let worker = Process::start(command.args(["worker", "--threads", "1", "--access"]).arg(cluster.access_file()));
    let waiting = gate.next();
    assert_eq!(waiting.process(), worker.id());
    wait_for_start(&cluster);
    Some(Scene { worker, waiting, gate, cluster, namespace })
}

/// A lease that is short for a worker that cannot be reached, and long for one that waits for a processor.
const SHORT: Duration = Duration::from_secs(3);

#[test]
fn line_cut_for_less_than_the_lease_only_delays_the_result() {
    let Some(Scene { worker, waiting, gate, cluster, namespace }) = scene(1, Duration::from_secs(20)) else { return };
    namespace.cut();
    waiting.release();
    let left = |event: &RunEvent| matches!(event, RunEvent::WorkerLeft { .. } | RunEvent::NodeFinished { .. });
    cluster.assert_none_for(Duration::from_millis(800), left);
    namespace.heal();
    let (result, summary) = cluster.finish();
    assert_eq!(result, gates_reference(1));
    assert_eq!((summary.workers_joined, summary.requeued_nodes), (1, 0));
    assert!(gate.is_deserted());
    assert_eq!(worker.output().status.code(), Some(0));
}

#[test]
fn line_cut_for_longer_than_the_lease_reruns_the_node_and_the_late_result_is_a_duplicate() {
    let Some(Scene { worker, waiting, gate, cluster, namespace }) = scene(3, SHORT) else { return };
    namespace.cut();
    assert_eq!(departure(&cluster), Departure::Silent);
    assert_eq!(deaths_when_requeued(&cluster), 0);
    waiting.release();
    let other = worker_at(&cluster.access_file(), &cluster.access().address);
    gate.next().release();
    let second = gate.next();
    wait_for_start(&cluster);
    wait_for_start(&cluster);
    namespace.heal();
    // The worker detects the dead connection by itself, reconnects, returns its result, and is assigned the third node.
    wait_for_worker(&cluster);
    // No other node has two results yet.
    cluster.wait_for(|event| matches!(event, RunEvent::DuplicateResult { .. }).then_some(()));
    let third = gate.next();
    assert_eq!(third.process(), worker.id());
    let keeper = gate.keep(Waiting::release);
    [second, third].into_iter().for_each(Waiting::release);
    let (result, summary) = cluster.finish();
    keeper.stop();
    assert_eq!(result, gates_reference(3));
    // The third node may have been assigned to the other worker, which may start it before it learns that the node was moved.
    assert!((1..=2).contains(&summary.duplicate_results), "{summary:?}");
    assert_eq!((summary.requeued_nodes, summary.suspected_nodes), (1, 0), "{summary:?}");
    for worker in [worker, other] {
        assert_eq!(worker.output().status.code(), Some(0));
    }
}

#[test]
fn worker_that_can_only_receive_is_lost_and_rejoins() {
    let Some(Scene { worker, waiting, gate, cluster, namespace }) = scene(1, SHORT) else { return };
    namespace.mute();
    assert_eq!(departure(&cluster), Departure::Silent);
    namespace.hear();
    // The worker learns that it was declared lost, reconnects, and continues its executing node.
    wait_for_worker(&cluster);
    wait_for_start(&cluster);
    waiting.release();
    let (result, summary) = cluster.finish();
    assert_eq!(result, gates_reference(1));
    assert_eq!((summary.workers_joined, summary.requeued_nodes, summary.suspected_nodes), (2, 1, 0));
    // The node was not rerun.
    assert!(gate.is_deserted());
    assert_eq!(worker.output().status.code(), Some(0));
}

#[test]
fn worker_that_can_only_send_still_delivers_its_result() {
    let Some(Scene { worker, waiting, gate, cluster, namespace }) = scene(1, Duration::from_secs(20)) else { return };
    namespace.deafen();
    waiting.release();
    cluster.wait_for(|event| matches!(event, RunEvent::NodeFinished { .. }).then_some(()));
    // The acknowledgement and the last node are delayed until the direction works again.
    cluster.assert_none_for(Duration::from_millis(300), |event| matches!(event, RunEvent::WorkerLeft { .. }));
    namespace.hear();
    let (result, summary) = cluster.finish();
    assert_eq!(result, gates_reference(1));
    assert_eq!((summary.workers_joined, summary.requeued_nodes), (1, 0));
    assert!(gate.is_deserted());
    assert_eq!(worker.output().status.code(), Some(0));
}

#[test]
fn machine_that_vanishes_leaves_a_half_open_connection_and_loses_no_node() {
    let Some(Scene { worker, waiting, gate, cluster, namespace }) = scene(1, SHORT) else { return };
    namespace.cut();
    // The coordinator is not told of its end.
    worker.kill();
    waiting.wait_for_death();
    assert_eq!(departure(&cluster), Departure::Silent);
    assert_eq!(deaths_when_requeued(&cluster), 0);
    let other = worker_at(&cluster.access_file(), &cluster.access().address);
    gate.next().release();
    let (result, summary) = cluster.finish();
    assert_eq!(result, gates_reference(1));
    assert_eq!((summary.workers_joined, summary.requeued_nodes), (2, 1));
    assert_eq!(other.output().status.code(), Some(0));
    drop(namespace);
}
