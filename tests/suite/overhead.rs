//! `lookalike-overhead` measures what it claims: every node runs exactly once. Speed is not asserted here.

use std::process::Command;

use serde_json::Value;

const PROGRAM: &str = env!("CARGO_BIN_EXE_lookalike-overhead");

fn measure(arguments: &[&str]) -> Value {
    let output = Command::new(PROGRAM).args(arguments).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn nodes_are_assigned_once_except_a_few_that_are_moved() {
    let found = measure(&["throughput", "3000"]);
    assert_eq!(found["nodes"], 3000, "{found}");
    assert!(found["attempts_beyond_one"].as_u64().unwrap() < 30, "{found}");
    assert!(measure(&["round-trip", "3"])["median_ms"].as_f64().unwrap() > 0.0);
}

#[test]
fn killed_worker_loses_its_leases_and_killed_coordinator_no_finished_node() {
    let worker = measure(&["worker-killed", "200"]);
    assert_eq!((&worker["completed"], &worker["finished_nodes_run_twice"]), (&worker["nodes"], &0.into()), "{worker}");
    let coordinator = measure(&["coordinator-killed", "200"]);
    assert_eq!(coordinator["results"], coordinator["nodes"], "{coordinator}");
    assert_eq!(coordinator["finished_nodes_run_twice"], 0, "{coordinator}");
    assert!(coordinator["finished_before"].as_u64().unwrap() > 0, "{coordinator}");
}
