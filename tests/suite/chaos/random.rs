//! Real fits under seeded mixes of all faults. `LOOKALIKE_CHAOS_RUNS=N` is the number of fits (default 1; 50 with `--features slow`),
//! `LOOKALIKE_CHAOS_SEED=S` the first seed (default 1). Repeat a failed fit with its seed and `LOOKALIKE_CHAOS_RUNS=1`.

use std::any::Any;
use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::time::Instant;

use lookalike_tests::faulted_fit::{Ending, FaultedFit};
use tempfile::TempDir;

use crate::fit::scene::{fit, folder_of_size, without_timing};

/// Four shards, the coarse table, eleven searches, full tables, judging, exploration, polish, pictures.
const FLAGS: &str = if cfg!(feature = "slow") {
    "--model ggx --samples 128 --gammas 1:3:0.2 --seed 5"
} else {
    "--model ggx --samples 128 --gammas 1:3:0.2 --seed 5 --polish off"
};

/// The files of results that are the same from run to run.
pub(super) const FILES: [&str; 5] = ["match.exr", "match.png", "reference.png", "difference.png", "candidates.csv"];

/// Columns and rows of the photo.
const SIZE: usize = if cfg!(feature = "slow") { 64 } else { 32 };

pub(super) fn setting(name: &str, otherwise: u64) -> u64 {
    let text = std::env::var(name).ok();
    text.map_or(otherwise, |text| text.parse().unwrap_or_else(|_| panic!("{name}: expected a number, found {text}")))
}

#[test]
fn fits_under_random_faults_lose_and_repeat_no_node_and_give_the_same_bits() {
    let folder = folder_of_size(SIZE);
    fit(folder.path(), "whole", &format!("{FLAGS} --workers 1 --progress none")).done();
    let first = setting("LOOKALIKE_CHAOS_SEED", 1);
    let runs = setting("LOOKALIKE_CHAOS_RUNS", if cfg!(feature = "slow") { 50 } else { 1 });
    let failed: Vec<u64> = (first..first + runs).filter(|seed| !survives(&folder, *seed)).collect();
    println!("{runs} runs, {} failed", failed.len());
    if !failed.is_empty() {
        let kept = folder.keep();
        panic!("seeds {failed:?} failed; what they have left is in {}", kept.display());
    }
}

/// Whether a fit survives this seed; if not, prints the reason.
fn survives(folder: &TempDir, seed: u64) -> bool {
    let (out, begin) = (format!("run{seed}"), Instant::now());
    let arguments = format!("fit photo.exr --env map.exr {FLAGS}");
    let program = env!("CARGO_BIN_EXE_lookalike-under-test");
    let fit = FaultedFit { program, folder: folder.path(), arguments: &arguments, out: &out, seed };
    let outcome = catch_unwind(AssertUnwindSafe(|| fit.run()));
    let seconds = begin.elapsed().as_secs_f64();
    match outcome.map_err(|why| message(&*why)).and_then(|ending| judge(folder.path(), &out, ending)) {
        Ok(Ending { faults, coordinators, .. }) => {
            println!("seed {seed}: same bits after {seconds:.1} s, {coordinators} coordinators, {faults:?}");
            fs::remove_dir_all(folder.path().join(&out)).unwrap();
            true
        }
        Err(why) => {
            println!("seed {seed}: {why}");
            false
        }
    }
}

/// Checks the results of a fit.
fn judge(folder: &Path, out: &str, ending: Ending) -> Result<Ending, String> {
    let [whole, there] = ["whole", out].map(|name| folder.join(name));
    if without_timing(&whole) != without_timing(&there) {
        return Err(format!("different: fit.json; {ending:?}"));
    }
    for file in FILES {
        if fs::read(whole.join(file)).unwrap() != fs::read(there.join(file)).unwrap() {
            return Err(format!("different: {file}; {ending:?}"));
        }
    }
    match ending.run_twice > ending.damaged {
        true => Err(format!("done twice: {} nodes; {ending:?}", ending.run_twice)),
        false => Ok(ending),
    }
}

fn message(why: &(dyn Any + Send)) -> String {
    let text = why.downcast_ref::<String>().cloned();
    text.or_else(|| why.downcast_ref::<&str>().map(|text| (*text).to_owned())).unwrap_or_default()
}
