//! A fit whose coordinator is killed at any point and resumed: the same bits, and no node done twice.

use super::scene::{Finished, MANY_NODES, MANY_NODES_FIT, QUICK, QUICK_FIT, fit, folder, without_timing};
use crate::program::Answer;
use lookalike_coordinator::journal::RunLock;
use lookalike_tests::{journal::JournalView, process::Process};
use serde_json::Value;
use std::{fs, path::Path, process::Command};

/// Two shards, the coarse table, two searches, one full table, judging, exploration, polish, pictures: at least 10 nodes; with
/// `--features slow` four shards and six searches, at least 16 nodes.
const WITH_POLISH: &str = if cfg!(feature = "slow") {
    "--model ggx --samples 128 --gammas 1:2:0.2 --seed 5 --workers 2"
} else {
    "--model ggx --samples 64 --gammas 1:2:1 --seed 5 --workers 2"
};

/// The undisturbed fit of [`WITH_POLISH`].
static WHOLE: Finished = Finished::new(WITH_POLISH);

/// After how many finished nodes a fit is killed; 0 is when the first worker joins.
const KILLS: &[usize] = if cfg!(feature = "slow") { &[0, 1, 4, 7, 11, 13] } else { &[1, 7] };

/// Starts a fit and kills it with SIGKILL after this many finished nodes; 0 is when the first worker joins.
fn kill_after(folder: &Path, out: &str, flags: &str, finished: usize) {
    let line = format!("fit photo.exr --env map.exr --out {out} {flags} --progress json --resume");
    let mut command = Command::new(env!("CARGO_BIN_EXE_lookalike-under-test"));
    let command = command.args(line.split_whitespace()).current_dir(folder).env_remove("RUST_LOG");
    let mut process = Process::start(command);
    let mut count = 0;
    let moment = process.stderr_until(|event| {
        count += usize::from(event["event"] == "node-finished");
        let is_moment = if finished == 0 { event["event"] == "worker-joined" } else { count == finished };
        is_moment.then_some(())
    });
    moment.unwrap_or_else(|| panic!("the fit ended after {count} nodes"));
    process.kill();
}

fn resume(folder: &Path, out: &str, flags: &str) -> Answer {
    fit(folder, out, &format!("{flags} --progress none --resume"))
}

fn status(folder: &Path, out: &str) -> Value {
    let answer = crate::program::lookalike(folder, &format!("status {out} --json")).done();
    serde_json::from_str(&answer.stdout).unwrap()
}

#[test]
fn fit_killed_anywhere_and_resumed_gives_the_same_bits_and_repeats_no_node() {
    let folder = folder();
    let out = |name: &str| folder.path().join(name);
    WHOLE.copy_to(&folder.path().join("whole"));
    for &finished in KILLS {
        let name = finished.to_string();
        kill_after(folder.path(), &name, WITH_POLISH, finished);
        let stopped = status(folder.path(), &name);
        assert_eq!((&stopped["state"], &stopped["epoch"]), (&"stopped".into(), &1.into()), "{stopped}");
        assert!(stopped["nodes"]["completed"].as_u64().unwrap() >= finished as u64, "{stopped}");
        let access = fs::read(out(&name).join("access.json")).unwrap();
        resume(folder.path(), &name, WITH_POLISH).done();
        let journal = JournalView::of(&out(&name));
        assert_eq!(journal.run_twice(), 0, "after {finished}");
        let recalled = journal.number("SELECT count(*) FROM node_list WHERE epoch = 2 AND state = 'recalled'");
        assert!(recalled >= finished as u64, "{recalled} after {finished}");
        assert!(fs::read(out(&name).join("access.json")).unwrap() == access, "workers elsewhere have this file");
        assert_eq!(without_timing(&out("whole")), without_timing(&out(&name)), "after {finished}");
        for file in ["match.exr", "match.png", "reference.png", "difference.png", "candidates.csv"] {
            let [whole, resumed] = ["whole", &name].map(|name| fs::read(out(name).join(file)).unwrap());
            assert!(whole == resumed, "{file} after {finished}");
        }
        let done = status(folder.path(), &name);
        assert_eq!((&done["state"], &done["epoch"]), (&"finished".into(), &2.into()), "{done}");
    }
}

#[test]
fn fit_that_is_killed_repeatedly_still_ends() {
    let folder = folder();
    MANY_NODES_FIT.copy_to(&folder.path().join("whole"));
    for _ in 0..3 {
        kill_after(folder.path(), "out", MANY_NODES, 2);
    }
    resume(folder.path(), "out", MANY_NODES).done();
    let out = folder.path().join("out");
    assert_eq!(without_timing(&folder.path().join("whole")), without_timing(&out));
    let journal = JournalView::of(&out);
    assert_eq!((journal.run_twice(), journal.number("SELECT max(epoch) FROM epochs")), (0, 4));
}

#[test]
fn finished_fit_is_verified_and_not_repeated() {
    let folder = QUICK_FIT.copy();
    let out = folder.path().join("out");
    let before = fs::read(out.join("fit.json")).unwrap();
    let again = fit(folder.path(), "out", &format!("{QUICK} --resume --workers 2")).done();
    assert!(
        again.stderr.contains("the run in out is finished, and its results are as it wrote them"),
        "{}",
        again.stderr
    );
    assert!(fs::read(out.join("fit.json")).unwrap() == before);
    let told = fit(folder.path(), "out", &format!("{QUICK} --resume --progress json")).done().stderr;
    let events: Vec<Value> = told.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(events.iter().map(|event| &event["event"]).collect::<Vec<_>>(), ["start", "message", "finished"]);
    // A changed file may be the user's; a missing one is written again.
    fs::write(out.join("candidates.csv"), "mine").unwrap();
    fit(folder.path(), "out", &format!("{QUICK} --resume"))
        .refused(&["candidates.csv is not what the run in out wrote", "--resume makes it again"]);
    let bits = without_timing(&out);
    fs::remove_file(out.join("candidates.csv")).unwrap();
    let mended = fit(folder.path(), "out", &format!("{QUICK} --resume")).done();
    assert!(mended.stderr.contains("candidates.csv is missing: fitting again"), "{}", mended.stderr);
    assert!(out.join("candidates.csv").exists() && without_timing(&out) == bits);
}

