//! A fit whose coordinator and workers were all killed, as by a power failure, and whose journal was truncated or damaged.

use std::fs;
use std::path::Path;
use std::process::Command;

use lookalike_tests::journal::{JournalView, damage_an_output, tear};
use lookalike_tests::process::{Process, kill_if_alive};

use super::random::FILES;
use crate::fit::scene::{MANY_NODES as FLAGS, MANY_NODES_FIT, fit, folder, without_timing};

/// Kill a fit and its workers after this many finished nodes.
fn kill_all_after(folder: &Path, out: &str, finished: usize) {
    let line = format!("fit photo.exr --env map.exr --out {out} {FLAGS} --progress json");
    let mut command = Command::new(env!("CARGO_BIN_EXE_lookalike-under-test"));
    let mut process = Process::start(command.args(line.split_whitespace()).current_dir(folder).env_remove("RUST_LOG"));
    let (mut count, mut workers) = (0, Vec::new());
    let moment = process.stderr_until(|event| {
        if event["event"] == "worker-joined" {
            workers.push(u32::try_from(event["process"].as_u64().expect("a process")).expect("its number"));
        }
        count += usize::from(event["event"] == "node-finished");
        (count == finished).then_some(())
    });
    moment.unwrap_or_else(|| panic!("the fit ended after {count} nodes"));
    process.kill();
    workers.into_iter().for_each(kill_if_alive);
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        fs::copy(entry.path(), to.join(entry.file_name())).unwrap();
    }
}

#[track_caller]
fn assert_same(whole: &Path, out: &Path, what: &str) {
    assert_eq!(without_timing(whole), without_timing(out), "{what}");
    for file in FILES {
        assert!(fs::read(whole.join(file)).unwrap() == fs::read(out.join(file)).unwrap(), "{file}, {what}");
    }
}

#[test]
fn truncated_or_damaged_journal_loses_only_its_lost_records() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    MANY_NODES_FIT.copy_to(&at("whole"));
    kill_all_after(folder.path(), "killed", 9);
    let resume = |out: &str| fit(folder.path(), out, &format!("{FLAGS} --progress none --resume")).done();
    // The shares of the log that remain; the largest lacks one byte.
    let shares = if cfg!(feature = "slow") { (0..20).map(|n| f64::from(n) / 19.0).collect() } else { vec![0.0, 0.6] };
    let mut recalled = Vec::new();
    for (index, share) in shares.into_iter().enumerate() {
        let out = format!("torn{index}");
        copy(&at("killed"), &at(&out));
        let left = tear(&at(&out), share);
        resume(&out);
        assert_same(&at("whole"), &at(&out), &format!("{left} bytes of the log"));
        let journal = JournalView::of(&at(&out));
        // However much is lost, the number of a coordinator is never used again: workers may still answer to it.
        assert_eq!(journal.number("SELECT max(epoch) FROM epochs"), 2, "{left} bytes of the log");
        assert_eq!(journal.run_twice(), 0, "{left} bytes of the log");
        recalled.push(journal.number("SELECT count(*) FROM node_list WHERE epoch = 2 AND state = 'recalled'"));
    }
    assert!(recalled.is_sorted() && recalled.last() > recalled.first(), "{recalled:?}");
    copy(&at("killed"), &at("damaged"));
    assert!(damage_an_output(&at("damaged"), 3));
    let resumed = resume("damaged");
    assert!(resumed.stderr.contains("is damaged: its node runs again"), "{}", resumed.stderr);
    assert_same(&at("whole"), &at("damaged"), "damaged");
}
