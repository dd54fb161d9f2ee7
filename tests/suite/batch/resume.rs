//! A resumed batch: complete fits stay, acknowledged nodes are not computed again, and the results are those of an undisturbed run.

use super::{QUICK, batch, folder, scene, states, summary};
use lookalike_tests::{journal::JournalView, process::Process};
use serde_json::Value;
use std::{fs, process::Command};
use tempfile::TempDir;

const NAMES: [&str; 4] = ["photo-map-ggx", "photo-map-cook-torrance", "red-map-ggx", "red-map-cook-torrance"];

fn four() -> TempDir {
    let product = "photos = ['photo.exr', 'red.exr']\nenvironments = 'map.exr'\nmodels = ['ggx', 'cook-torrance']\n";
    folder(&format!("{product}[defaults]\n{QUICK}"))
}

/// The fits that are written according to the journal of `out`.
fn written(folder: &TempDir) -> Vec<String> {
    let journal = JournalView::of(&folder.path().join("out"));
    journal.column("SELECT name FROM fits WHERE outputs IS NOT NULL ORDER BY number")
}

fn start(folder: &TempDir, flags: &str) -> Process {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lookalike-under-test"));
    let line = format!("batch batch.toml --out out --resume --progress json {flags}");
    Process::start(command.args(line.split_whitespace()).current_dir(folder.path()).env_remove("RUST_LOG"))
}

/// Runs the batch to the first event that `pick` accepts and then kills its coordinator.
fn kill_at(folder: &TempDir, mut pick: impl FnMut(&Value) -> bool) {
    let mut process = start(folder, "--workers 2");
    let found = process.stderr_until(|event| pick(event).then_some(()));
    assert!(found.is_some(), "the batch ended before");
    process.kill();
}

#[test]
fn killed_batch_resumes_and_ends_with_the_same_results() {
    let folder = four();
    batch(&folder, "whole", "--workers 2").done();
    let is = |event: &Value, name: &str, kind: &str| event["event"] == name && event["kind"] == kind;
    kill_at(&folder, |event| is(event, "node-finished", "search"));
    let mut has_finished = false;
    kill_at(&folder, |event| {
        has_finished |= event["event"] == "fit-finished";
        has_finished && !written(&folder).is_empty()
    });
    let complete = written(&folder);
    let (output, events) = start(&folder, "--workers 2").watch_stderr(|_| ());
    assert_eq!(output.status.code(), Some(0), "{events:?}");
    let started = |name: &str| events.iter().any(|event| event["event"] == "fit-started" && event["fit"] == name);
    for name in complete {
        assert!(!started(&name), "{name} was complete");
    }
    let at = |run: &str| folder.path().join(run);
    for name in NAMES {
        let [whole, resumed] = ["whole", "out"].map(|run| at(run).join(name));
        assert_eq!(scene::without_timing(&whole), scene::without_timing(&resumed), "{name}");
        for file in ["match.exr", "candidates.csv", "difference.png"] {
            assert!(fs::read(whole.join(file)).unwrap() == fs::read(resumed.join(file)).unwrap(), "{file} of {name}");
        }
    }
    assert_eq!(JournalView::of(&at("out")).run_twice(), 0);
    let numbers = |run: &str| {
        let fits = summary(&at(run))["fits"].as_array().unwrap().clone();
        fits.iter()
            .map(|fit| (fit["cssim"].clone(), fit["parameters"].clone(), fit["state"].clone()))
            .collect::<Vec<_>>()
    };
    assert_eq!(numbers("whole"), numbers("out"));

    // The batch is finished: no fit is run.
    let again = batch(&folder, "out", "--resume --workers 1").done();
    assert!(again.stderr.contains("out is finished, and its results are as it wrote them"), "{}", again.stderr);
    assert!(again.stdout.contains("4 of 4 done"), "{}", again.stdout);
    // If a file is missing, only its fit is run.
    fs::remove_file(at("out").join("red-map-ggx/match.exr")).unwrap();
    let (output, events) = start(&folder, "--workers 1").watch_stderr(|_| ());
    assert_eq!(output.status.code(), Some(0), "{events:?}");
    let started: Vec<&Value> =
        events.iter().filter(|event| event["event"] == "fit-started").map(|event| &event["fit"]).collect();
    assert_eq!(started, ["red-map-ggx"]);
    assert!(at("out").join("red-map-ggx/match.exr").exists());
}

#[test]
fn outputs_of_written_fits_are_deleted_from_the_journal_of_an_unfinished_batch() {
    // The third fit fails, so the batch is not finished and its journal stays open for a resume.
    let photos = "photos = ['photo.exr', 'red.exr', 'tiny.exr']\nenvironments = 'map.exr'\n";
    let folder = folder(&format!("{photos}[defaults]\n{QUICK}"));
    assert_eq!(batch(&folder, "out", "--workers 1").code, Some(4));
    assert_eq!(written(&folder), ["photo-map-ggx", "red-map-ggx"]);
    let journal = JournalView::of(&folder.path().join("out"));
    let kept: Vec<String> = journal.column(
        "SELECT DISTINCT label FROM nodes JOIN results ON nodes.key = results.key WHERE bytes IS NOT NULL ORDER BY label",
    );
    assert!(kept.iter().all(|label| label.starts_with("tiny-map-ggx: ")), "{kept:?}");
    assert!(journal.number("SELECT count(*) FROM results WHERE bytes IS NULL") > 0, "nothing was released");
}

#[test]
fn changed_settings_inputs_and_fits_are_refused_and_named() {
    let folder = four();
    kill_at(&folder, |event| event["event"] == "node-finished");
    let refused = |flags: &str, phrase: &str| batch(&folder, "out", flags).refused(&[phrase]);
    refused("--resume --seed 1", "photo-map-ggx: --seed is 0 there and 1 here");
    refused("", "out/summary.json says that a batch was run there already: resume it with --resume");
    let manifest = fs::read_to_string(folder.path().join("batch.toml")).unwrap();
    fs::write(folder.path().join("batch.toml"), manifest.replace("'red.exr'", "'tiny.exr'")).unwrap();
    refused("--resume", "tiny-map-ggx: the photo is not given there and");
    fs::write(folder.path().join("batch.toml"), manifest).unwrap();
    fs::copy(folder.path().join("photo.exr"), folder.path().join("red.exr")).unwrap();
    refused("--resume", "red-map-ggx: the photo is ");
}

#[test]
fn failed_fits_are_retried_on_resume() {
    let folder = folder(&format!("photos = ['photo.exr', 'tiny.exr']\nenvironments = 'map.exr'\n[defaults]\n{QUICK}"));
    assert_eq!(batch(&folder, "out", "--workers 1").code, Some(4));
    let (output, events) = start(&folder, "--workers 1").watch_stderr(|_| ());
    assert_eq!(output.status.code(), Some(4), "{events:?}");
    let started: Vec<&Value> =
        events.iter().filter(|event| event["event"] == "fit-started").map(|event| &event["fit"]).collect();
    assert_eq!(started, ["tiny-map-ggx"]);
    assert_eq!(states(&summary(&folder.path().join("out"))), ["done", "failed"]);
}
