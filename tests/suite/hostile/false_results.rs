//! Workers of a real fit whose results are wrong by one bit: which are detected, and which are not (docs/security.md).

use std::path::Path;
use std::process::Command;

use lookalike_tests::process::{Process, stderr};

use super::PROGRAM;
use crate::fit::scene::{fit, folder, folder_of_size, without_timing};

/// Few nodes, so that the false worker is assigned some.
const FLAGS: &str = "--model ggx --samples 32 --gammas 1:2:0.5 --seed 5 --polish off --progress json";

/// A fit with a worker that returns wrong results of this kind of node, and possibly an honest one: its exit code and output.
fn fit_with_false_worker(folder: &Path, kind: &str, flags: &str, has_honest: bool) -> (Option<i32>, String) {
    let line = format!("fit photo.exr --env map.exr --out {kind} {FLAGS} --workers 0 --listen 127.0.0.1:0 {flags}");
    let mut command = Command::new(env!("CARGO_BIN_EXE_lookalike-under-test"));
    let mut process = Process::start(command.args(line.split_whitespace()).current_dir(folder).env_remove("RUST_LOG"));
    let lines = process.follow_stderr(std::io::sink());
    let mut said = String::new();
    let mut workers = Vec::new();
    for line in lines {
        said += &format!("{line}\n");
        if line["event"] == "listening" {
            let access = folder.join(kind).join("access.json");
            workers.push(Process::start(Command::new(PROGRAM).args(["false-worker", kind, "--access"]).arg(&access)));
            if has_honest {
                let program = env!("CARGO_BIN_EXE_lookalike-worker-under-test");
                workers.push(Process::start(Command::new(program).arg("--access").arg(&access)));
            }
        }
    }
    let output = process.output();
    (output.status.code(), said + &stderr(&output))
}

#[test]
fn wrong_result_of_a_search_is_always_detected() {
    let folder = folder();
    let (code, said) = fit_with_false_worker(folder.path(), "search", "", false);
    assert_eq!(code, Some(3), "{said}");
    assert!(said.contains("the result of search ") && said.contains(" from worker 1 is wrong"), "{said}");
}

#[test]
fn wrong_table_is_detected_if_all_outputs_are_verified() {
    let folder = folder();
    let (code, said) = fit_with_false_worker(folder.path(), "transport", "--verify-fraction 1", true);
    assert_eq!(code, Some(3), "{said}");
    assert!(said.contains("two results of transport ") && said.contains(" differ ("), "{said}");
}

#[test]
fn wrong_table_is_not_detected_without_verification_as_the_threat_model_states() {
    // On fewer pixels the bit that is wrong is rounded away.
    let folder = folder_of_size(48);
    let (code, said) = fit_with_false_worker(folder.path(), "transport-full", "--verify-fraction 0", false);
    assert_eq!(code, Some(0), "{said}");
    fit(folder.path(), "honest", &format!("{FLAGS} --workers 1")).done();
    let [honest, spoilt] = ["honest", "transport-full"].map(|name| without_timing(&folder.path().join(name)));
    assert_ne!(honest, spoilt, "the lie had no effect: the test proves nothing");
}
