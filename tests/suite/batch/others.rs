//! Fits in the output folder that the batch did not write: neither taken for its results nor replaced.

use super::{QUICK, batch, folder, scene, states, summary};
use crate::program::lookalike;
use lookalike_tests::{
    journal::JournalView,
    process::{Process, signal},
};
use std::{fs, path::Path, process::Command};
use tempfile::TempDir;

const NAMES: [&str; 2] = ["photo-map-ggx", "red-map-ggx"];

/// Two fits. The second has more candidates, so that the first is written well before it.
fn two() -> TempDir {
    let fits = "[[fit]]\nphoto = 'photo.exr'\nenv = 'map.exr'\n\
                [[fit]]\nphoto = 'red.exr'\nenv = 'map.exr'\ngammas = '1:3:0.1'\n";
    folder(&format!("[defaults]\n{QUICK}{fits}"))
}

/// A single fit, with settings that differ from those of the batch.
fn alone(folder: &TempDir, out: &str) {
    let flags = "--samples 16 --gammas 1 --polish off --workers 1 --progress none";
    lookalike(folder.path(), &format!("fit photo.exr --env map.exr --out {out} {flags}")).done();
}

/// Kills a batch with `--resume` as soon as its journal has a written fit. Returns the name of that fit and of the other one.
fn killed_after_a_fit(folder: &TempDir) -> [&'static str; 2] {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lookalike-under-test"));
    let line = "batch batch.toml --out out --resume --workers 1 --progress json";
    let mut process = Process::start(command.args(line.split(' ')).current_dir(folder.path()).env_remove("RUST_LOG"));
    let written = "SELECT name FROM fits WHERE outputs IS NOT NULL";
    let (mut worker, mut has_finished) = (None, false);
    let found = process.stderr_until(|event| {
        if event["event"] == "worker-joined" {
            worker = event["process"].as_u64().and_then(|process| u32::try_from(process).ok());
        }
        if event["event"] == "fit-finished" && !has_finished {
            has_finished = true;
            // The other fit gets no further until the journal has this one.
            signal(worker.expect("a worker that joined"), "STOP");
        }
        let journal = || JournalView::of(&folder.path().join("out"));
        has_finished.then(|| journal().column::<String>(written)).filter(|names| !names.is_empty())
    });
    process.kill();
    let found = found.expect("the batch ended before");
    let place = NAMES.iter().position(|name| found[..] == [(*name).to_owned()]).expect("one of two fits");
    [NAMES[place], NAMES[1 - place]]
}

fn copy(from: &Path, to: &Path, files: &[&str]) {
    fs::create_dir_all(to).unwrap();
    for file in files {
        fs::copy(from.join(file), to.join(file)).unwrap();
    }
}

const FILES: [&str; 6] = ["candidates.csv", "match.exr", "match.png", "reference.png", "difference.png", "fit.json"];

#[test]
fn results_that_the_run_did_not_write_are_refused_together() {
    let folder = two();
    for name in NAMES {
        alone(&folder, &format!("out/{name}"));
    }
    let refusals = [
        "error: out: 2 problems",
        "out/photo-map-ggx holds a fit that is not of this run: choose another --out",
        "out/red-map-ggx holds a fit that is not of this run",
    ];
    let before = fs::read(folder.path().join("out/photo-map-ggx/fit.json")).unwrap();
    for flags in ["", "--resume", "--resume --samples 999"] {
        batch(&folder, "out", flags).refused(&refusals);
    }
    assert_eq!(fs::read(folder.path().join("out/photo-map-ggx/fit.json")).unwrap(), before);
    assert!(!folder.path().join("out/run.sqlite").exists() && !folder.path().join("out/summary.json").exists());
    // An unfinished fit is also refused, and so is a folder with only the files of a finished one.
    fs::remove_dir_all(folder.path().join("out/red-map-ggx")).unwrap();
    fs::remove_file(folder.path().join("out/photo-map-ggx/run.sqlite")).unwrap();
    batch(&folder, "out", "").refused(&["out/photo-map-ggx holds a fit that is not of this run"]);
    fs::remove_file(folder.path().join("out/photo-map-ggx/fit.json")).unwrap();
    fs::write(folder.path().join("out/photo-map-ggx/run.sqlite"), "").unwrap();
    batch(&folder, "out", "").refused(&["out/photo-map-ggx holds a fit that is not of this run"]);
}

#[test]
fn resumed_batch_accepts_only_results_written_according_to_its_journal() {
    let folder = two();
    let [written, open] = killed_after_a_fit(&folder);
    alone(&folder, "alone");
    let at = |name: &str| folder.path().join("out").join(name);
    let _ = fs::remove_dir_all(at(open));
    copy(&folder.path().join("alone"), &at(open), &FILES);
    copy(&folder.path().join("alone"), &at(open), &["run.sqlite"]);
    batch(&folder, "out", "--resume").refused(&[&format!("out/{open} holds a fit that is not of this run")]);
    fs::remove_file(at(open).join("run.sqlite")).unwrap();
    let kept = fs::read(at(written).join("match.exr")).unwrap();
    fs::write(at(written).join("match.exr"), "mine").unwrap();
    batch(&folder, "out", "--resume")
        .refused(&[&format!("{written}/match.exr is not what the run in out wrote; keep a changed file elsewhere")]);
    fs::write(at(written).join("match.exr"), kept).unwrap();
    // A fit that the run did not write is refused even without a journal.
    let foreign = fs::read(at(open).join("fit.json")).unwrap();
    batch(&folder, "out", "--resume").refused(&[&format!("out/{open} holds a fit that is not of this run")]);
    assert!(fs::read(at(open).join("fit.json")).unwrap() == foreign);
    fs::remove_dir_all(at(open)).unwrap();
    batch(&folder, "out", "--resume --workers 1").done();
    batch(&folder, "whole", "--workers 1").done();
    assert_eq!(states(&summary(&folder.path().join("out"))), ["done"; 2]);
    for name in NAMES {
        let whole = folder.path().join("whole").join(name);
        assert_eq!(scene::without_timing(&at(name)), scene::without_timing(&whole), "{name}");
        assert!(fs::read(at(name).join("match.exr")).unwrap() == fs::read(whole.join("match.exr")).unwrap(), "{name}");
    }
}
