//! Fits in the output folder that the batch did not write: neither taken for its results nor replaced.

use super::{QUICK, batch, folder, states, summary};
use crate::program::lookalike;
use std::{fs, path::Path};
use tempfile::TempDir;

const NAMES: [&str; 2] = ["photo-map-ggx", "red-map-ggx"];

/// A single fit, with settings that differ from those of the batch.
fn alone(folder: &TempDir, out: &str) {
    let flags = "--samples 16 --gammas 1 --polish off --workers 1 --progress none";
    lookalike(folder.path(), &format!("fit photo.exr --env map.exr --out {out} {flags}")).done();
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
    let photos = "photos = ['photo.exr', 'red.exr']\nenvironments = 'map.exr'\n";
    let folder = folder(&format!("{photos}[defaults]\n{QUICK}"));
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
    // The second fit fails, so the journal does not have it as written however fast the first is.
    let [written, open] = ["photo-map-ggx", "tiny-map-ggx"];
    let photos = "photos = ['photo.exr', 'tiny.exr']\nenvironments = 'map.exr'\n";
    let folder = folder(&format!("{photos}[defaults]\n{QUICK}"));
    assert_eq!(batch(&folder, "out", "--workers 1").code, Some(4));
    alone(&folder, "alone");
    let at = |name: &str| folder.path().join("out").join(name);
    copy(&folder.path().join("alone"), &at(open), &FILES);
    copy(&folder.path().join("alone"), &at(open), &["run.sqlite"]);
    batch(&folder, "out", "--resume").refused(&[&format!("out/{open} holds a fit that is not of this run")]);
    fs::remove_file(at(open).join("run.sqlite")).unwrap();
    let kept = fs::read(at(written).join("match.exr")).unwrap();
    fs::write(at(written).join("match.exr"), "mine").unwrap();
    batch(&folder, "out", "--resume")
        .refused(&[&format!("{written}/match.exr is not what the run in out wrote; keep a changed file elsewhere")]);
    fs::write(at(written).join("match.exr"), &kept).unwrap();
    // A fit that the run did not write is refused even without a journal.
    let foreign = fs::read(at(open).join("fit.json")).unwrap();
    batch(&folder, "out", "--resume").refused(&[&format!("out/{open} holds a fit that is not of this run")]);
    assert!(fs::read(at(open).join("fit.json")).unwrap() == foreign);
    fs::remove_dir_all(at(open)).unwrap();
    assert_eq!(batch(&folder, "out", "--resume --workers 1").code, Some(4));
    assert_eq!(states(&summary(&folder.path().join("out"))), ["done", "failed"]);
    assert!(fs::read(at(written).join("match.exr")).unwrap() == kept);
}
