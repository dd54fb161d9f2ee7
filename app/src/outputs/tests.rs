//! Which files a run may replace: each case of the table in `claim`.

use super::{BATCH_MARK, Claim, ClaimedFolder, FIT_FILES, OutFolder};
use crate::settings::OldFiles;
use std::{fs, path::Path};
use tempfile::TempDir;

const DEMO: &str = r#"{ "inputs": { "photo": { "path": "photo.exr", "generated": true } } }"#;
const FIT: &str = r#"{ "inputs": { "photo": { "path": "ball.exr" } } }"#;

fn folder(files: &[(&str, &str)]) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in files {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }
    folder
}

fn fit(out: &Path, old: OldFiles) -> Claim<'_> {
    Claim::of_fit(out, old)
}

fn demo(out: &Path, old: OldFiles) -> Claim<'_> {
    let files = FIT_FILES.into_iter().chain(["strip.png"]).collect();
    Claim { command: "demo", files, ..fit(out, old) }
}

fn begin(claim: &Claim<'_>) -> OutFolder {
    ClaimedFolder::take(claim).unwrap().begin().unwrap()
}

#[track_caller]
fn refused(claim: &Claim<'_>, phrases: &[&str]) {
    for error in [claim.check().unwrap_err(), ClaimedFolder::take(claim).unwrap_err()] {
        let text = error.to_string();
        phrases.iter().for_each(|phrase| assert!(text.contains(phrase), "expected {phrase:?} in: {text}"));
    }
}

#[test]
fn file_of_the_users_is_refused_by_name_and_forced_away() {
    let folder = folder(&[("candidates.csv", "mine"), ("reference.png", "mine"), ("notes.txt", "mine")]);
    let out = folder.path();
    refused(&fit(out, OldFiles::Refuse), &["2 problems", "candidates.csv already exists", "reference.png", "--force"]);
    refused(&fit(out, OldFiles::Resume), &["candidates.csv is not a file of this run", "choose another --out"]);
    refused(&demo(out, OldFiles::ReplaceDemo), &["holds files that are not from a demo (candidates.csv)", "--force"]);
    assert_eq!(fs::read(out.join("reference.png")).unwrap(), b"mine");
    let folder = begin(&fit(out, OldFiles::Replace));
    folder.write("candidates.csv", b"ours").unwrap();
    assert!(!out.join("reference.png").exists() && out.join("notes.txt").exists());
}

#[test]
fn demo_replaces_demos_only() {
    for text in [FIT, "no JSON"] {
        let folder = folder(&[("fit.json", text), ("match.exr", "")]);
        refused(&demo(folder.path(), OldFiles::ReplaceDemo), &["holds files that are not from a demo (fit.json)"]);
    }
    let unfinished = folder(&[("run.sqlite", "")]);
    refused(&demo(unfinished.path(), OldFiles::ReplaceDemo), &["holds files that are not from a demo (run.sqlite)"]);
    // A demo from a version without ledgers.
    let old = folder(&[("fit.json", DEMO), ("strip.png", "old"), ("run.sqlite", "")]);
    let out = begin(&demo(old.path(), OldFiles::ReplaceDemo));
    assert!(!old.path().join("fit.json").exists() && !old.path().join("run.sqlite").exists());
    // An interrupted demo, then one with a changed file.
    out.write("strip.png", b"new").unwrap();
    drop(out);
    drop(begin(&demo(old.path(), OldFiles::ReplaceDemo)));
    fs::write(old.path().join("strip.png"), "mine").unwrap();
    fs::write(old.path().join("fit.json"), DEMO).unwrap();
    refused(&demo(old.path(), OldFiles::ReplaceDemo), &["strip.png is not a file of this run"]);
    drop(begin(&demo(old.path(), OldFiles::Replace)));
}

#[test]
fn files_that_another_run_wrote_are_removed_only_with_the_bytes_that_its_ledger_records() {
    type Next = fn(&Path) -> Claim<'_>;
    let next: [Next; 2] = [|out| demo(out, OldFiles::ReplaceDemo), |out| fit(out, OldFiles::Replace)];
    for next in next {
        let folder = folder(&[]);
        let at = |name: &str| folder.path().join(name);
        let out = begin(&demo(folder.path(), OldFiles::ReplaceDemo));
        out.write("old.png", b"ours").unwrap();
        out.write("notes.txt", b"ours").unwrap();
        drop(out);
        fs::write(at("notes.txt"), "mine").unwrap();
        drop(begin(&next(folder.path())));
        assert!(!at("old.png").exists() && at("notes.txt").exists());
    }
}

