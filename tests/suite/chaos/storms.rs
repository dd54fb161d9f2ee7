//! A node that kills its workers, and somebody who does: the first fails by name, whom the second hits does not.

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

/// Kills processes that wait at the gate at random, so many at most, and lets the others pass. How many it has killed is counted.
fn storm(gate: Gate, seed: u64, kills: u32, killed: Arc<AtomicU32>) -> Keeper {
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

/// What becomes of a run of innocent nodes, and perhaps a murderer, under so many kills.
fn run(seed: u64, innocents: usize, has_murderer: bool, kills: u32) -> Ending {
    let (gate, killed) = (Gate::new(), Arc::new(AtomicU32::new(0)));
    let leaves = Leaves::Mob { innocents, has_murderer, address: gate.address().to_string() };
    let keeper = storm(gate, seed, kills, Arc::clone(&killed));
    let (events, outcome) = Cluster::start(leaves, options(PROGRAM, 3)).outcome();
    keeper.stop();
    let (result, summary) = outcome.unwrap();
    assert!(killed.load(Ordering::Relaxed) >= kills / 2, "seed {seed}: the storm was over too early: {summary:?}");
    let failed = events.into_iter().filter_map(|event| match event {
        RunEvent::NodeFailed { name, reason } => Some((name.label, reason.to_string())),
        _ => None,
    });
    (result, failed.collect())
}

#[test]
fn node_that_kills_its_workers_fails_by_name_and_all_others_complete() {
    let (calm, failed) = run(1, 6, true, 0);
    assert_eq!(failed.len(), 1, "{failed:?}");
    assert!(failed["murderer"].contains("3 worker processes died"), "{failed:?}");
    // The innocents' result is that of a run without a murderer.
    let (innocent, failed) = run(2, 6, false, 0);
    assert!(failed.is_empty() && calm.is_some() && calm == innocent, "{failed:?}");
}

#[test]
fn random_kills_from_outside_bring_no_innocent_node_to_failure_and_do_not_save_the_guilty() {
    let (calm, _) = run(3, 8, false, 0);
    for seed in [4, 5] {
        let (result, failed) = run(seed, 8, seed == 5, 6);
        assert_eq!(failed.keys().collect::<Vec<_>>(), if seed == 5 { vec!["murderer"] } else { vec![] }, "{failed:?}");
        assert!(result == calm, "seed {seed}");
    }
}