#[test]
fn resume_with_other_inputs_or_settings_is_refused_with_the_difference() {
    let folder = QUICK_FIT.copy();
    let refused =
        |flags: &str, phrases: &[&str]| fit(folder.path(), "out", &format!("{QUICK} {flags}")).refused(phrases);
    kill_after(folder.path(), "killed", MANY_NODES, 2);
    fit(folder.path(), "killed", QUICK)
        .refused(&["killed already holds a run that is not finished", "resume it with --resume"]);
    resume(folder.path(), "killed", MANY_NODES).done();
    refused("", &["out already holds a finished fit", "choose another --out"]);
    refused("--resume --seed 3", &["--seed is 0 there and 3 here", "resume with those of that run"]);
    refused("--resume --gammas 1:2:0.25", &["--gammas is 1:2:0.5 there and 1:2:0.25 here"]);
    refused("--resume --env-rotation 90", &["--env-rotation is 0.0 there and 90.0 here"]);
    fs::copy(folder.path().join("map.exr"), folder.path().join("copy.exr")).unwrap();
    // The same content under another name is the same input; the settings of workers do not matter.
    let line = format!("fit photo.exr --env copy.exr --out out {QUICK} --resume --workers 2 --grace 5s");
    crate::program::lookalike(folder.path(), &line).done();
    let line = format!("fit photo.exr --env photo.exr --env-mapping mirror-ball --out out {QUICK} --resume");
    let other = crate::program::lookalike(folder.path(), &line);
    assert_eq!(other.code, Some(2), "{}", other.stderr);
    for phrase in ["other inputs or settings: --env is ", "--env-mapping is latlong there and mirror-ball here"] {
        assert!(other.stderr.contains(phrase), "{}", other.stderr);
    }
}

#[test]
fn second_coordinator_in_one_folder_is_refused_with_the_process_id_of_the_first() {
    let folder = folder();
    let out = folder.path().join("out");
    fs::create_dir(&out).unwrap();
    let lock = RunLock::take(&out).unwrap();
    let who = format!("process {} on ", std::process::id());
    for flags in [QUICK.to_owned(), format!("{QUICK} --resume")] {
        fit(folder.path(), "out", &flags).refused(&["another coordinator is running in out", &who]);
    }
    drop(lock);
    fit(folder.path(), "out", &format!("{QUICK} --gammas 1")).done();
}

#[test]
fn file_that_is_not_a_journal_is_refused() {
    let folder = folder();
    fs::create_dir(folder.path().join("out")).unwrap();
    fs::write(folder.path().join("out/run.sqlite"), "a letter to somebody".repeat(100)).unwrap();
    fit(folder.path(), "out", &format!("{QUICK} --resume")).refused(&["run.sqlite is not the journal of a run"]);
    let status = crate::program::lookalike(folder.path(), "status out");
    status.refused(&["run.sqlite is not the journal of a run"]);
    crate::program::lookalike(folder.path(), "status nowhere").refused(&["expected a run in nowhere"]);
}

/// A small file system, unmounted on drop.
struct SmallDisk<'a>(&'a Path);

impl<'a> SmallDisk<'a> {
    /// `None` where it cannot be made.
    fn mount(folder: &'a Path, size: &str) -> Option<Self> {
        fs::create_dir_all(folder).unwrap();
        let options = format!("size={size}");
        let mut command = Command::new("mount");
        let mounted = command.args(["-t", "tmpfs", "-o", &options, "none"]).arg(folder).output();
        mounted.is_ok_and(|output| output.status.success()).then_some(Self(folder))
    }

    fn grow(&self, size: &str) {
        let options = format!("remount,size={size}");
        assert!(Command::new("mount").args(["-o", &options]).arg(self.0).status().unwrap().success());
    }
}

impl Drop for SmallDisk<'_> {
    fn drop(&mut self) {
        // If a file on it is still open, removing the folder fails and shows it.
        let _ = Command::new("umount").arg(self.0).status();
    }
}

#[test]
fn full_disk_ends_the_run_with_its_name_and_loses_no_acknowledged_node() {
    let folder = folder();
    let small = folder.path().join("small");
    let Some(disk) = SmallDisk::mount(&small, "400k") else {
        println!("skipped: cannot mount a small file system here (needs root)");
        return;
    };
    MANY_NODES_FIT.copy_to(&folder.path().join("whole"));
    let full = resume(folder.path(), "small/out", MANY_NODES);
    assert_eq!(full.code, Some(3), "{}", full.stderr);
    for phrase in ["cannot write the journal small/out/run.sqlite: the disk is full", "resume with --resume"] {
        assert!(full.stderr.contains(phrase), "{}", full.stderr);
    }
    disk.grow("64m");
    resume(folder.path(), "small/out", MANY_NODES).done();
    let out = small.join("out");
    let journal = JournalView::of(&out);
    assert_eq!(journal.run_twice(), 0);
    assert_eq!(without_timing(&folder.path().join("whole")), without_timing(&out));
    drop(journal);
}