#[test]
fn demo_refuses_the_files_of_a_batch_whose_journal_is_gone() {
    let folder = folder(&[]);
    let batch = Claim { command: "batch", fits: vec!["a"], ..fit(folder.path(), OldFiles::Refuse) };
    begin(&batch).write("report.txt", b"ours").unwrap();
    fs::remove_file(folder.path().join("run.sqlite")).ok();
    refused(&demo(folder.path(), OldFiles::ReplaceDemo), &["holds files that are not from a demo (run.written)"]);
    assert!(folder.path().join("report.txt").exists());
}

#[test]
fn nothing_outside_the_folder_is_removed() {
    let folder = folder(&[("mine", "precious")]);
    let (out, mine) = (folder.path().join("out"), folder.path().join("mine"));
    fs::create_dir(&out).unwrap();
    for name in ["../mine", mine.to_str().unwrap()] {
        for command in ["fit", "demo"] {
            fs::write(out.join("run.written"), format!("# lookalike {command}\nab  {name}\n")).unwrap();
            refused(&fit(&out, OldFiles::Replace), &["run.written lists", "choose another --out"]);
            refused(&demo(&out, OldFiles::ReplaceDemo), &["run.written lists"]);
        }
    }
    assert_eq!(fs::read(mine).unwrap(), b"precious");
}

#[test]
fn input_is_never_replaced() {
    let folder = folder(&[("own/match.exr", "photo"), ("own/fit.json", FIT)]);
    let (out, photo) = (folder.path().join("own"), folder.path().join("own/../own/match.exr"));
    for old in [OldFiles::Refuse, OldFiles::Resume, OldFiles::Replace] {
        let claim = Claim { inputs: vec![&photo], ..fit(&out, old) };
        refused(&claim, &["match.exr is an input of this run", "choose another --out"]);
    }
    assert_eq!(fs::read(&photo).unwrap(), b"photo");
    // A fit writes no file of the photo's name, but with --force it would remove the demo's file.
    let out = folder.path().join("demo");
    begin(&demo(&out, OldFiles::ReplaceDemo)).write("strip.png", b"photo").unwrap();
    let photo = out.join("strip.png");
    refused(&Claim { inputs: vec![&photo], ..fit(&out, OldFiles::Replace) }, &["strip.png is an input of this run"]);
}

#[cfg(unix)]
#[test]
fn links_are_neither_followed_nor_replaced() {
    use std::os::unix::fs::symlink;
    for name in ["match.png", "match.png.partial", "run.lock", "run.sqlite", "status.json", "access.json"] {
        for old in [OldFiles::Refuse, OldFiles::Resume, OldFiles::Replace, OldFiles::ReplaceDemo] {
            let folder = folder(&[("mine", "precious")]);
            let out = folder.path().join("out");
            fs::create_dir(&out).unwrap();
            symlink(folder.path().join("mine"), out.join(name)).unwrap();
            let claim = if old == OldFiles::ReplaceDemo { demo(&out, old) } else { fit(&out, old) };
            refused(&claim, &[name, "choose another"]);
            assert_eq!(fs::read(folder.path().join("mine")).unwrap(), b"precious");
        }
    }
    let folder = folder(&[("elsewhere/fit.json", ""), ("batch/notes.txt", "")]);
    symlink(folder.path().join("elsewhere"), folder.path().join("batch/a")).unwrap();
    let batch = folder.path().join("batch");
    let claim = Claim { command: "batch", fits: vec!["a"], ..fit(&batch, OldFiles::Replace) };
    refused(&claim, &["a is a symbolic link"]);
    let out = begin(&fit(&folder.path().join("out"), OldFiles::Refuse));
    symlink(folder.path().join("elsewhere"), folder.path().join("out/cells")).unwrap();
    assert!(out.sub("cells").unwrap_err().to_string().contains("is a symbolic link"));
}

#[test]
fn resumed_run_replaces_only_files_that_it_wrote() {
    let folder = folder(&[]);
    let out = begin(&fit(folder.path(), OldFiles::Refuse));
    out.write("match.png", b"one").unwrap();
    out.write("match.png", b"two").unwrap();
    fs::write(folder.path().join("match.exr"), "mine").unwrap();
    let error = out.write("match.exr", b"ours").unwrap_err().to_string();
    assert!(error.starts_with("match.exr is not what the run in "), "{error}");
    drop(out);
    fs::write(folder.path().join("run.sqlite"), "").unwrap();
    refused(&fit(folder.path(), OldFiles::Resume), &["match.exr is not what the run in", "--resume makes it again"]);
    fs::remove_file(folder.path().join("match.exr")).unwrap();
    // The process was killed while it wrote: the file has its older version, or a draft is left.
    fs::write(folder.path().join("match.png"), "one").unwrap();
    fs::write(folder.path().join("match.exr.partial"), "ha").unwrap();
    let out = begin(&fit(folder.path(), OldFiles::Resume));
    out.write("match.png", b"two").unwrap();
    out.write("match.exr", b"half").unwrap();
    assert!(!folder.path().join("match.exr.partial").exists());
    refused_as_unfinished(folder.path());
}

