//! How a fit ends when it fails: exit codes, messages, and no process left.

use super::scene::{QUICK, QUICK_POLISHED, fit, folder, folder_of_size};
use lookalike_tests::{
    journal::JournalView,
    process::{Process, signal},
};
use serde_json::Value;
use std::{fs, process::Command};

#[test]
fn missed_max_cssim_is_code_one_with_all_results_written() {
    let folder = folder_of_size(20);
    let answer = fit(folder.path(), "out", &format!("{QUICK_POLISHED} --gammas 1 --max-cssim 0"));
    assert_eq!(answer.code, Some(1), "{}", answer.stderr);
    assert!(answer.stderr.contains("more than --max-cssim 0"), "{}", answer.stderr);
    assert!(answer.stdout.contains("polished") && folder.path().join("out/fit.json").exists());
    fit(folder.path(), "met", &format!("{QUICK} --gammas 1 --max-cssim 1")).done();
}

#[test]
fn finished_event_is_sent_when_all_is_written() {
    let folder = folder();
    let mut command = Command::new(env!("CARGO_BIN_EXE_lookalike-under-test"));
    let line = format!("fit photo.exr --env map.exr --out out {QUICK} --progress json");
    let process = Process::start(command.args(line.split_whitespace()).current_dir(folder.path()));
    let finished = "SELECT count(*) FROM run WHERE outputs IS NOT NULL";
    let mut is_written = None;
    let (output, events) = process.watch_stderr(|events| {
        if events.last().is_some_and(|event| event["event"] == "finished") {
            let out = folder.path().join("out");
            is_written = Some(out.join("fit.json").exists() && JournalView::of(&out).number(finished) == 1);
        }
    });
    assert_eq!((output.status.code(), is_written), (Some(0), Some(true)), "{events:?}");
}

#[test]
fn unwritable_results_are_code_three_and_are_written_on_resume() {
    let folder = folder();
    // Before the run it would be refused.
    let blocked = folder.path().join("out/match.exr.partial");
    let mut command = Command::new(env!("CARGO_BIN_EXE_lookalike-under-test"));
    let line = format!("fit photo.exr --env map.exr --out out {QUICK} --progress json");
    let process = Process::start(command.args(line.split_whitespace()).current_dir(folder.path()));
    let (output, events) = process.watch_stderr(|events| {
        if events.last().is_some_and(|event| event["event"] == "node-started") {
            fs::create_dir_all(&blocked).unwrap();
        }
    });
    assert_eq!(output.status.code(), Some(3), "{events:?}");
    let told = "cannot write out/match.exr: is the disk full?";
    assert!(events.iter().any(|event| event.as_str().is_some_and(|line| line.contains(told))), "{events:?}");
    fs::remove_dir(blocked).unwrap();
    fit(folder.path(), "out", &format!("{QUICK} --resume")).done();
    assert!(folder.path().join("out/fit.json").exists());
}

#[test]
fn folder_of_a_finished_fit_is_refused_and_unchanged() {
    let folder = folder();
    fs::create_dir(folder.path().join("out")).unwrap();
    fs::write(folder.path().join("out/fit.json"), "precious").unwrap();
    fit(folder.path(), "out", QUICK).refused(&["out already holds a finished fit", "choose another --out"]);
    assert_eq!(fs::read_to_string(folder.path().join("out/fit.json")).unwrap(), "precious");
}

#[test]
fn output_folder_that_cannot_be_created_is_refused_before_any_work() {
    let folder = folder();
    // Below a file: not even root can write there.
    fit(folder.path(), "photo.exr/below", QUICK)
        .refused(&["cannot write results to photo.exr/below", "choose a folder you may write to with --out"]);
    fit(folder.path(), "photo.exr", QUICK).refused(&["photo.exr is a file: --out takes a folder"]);
}

#[test]
fn unknown_model_is_refused_with_a_list_of_models() {
    let folder = folder();
    let answer = fit(folder.path(), "out", &format!("{QUICK} --model phong"));
    answer.refused(&["--model", "phong", "ggx, ggx-haze, cook-torrance"]);
    assert!(!folder.path().join("out").exists());
}

#[test]
fn interrupt_ends_every_process_with_code_130() {
    for (name, kind) in [("INT", "transport"), ("TERM", "search")] {
        let folder = folder();
        let mut command = Command::new(env!("CARGO_BIN_EXE_lookalike-under-test"));
        let line = "fit photo.exr --env map.exr --out out --samples 160 --workers 2 --progress json";
        let process = Process::start(command.args(line.split_whitespace()).current_dir(folder.path()));
        let coordinator = process.id();
        let mut sent = false;
        // Workers share stderr with the coordinator, so the stream ends after the last process.
        let (output, events) = process.watch_stderr(|events| {
            let started = |e: &Value| e["event"] == "node-started" && e["kind"] == kind;
            if !sent && events.last().is_some_and(started) {
                sent = true;
                signal(coordinator, name);
            }
        });
        assert!(sent, "{events:?}");
        assert_eq!(output.status.code(), Some(130), "{name}: {events:?}");
        assert!(output.stdout.is_empty() && !folder.path().join("out/fit.json").exists());
        let said = events.iter().any(|e| e.as_str().is_some_and(|line| line.contains("interrupted")));
        assert!(said, "{events:?}");
        let twice = events.iter().any(|e| e.as_str().is_some_and(|line| line.contains("caused by: interrupted")));
        assert!(!twice, "{events:?}");
    }
}

#[test]
fn local_workers_use_the_log_filter_of_the_coordinator() {
    let folder = folder();
    let joined = "INFO lookalike_worker::session: joined";
    let flags = format!("{QUICK} --gammas 1");
    let quiet = fit(folder.path(), "quiet", &flags).done();
    assert!(!quiet.stderr.contains(joined), "{}", quiet.stderr);
    let loud = fit(folder.path(), "loud", &format!("{flags} --log lookalike_worker=info")).done();
    assert!(loud.stderr.contains(joined), "{}", loud.stderr);
}
