//! The runner in a simulated network, with faults from a seed. Coordinator and workers are the program itself, with TLS, protocol and
//! journal; network, time, computing and randomness are simulated (see `lookalike_worker::world`).
//!
//! Checked after every run: it has ended, each node has the same outcome as in one process, no acknowledged node was assigned again, no
//! node failed without a cause of its own, and no worker left or ended without a fault.

mod chance;
mod events;
mod faults;
mod processes;
mod run;
mod stage;
mod web;
mod wire;
mod world;

use std::collections::BTreeMap;
use std::env;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Duration;

use self::run::{Ending, simulate};

/// How many seeds are simulated.
const SEEDS: u64 = if cfg!(feature = "slow") { 1000 } else { 24 };

/// How many seeds are simulated twice.
const REPLAYS: u64 = if cfg!(feature = "slow") { 5 } else { 1 };

/// Environment variable: the seed to replay.
const SEED: &str = "LOOKALIKE_SIM_SEED";

/// Environment variable: how many seeds are simulated twice.
const TWICE: &str = "LOOKALIKE_SIM_TWICE";

/// Environment variable: how many seeds are simulated.
const COUNT: &str = "LOOKALIKE_SIM_SEEDS";

#[test]
fn runs_end_correctly_under_all_faults() {
    let count = number(COUNT).unwrap_or(SEEDS);
    let first = number(SEED).unwrap_or(0);
    let mut report = Report::default();
    let mut failed = Vec::new();
    for seed in first..first + count {
        match try_seed(seed) {
            Ok(ending) => report.add(&ending),
            Err(wrong) => {
                println!("seed {seed}: {}\n    {}", wrong.lines().last().unwrap_or_default(), replay(seed));
                failed.push(seed);
            }
        }
    }
    println!("{report:#?}");
    assert!(failed.is_empty(), "{} of {count} seeds failed: {failed:?}", failed.len());
}

#[test]
fn seed_replays_to_the_same_events_at_the_same_times() {
    for seed in 1..=number(TWICE).unwrap_or(REPLAYS) {
        let [first, second] = [0, 1].map(|_| simulate(seed).expect("a run that comes through").trace);
        let differing = first.lines().zip(second.lines()).find(|(first, second)| first != second);
        assert_eq!(differing, None, "seed {seed}");
        assert_eq!(first, second, "seed {seed}");
    }
}

#[test]
fn seed_that_is_asked_for_is_replayed() {
    let Some(seed) = number(SEED) else {
        println!("skipped: {SEED} names no seed to replay");
        return;
    };
    match try_seed(seed) {
        Ok(ending) => println!("{}\n{:#?}", ending.trace, ending.faults),
        Err(wrong) => panic!("seed {seed}:\n{wrong}\n{}", replay(seed)),
    }
}

fn try_seed(seed: u64) -> Result<Ending, String> {
    let outcome = catch_unwind(AssertUnwindSafe(|| simulate(seed)));
    outcome.unwrap_or_else(|_| Err("it has panicked: see above".into()))
}

fn replay(seed: u64) -> String {
    format!(
        "replay it: {SEED}={seed} cargo test -p lookalike-tests --test suite sim::seed_that_is_asked -- --nocapture"
    )
}

fn number(name: &str) -> Option<u64> {
    env::var(name).ok().map(|text| text.parse().unwrap_or_else(|_| panic!("{name}: expected a number, found {text:?}")))
}

/// Totals over many runs.
#[derive(Debug, Default)]
struct Report {
    runs: u32,
    nodes: usize,
    coordinators: u32,
    simulated: Duration,
    faults: BTreeMap<&'static str, u32>,
    requeued: u64,
    duplicates: u64,
    speculated: u64,
    verified: u64,
    recalled: usize,
}

impl Report {
    fn add(&mut self, ending: &Ending) {
        self.runs += 1;
        self.nodes += ending.nodes;
        self.coordinators += ending.coordinators;
        self.simulated += ending.time;
        self.requeued += ending.summary.requeued_nodes;
        self.duplicates += ending.summary.duplicate_results;
        self.speculated += ending.summary.speculated_nodes;
        self.verified += ending.summary.verified_nodes;
        self.recalled += ending.summary.recalled_nodes;
        for (name, count) in &ending.faults {
            *self.faults.entry(name).or_default() += count;
        }
    }
}