#[track_caller]
fn refused_as_unfinished(out: &Path) {
    refused_while_locked(&fit(out, OldFiles::Refuse), "already holds a run that is not finished (run.sqlite)");
}

#[track_caller]
fn refused_while_locked(claim: &Claim<'_>, phrase: &str) {
    let text = claim.check().unwrap_err().to_string();
    assert!(text.contains(phrase), "{text}");
}

#[test]
fn files_beside_a_journal_are_replaced_only_where_a_run_has_begun() {
    const NAMES: [&str; 7] = [
        "run.sqlite-wal",
        "run.sqlite-shm",
        "run.sqlite-journal",
        "run.sqlite.new",
        "run.sqlite.new-wal",
        "run.sqlite.new-shm",
        "run.sqlite.new-journal",
    ];
    for name in NAMES {
        let folder = folder(&[(name, "mine")]);
        let out = folder.path();
        refused(&fit(out, OldFiles::Refuse), &[name, "already exists", "--force"]);
        refused(&fit(out, OldFiles::Resume), &[name, "is not a file of this run"]);
        refused(&demo(out, OldFiles::ReplaceDemo), &["holds files that are not from a demo", name]);
        fs::write(out.join("run.sqlite"), "").unwrap();
        refused(&fit(out, OldFiles::Resume), &[name, "is not a file of this run"]);
        assert_eq!(fs::read(out.join(name)).unwrap(), b"mine");
        drop(begin(&fit(out, OldFiles::Replace)));
        assert!(!out.join(name).exists());
        // Left by a process that was killed, before its journal was in place and after.
        fs::write(out.join(name), "ours").unwrap();
        drop(begin(&fit(out, OldFiles::Refuse)));
        fs::write(out.join("run.sqlite"), "").unwrap();
        drop(begin(&fit(out, OldFiles::Resume)));
        assert!(out.join(name).exists());
    }
}

#[test]
fn batch_refuses_the_folder_of_another_fit() {
    let folder = folder(&[("a/fit.json", FIT), ("b/run.sqlite", ""), ("c/match.png", ""), ("d/notes.txt", "")]);
    let claim = |old| Claim {
        command: "batch",
        files: vec!["summary.csv", BATCH_MARK],
        fits: vec!["a", "b", "c", "d"],
        ..fit(folder.path(), old)
    };
    for old in [OldFiles::Refuse, OldFiles::Resume] {
        let phrases = ["3 problems", "/a holds a fit that is not of this run", "/b holds a fit", "c/match.png"];
        refused(&claim(old), &phrases);
    }
    let claim_e = |old| Claim { fits: vec!["e"], ..claim(old) };
    fs::write(folder.path().join("e"), "mine").unwrap();
    for old in [OldFiles::Refuse, OldFiles::Resume, OldFiles::Replace] {
        refused(&claim_e(old), &["/e is not a file of this run"]);
    }
    let out = begin(&claim(OldFiles::Replace));
    out.sub("a").unwrap().write("fit.json", b"{}").unwrap();
    assert!(folder.path().join("b/run.sqlite").exists() && !folder.path().join("c/match.png").exists());
}

#[test]
fn folder_in_the_place_of_a_draft_is_found_before_any_work() {
    let folder = folder(&[("match.exr.partial/mine", "")]);
    for old in [OldFiles::Refuse, OldFiles::Resume, OldFiles::Replace] {
        refused(&fit(folder.path(), old), &["match.exr.partial is a folder"]);
    }
}

#[test]
fn fit_begun_where_a_demo_died_is_no_demo() {
    let folder = folder(&[]);
    drop(begin(&demo(folder.path(), OldFiles::Refuse)));
    drop(begin(&fit(folder.path(), OldFiles::Resume)));
    fs::write(folder.path().join("run.sqlite"), "").unwrap();
    refused_while_locked(&demo(folder.path(), OldFiles::ReplaceDemo), "run.sqlite");
    // Its journal is there, so it is the same run.
    drop(begin(&fit(folder.path(), OldFiles::Resume)));
}

#[test]
fn study_refuses_the_cells_of_another() {
    let folder = folder(&[("cells/x.json", "")]);
    let claim = |old| Claim { command: "study", files: Vec::new(), folders: vec!["cells"], ..fit(folder.path(), old) };
    refused(&claim(OldFiles::Refuse), &["cells is a folder, where this run writes"]);
    refused(&claim(OldFiles::Replace), &["cells holds files that no run in this folder wrote"]);
}
