//! How a batch ends when a fit fails or misses its score: which fits have results, and the exit code.

use super::{QUICK, batch, folder, states, summary};
use crate::program::lookalike;
use lookalike_tests::process::{Process, signal};
use serde_json::{Value, json};
use std::process::{Command, Output};
use tempfile::TempDir;

/// Three fits; judging of the second fails.
fn one_fails() -> String {
    format!("photos = ['photo.exr', 'tiny.exr', 'red.exr']\nenvironments = 'map.exr'\n[defaults]\n{QUICK}")
}

#[test]
fn failed_fit_is_code_four_and_the_others_complete() {
    let folder = folder(&one_fails());
    let answer = batch(&folder, "out", "--workers 1");
    assert_eq!(answer.code, Some(4), "{}", answer.stderr);
    assert!(answer.stderr.contains("tiny-map-ggx: failed: select \"select\" failed: "), "{}", answer.stderr);
    assert!(
        answer.stdout.contains("2 of 3 done, 1 failed") && !answer.stderr.contains("panicked"),
        "{}",
        answer.stdout
    );
    let out = folder.path().join("out");
    let summary = summary(&out);
    assert_eq!(states(&summary), ["done", "failed", "done"]);
    assert_eq!(summary["state"], "finished");
    assert!(summary["fits"][1]["error"].as_str().unwrap().contains("11 x 11"), "{summary}");
    assert!(out.join("red-map-ggx/fit.json").exists() && !out.join("tiny-map-ggx").exists());
    let status = lookalike(folder.path(), "status out").done().stdout;
    for words in ["out: ended with failures", "ended: 1 of 3 fits failed", "fits        2 of 3 done, 1 failed"] {
        assert!(status.contains(words), "{words} in {status}");
    }
    let told: Value = serde_json::from_str(&lookalike(folder.path(), "status out --json").done().stdout).unwrap();
    assert_eq!((&told["state"], &told["error"]), (&json!("ended"), &json!("1 of 3 fits failed")));
    for (fit, summary) in told["fits"].as_array().unwrap().iter().zip(summary["fits"].as_array().unwrap()) {
        for field in ["name", "state", "cssim", "error"] {
            assert_eq!(fit[field], summary[field], "{field}");
        }
    }
    // Without the lock file the state is the same.
    std::fs::remove_file(out.join("run.lock")).unwrap();
    assert!(lookalike(folder.path(), "status out").done().stdout.contains("ended: 1 of 3 fits failed"));
}

#[test]
fn fail_fast_ends_the_batch_with_code_four() {
    // The fit that fails comes first, and the other has so many candidates that it is still searching then.
    let fits = "[[fit]]\nphoto = 'tiny.exr'\nenv = 'map.exr'\n\
                [[fit]]\nphoto = 'photo.exr'\nenv = 'map.exr'\ngammas = '1:5:0.01'\n";
    let folder = folder(&format!("[defaults]\n{QUICK}{fits}"));
    let answer = batch(&folder, "out", "--workers 1 --fail-fast");
    assert_eq!(answer.code, Some(4), "{}", answer.stderr);
    let summary = summary(&folder.path().join("out"));
    assert_eq!(
        (states(&summary), summary["state"].as_str()),
        (vec!["failed".into(), "stopped".into()], Some("stopped"))
    );
    assert!(answer.stdout.contains("not done"), "{}", answer.stdout);
    let status = lookalike(folder.path(), "status out").done().stdout;
    assert!(status.contains("stopped: a fit failed, and --fail-fast ends the batch then"), "{status}");
    let fits = status.lines().find(|line| line.starts_with("fits ")).unwrap();
    assert!(!fits.contains("waiting") && !fits.contains("running") && fits.ends_with(" stopped"), "{fits}");
    let json = batch(&folder, "json", "--workers 1 --fail-fast --progress json").stderr;
    let last: Value = serde_json::from_str(json.lines().rfind(|line| line.starts_with('{')).unwrap()).unwrap();
    let reason = "a fit failed, and --fail-fast ends the batch then";
    assert_eq!((&last["event"], &last["reason"]), (&json!("stopped"), &json!(reason)));
}

#[test]
fn last_of_fail_fast_and_keep_going_counts() {
    let folder = folder(&one_fails());
    let answer = batch(&folder, "out", "--workers 1 --fail-fast --keep-going --samples 16");
    assert_eq!(answer.code, Some(4), "{}", answer.stderr);
    assert_eq!(states(&summary(&folder.path().join("out"))), ["done", "failed", "done"]);
}

/// Runs one fit of a batch whose summaries cannot be written after its first worker has joined; `act` then gets the id of the process.
fn without_summaries(folder: &TempDir, act: impl Fn(u32)) -> (Output, Vec<Value>) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lookalike-under-test"));
    let line = "batch batch.toml --out out --workers 1 --progress json";
    let process = Process::start(command.args(line.split(' ')).current_dir(folder.path()).env_remove("RUST_LOG"));
    let coordinator = process.id();
    process.watch_stderr(|events| {
        if events.last().is_some_and(|event| event["event"] == "worker-joined") {
            std::fs::create_dir(folder.path().join("out/summary.json.partial")).unwrap();
            act(coordinator);
        }
    })
}

#[test]
fn unwritable_summaries_are_code_three_unless_the_batch_was_interrupted() {
    let manifest = format!("photos = 'photo.exr'\nenvironments = 'map.exr'\n[defaults]\n{QUICK}");
    let whole = folder(&manifest);
    let (output, events) = without_summaries(&whole, |_| ());
    assert_eq!(output.status.code(), Some(3), "{events:?}");
    let last = events.iter().rev().find(|event| event["event"].is_string()).unwrap();
    assert!(last["event"] == "failed" && last["error"].as_str().unwrap().contains("summary.json"), "{last}");
    assert!(whole.path().join("out/photo-map-ggx/fit.json").exists());
    let interrupted = folder(&manifest);
    let (output, events) = without_summaries(&interrupted, |coordinator| signal(coordinator, "INT"));
    assert_eq!(output.status.code(), Some(130), "{events:?}");
    let last = events.iter().rev().find(|event| event["event"].is_string()).unwrap();
    assert_eq!(*last, json!({ "event": "failed", "error": "interrupted", "time_s": last["time_s"] }));
}

#[test]
fn missed_score_is_code_one_unless_a_fit_failed() {
    let fits = "[[fit]]\nphoto = 'photo.exr'\nenv = 'map.exr'\nmax-cssim = 0\n\
                [[fit]]\nphoto = 'red.exr'\nenv = 'map.exr'\nmax-cssim = 1\n";
    let folder = folder(&format!("[defaults]\n{QUICK}{fits}"));
    let answer = batch(&folder, "out", "--workers 2");
    assert_eq!(answer.code, Some(1), "{}", answer.stderr);
    assert_eq!(states(&summary(&folder.path().join("out"))), ["missed", "done"]);
    assert!(folder.path().join("out/photo-map-ggx/fit.json").exists());
    let worse = format!("[defaults]\n{QUICK}{fits}[[fit]]\nphoto = 'tiny.exr'\nenv = 'map.exr'\n");
    std::fs::write(folder.path().join("batch.toml"), worse).unwrap();
    assert_eq!(batch(&folder, "worse", "--workers 2").code, Some(4));
}
