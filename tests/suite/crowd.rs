//! Many workers at once: they join, stay members while idle, and share the nodes.

use lookalike_coordinator::events::RunEvent;
use lookalike_coordinator::runner::RunnerOptions;
use lookalike_tests::cluster::{Cluster, options};
use lookalike_tests::gate::Gate;
use lookalike_tests::light::{LightWorkers, allow_sockets};
use lookalike_tests::plan::{Leaves, TestPlanner};
use std::time::{Duration, Instant};

const PROGRAM: &str = env!("CARGO_BIN_EXE_lookalike-test-cluster");

/// The options of a coordinator that starts no workers.
fn listening() -> RunnerOptions {
    RunnerOptions { listen: Some(([127, 0, 0, 1], 0).into()), ..options(PROGRAM, 0) }
}

fn joined(event: &RunEvent) -> Option<()> {
    matches!(event, RunEvent::WorkerJoined { .. }).then_some(())
}

/// Both ends of every connection are in this process.
fn crowd(workers: u32) {
    allow_sockets(2 * u64::from(workers)).unwrap();
    let gate = Gate::new();
    let leaves = Leaves::GateHere { address: gate.address().to_string() };
    let mut options = listening();
    // All workers connect at once and do not retry.
    options.limits.unauthenticated = options.limits.unauthenticated.max(workers as usize);
    options.policy.heartbeat = Duration::from_millis(500);
    options.policy.lost_after = Duration::from_millis(5000);
    let cluster = Cluster::start(leaves.clone(), options);
    cluster.address();
    let began = Instant::now();
    let light = LightWorkers::join(&cluster.access(), workers);
    (0..workers).for_each(|_| cluster.wait_for(joined));
    println!("{workers} workers have joined after {:?}", began.elapsed());
    // The last node runs on one of them; until then all wait.
    gate.next().release();
    let (result, summary) = cluster.finish();
    light.finish();
    assert!(result.is_some());
    assert_eq!((summary.workers_joined, summary.workers_left), (u64::from(workers), 0));
}

#[test]
fn hundred_idle_workers_join_and_stay() {
    crowd(100);
}

#[cfg(feature = "slow")]
#[test]
fn thousand_idle_workers_join_and_stay() {
    crowd(1000);
}

#[test]
fn graph_on_many_workers_gives_the_result_of_one_process() {
    let leaves = Leaves::Digests { count: 300, shared_bytes: 100_000 };
    let cluster = Cluster::start(leaves.clone(), listening());
    cluster.address();
    let light = LightWorkers::join(&cluster.access(), 20);
    let (result, summary) = cluster.finish();
    // Some may have joined after the end of the run.
    drop(light);
    assert_eq!(result, TestPlanner::reference(leaves));
    assert_eq!(summary.requeued_nodes, 0);
}
