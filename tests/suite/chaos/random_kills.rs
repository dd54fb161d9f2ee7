//! A node that kills its workers, and workers killed from outside: the first makes the node fail by name, the second fails no node.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use lookalike::math::sampling::{key, uniform};
use lookalike_coordinator::events::RunEvent;
use lookalike_tests::cluster::{Cluster, options};
use lookalike_tests::gate::{Gate, Keeper, Waiting};
use lookalike_tests::plan::Leaves;
use lookalike_tests::process::signal;

use super::PROGRAM;

/// Kills processes that wait at the gate at random, `kills` at most, and lets the others pass. `killed` counts them.
fn kill_at_random(gate: Gate, seed: u64, kills: u32, killed: Arc<AtomicU32>) -> Keeper {
    let mut arrivals = 0;
    gate.keep(move |waiting: Waiting| {
        arrivals += 1;
        if killed.load(Ordering::Relaxed) < kills && uniform(key(&[seed, arrivals])) < 0.5 {
            killed.fetch_add(1, Ordering::Relaxed);
            signal(waiting.process(), "KILL");
            waiting.wait_for_death();
        } else {
            waiting.release();
        }
    })
}

/// The result, and the nodes that failed with the reason.
type Ending = (Option<Vec<u8>>, BTreeMap<String, String>);

/// The outcome of a run of gates, possibly with a node that kills its workers, under this many kills.
fn run(seed: u64, gates: usize, has_killer: bool, kills: u32) -> Ending {
    let (gate, killed) = (Gate::new(), Arc::new(AtomicU32::new(0)));
    let leaves = Leaves::GatesAndKiller { gates, has_killer, address: gate.address().to_string() };
    let keeper = kill_at_random(gate, seed, kills, Arc::clone(&killed));
    let (events, outcome) = Cluster::start(leaves, options(PROGRAM, 3)).outcome();
    keeper.stop();
    let (result, summary) = outcome.unwrap();
    assert!(killed.load(Ordering::Relaxed) >= kills / 2, "seed {seed}: too few kills: {summary:?}");
    let failed = events.into_iter().filter_map(|event| match event {
        RunEvent::NodeFailed { name, reason } => Some((name.label.to_string(), reason.to_string())),
        _ => None,
    });
    (result, failed.collect())
}

#[test]
fn node_that_kills_its_workers_fails_and_all_others_complete() {
    let (with_killer, failed) = run(1, 6, true, 0);
    assert_eq!(failed.len(), 1, "{failed:?}");
    assert!(failed["killer"].contains("3 worker processes died"), "{failed:?}");
    // The result of the other nodes is that of a run without the failing node.
    let (without_killer, failed) = run(2, 6, false, 0);
    assert!(failed.is_empty() && with_killer.is_some() && with_killer == without_killer, "{failed:?}");
}

/// Seeds of the kills. The run of seed 5 has a node that kills its workers.
const SEEDS: &[u64] = if cfg!(feature = "slow") { &[4, 5] } else { &[5] };

#[test]
fn random_kills_from_outside_fail_no_node_except_one_that_kills_its_workers() {
    let (without_kills, _) = run(3, 8, false, 0);
    for &seed in SEEDS {
        let (result, failed) = run(seed, 8, seed == 5, 6);
        assert_eq!(failed.keys().collect::<Vec<_>>(), if seed == 5 { vec!["killer"] } else { vec![] }, "{failed:?}");
        assert!(result == without_kills, "seed {seed}");
    }
}
