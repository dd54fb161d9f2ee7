//! Fits that are killed at random and resumed with another number of workers until they end: none hangs, each has the same bits.
//! `LOOKALIKE_RESUME_RUNS=N` is the number of fits (default 2; 200 with `--features slow`), `LOOKALIKE_CHAOS_SEED=S` the first seed
//! (default 1).

use std::process::Command;
use std::sync::mpsc::RecvTimeoutError;
use std::time::Instant;
use std::{fs, io, path::Path};

use lookalike::math::sampling::{key, uniform};
use lookalike_tests::PATIENCE;
use lookalike_tests::journal::JournalView;
use lookalike_tests::process::Process;

use super::random::{FILES, setting};
use crate::fit::scene::{fit, folder_of_size, without_timing};

/// How many fits there are by default.
const RUNS: u64 = if cfg!(feature = "slow") { 200 } else { 2 };

/// Shards, the coarse table, six searches, full tables, judging, exploration, pictures: at least 16 nodes.
const FLAGS: &str = "--model ggx --samples 32 --gammas 1:2:0.2 --seed 5 --polish off";

/// Columns and rows of the photo.
const SIZE: usize = 24;

/// The most workers of a coordinator, and the most coordinators that are killed in a run.
const MOST: (u64, u64) = (6, 3);

/// Counts over all runs.
#[derive(Debug, Default)]
struct Figures {
    runs: u64,
    kills: u64,
    hangs: Vec<u64>,
    different: Vec<u64>,
    run_twice: Vec<u64>,
}

#[test]
fn fits_killed_at_random_and_resumed_by_other_worker_counts_end_with_the_same_bits() {
    let folder = folder_of_size(SIZE);
    fit(folder.path(), "whole", &format!("{FLAGS} --workers 1 --progress none")).done();
    let first = setting("LOOKALIKE_CHAOS_SEED", 1);
    let (mut figures, begin) = (Figures::default(), Instant::now());
    for seed in first..first + setting("LOOKALIKE_RESUME_RUNS", RUNS) {
        one_run(folder.path(), seed, &mut figures);
    }
    println!("{figures:?} after {:.0} s", begin.elapsed().as_secs_f64());
    let Figures { hangs, different, run_twice, .. } = figures;
    assert!(hangs.is_empty() && different.is_empty() && run_twice.is_empty());
}

/// How a coordinator ended.
#[derive(PartialEq, Eq)]
enum End {
    Finished,
    Killed,
    Hangs,
}

fn one_run(folder: &Path, seed: u64, figures: &mut Figures) {
    let (out, mut drawn) = (format!("resumed{seed}"), 0);
    let mut draw = |least: u64, most: u64| {
        drawn += 1;
        between(uniform(key(&[seed, drawn])), least, most)
    };
    figures.runs += 1;
    let kills = draw(1, MOST.1);
    for coordinator in 0..=kills {
        let workers = draw(1, MOST.0);
        // Between the first event and a few after the last one of a short run.
        let kill_after = (coordinator < kills).then(|| draw(1, 70));
        match coordinate(folder, &out, workers, kill_after) {
            End::Killed => figures.kills += 1,
            End::Finished => break,
            End::Hangs => {
                println!("seed {seed}: hangs with {workers} workers");
                figures.hangs.push(seed);
                return;
            }
        }
    }
    let [whole, there] = ["whole", &out].map(|name| folder.join(name));
    let is_same = |file: &&str| fs::read(whole.join(file)).unwrap() == fs::read(there.join(file)).unwrap();
    if without_timing(&whole) != without_timing(&there) || !FILES.iter().all(is_same) {
        figures.different.push(seed);
    }
    if JournalView::of(&there).run_twice() > 0 {
        figures.run_twice.push(seed);
    }
    fs::remove_dir_all(there).unwrap();
}

/// Start or resume the fit with this many workers; kill its coordinator after `kill_after` events.
fn coordinate(folder: &Path, out: &str, workers: u64, kill_after: Option<u64>) -> End {
    let line = format!("fit photo.exr --env map.exr --out {out} {FLAGS} --workers {workers} --resume --progress json");
    let mut command = Command::new(env!("CARGO_BIN_EXE_lookalike-under-test"));
    let mut process = Process::start(command.args(line.split_whitespace()).current_dir(folder).env_remove("RUST_LOG"));
    let events = process.follow_stderr(io::sink());
    let mut told = 0;
    loop {
        match events.recv_timeout(PATIENCE) {
            Ok(event) => {
                assert!(event["event"] != "failed", "{event}");
                told += 1;
                if kill_after == Some(told) {
                    process.kill();
                    return End::Killed;
                }
            }
            // Its local workers share its stderr, so they have ended too.
            Err(RecvTimeoutError::Disconnected) => {
                let code = process.output().status.code();
                assert_eq!(code, Some(0), "{out} with {workers} workers");
                return End::Finished;
            }
            Err(RecvTimeoutError::Timeout) => return End::Hangs,
        }
    }
}

/// A whole number from `least` to `most`.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small number, 0 or more")]
fn between(chance: f64, least: u64, most: u64) -> u64 {
    least + (chance * (most - least + 1) as f64) as u64
}
