//! `lookalike batch --slurm` and `lookalike study --slurm` from end to end, with a stand-in for `sbatch`.

use crate::fit::scene::folder;
use lookalike::brdf::{Ggx, Material};
use lookalike_tests::merl;
use std::{fs, os::unix::fs::PermissionsExt, path::Path, process::Command};
use tempfile::TempDir;

/// A folder with a scene, a manifest of two fits, and this script as `sbatch`.
fn site(sbatch: &str) -> TempDir {
    let folder = folder();
    let manifest = "photos = [\"photo.exr\"]\nenvironments = [\"map.exr\"]\nmodels = [\"ggx\", \"cook-torrance\"]\n";
    fs::write(folder.path().join("two.toml"), manifest).unwrap();
    let study = "materials = [\"paint.binary\"]\nprobes = [\"map.exr\"]\n";
    fs::write(folder.path().join("study.toml"), study).unwrap();
    let paint = Material::new(&Ggx, vec![0.3, 0.12, 0.08, 0.05, 0.05, 0.05, 1.0, 0.25]).unwrap();
    fs::write(folder.path().join("paint.binary"), merl::file_of(&paint)).unwrap();
    let path = folder.path().join("sbatch");
    fs::write(&path, format!("#!/bin/sh\nPATH=/usr/bin:/bin\n{sbatch}\n")).unwrap();
    fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
    folder
}

/// Exit code, stdout and stderr of a command line. Only the site's `sbatch` can be found, whatever is installed here.
fn say(site: &Path, line: &str) -> (Option<i32>, String, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lookalike-under-test"));
    command.args(line.split_whitespace()).current_dir(site).env("PATH", site).env_remove("RUST_LOG");
    let output = command.output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (output.status.code(), text(output.stdout), text(output.stderr))
}

#[test]
fn batch_is_submitted_with_its_command_line_and_the_options_behind_the_dashes() {
    let site = site("echo 4711");
    let line = "batch two.toml --out run --samples 32 --slurm -- --nodes=2 -p long";
    let (code, stdout, stderr) = say(site.path(), line);
    assert_eq!((code, stdout.as_str()), (Some(0), "4711\n"), "{stderr}");
    assert!(stderr.contains("lookalike status") && stderr.contains("scancel 4711"), "{stderr}");
    let script = fs::read_to_string(site.path().join("run/lookalike.sbatch")).unwrap();
    assert!(script.contains("\n#SBATCH --nodes=2 -p long\n"), "{script}");
    assert!(script.contains("\nset -- batch two.toml --out run --samples 32\n"), "{script}");
    // No job runs yet: the same batch may be submitted again.
    assert_eq!(say(site.path(), line).0, Some(0));
}

#[test]
fn study_is_submitted_like_a_batch() {
    let site = site("echo 4711");
    let (code, stdout, stderr) = say(site.path(), "study study.toml -o run --slurm -- --nodes=2");
    assert_eq!((code, stdout.as_str()), (Some(0), "4711\n"), "{stderr}");
    let script = fs::read_to_string(site.path().join("run/lookalike.sbatch")).unwrap();
    assert!(script.contains("\n#SBATCH --nodes=2\n"), "{script}");
    assert!(script.contains("\nset -- study study.toml -o run\n"), "{script}");
}

#[test]
fn force_is_carried_out_at_submission_and_is_not_in_the_job() {
    let site = site("echo 4711");
    let at = |name: &str| site.path().join("run").join(name);
    for (line, result) in [("batch two.toml", "summary.csv"), ("study study.toml", "report.html")] {
        fs::create_dir_all(at("")).unwrap();
        for name in [result, "run.sqlite", "notes.txt"] {
            fs::write(at(name), "old").unwrap();
        }
        let (code, _, stderr) = say(site.path(), &format!("{line} --out run --slurm"));
        assert!(code == Some(2) && stderr.contains("--force"), "{stderr}");
        // Nothing is removed if the inputs have a mistake.
        fs::rename(site.path().join("map.exr"), site.path().join("moved.exr")).unwrap();
        let (code, _, stderr) = say(site.path(), &format!("{line} --out run --slurm --force"));
        assert!(code == Some(2) && at(result).exists() && at("run.sqlite").exists(), "{stderr}");
        fs::rename(site.path().join("moved.exr"), site.path().join("map.exr")).unwrap();
        let (code, stdout, stderr) = say(site.path(), &format!("{line} --out run --slurm --force"));
        assert_eq!((code, stdout.as_str()), (Some(0), "4711\n"), "{stderr}");
        assert!(!at(result).exists() && !at("run.sqlite").exists() && at("notes.txt").exists());
        let script = fs::read_to_string(at("lookalike.sbatch")).unwrap();
        assert!(script.contains(&format!("\nset -- {line} --out run\n")), "{script}");
        fs::remove_dir_all(at("")).unwrap();
    }
}

/// A job that would not be accepted, a foreign file in the place of its script, and a machine without Slurm.
#[test]
fn force_removes_nothing_if_the_job_cannot_be_submitted() {
    let refusing = site("echo 'sbatch: error: invalid partition specified: gold' >&2; exit 1");
    let foreign = site("echo 4711");
    let without = site("");
    fs::remove_file(without.path().join("sbatch")).unwrap();
    let cases = [
        (&refusing, "invalid partition"),
        (&foreign, "is not a job script of this program"),
        (&without, "cannot find sbatch"),
    ];
    for (site, words) in cases {
        let at = |name: &str| site.path().join("run").join(name);
        fs::create_dir_all(at("")).unwrap();
        fs::write(at("summary.csv"), "old").unwrap();
        if words.contains("job script") {
            fs::write(at("lookalike.sbatch"), "mine").unwrap();
        }
        let (code, stdout, stderr) = say(site.path(), "batch two.toml --out run --slurm --force");
        assert!(code != Some(0) && stdout.is_empty() && stderr.contains(words), "{stderr}");
        assert_eq!(fs::read_to_string(at("summary.csv")).unwrap(), "old");
    }
}

#[test]
fn mistakes_are_reported_before_anything_is_submitted() {
    let site = site("touch submitted; echo 4711");
    for (line, words) in [
        ("batch two.toml --out run --slurm --workers 3", "--workers"),
        ("batch two.toml --out run --slurm --access a.json", "--access"),
        ("batch two.toml --out run -- --nodes=4", "--slurm"),
        ("batch missing.toml --out run --slurm", "missing.toml"),
        ("study study.toml --out run --slurm --workers 3", "--workers"),
        ("study missing.toml --out run --slurm", "missing.toml"),
    ] {
        let (code, stdout, stderr) = say(site.path(), line);
        assert_eq!((code, stdout.as_str()), (Some(2), ""), "{line}: {stderr}");
        assert!(stderr.contains(words), "{line}: {stderr}");
    }
    fs::remove_file(site.path().join("map.exr")).unwrap();
    let (code, _, stderr) = say(site.path(), "batch two.toml --out run --slurm");
    assert!(code == Some(2) && stderr.contains("map.exr"), "{stderr}");
    let (code, _, stderr) = say(site.path(), "study study.toml --out run --slurm");
    assert!(code == Some(2) && stderr.contains("map.exr"), "{stderr}");
    fs::write(site.path().join("paint.binary"), b"no table").unwrap();
    let (code, _, stderr) = say(site.path(), "study study.toml --out run --slurm");
    assert!(code == Some(2) && stderr.contains("paint.binary"), "{stderr}");
    assert!(!site.path().join("submitted").exists() && !site.path().join("run").exists());
}

#[test]
fn refusal_by_slurm_is_reported_verbatim() {
    let site = site("echo 'sbatch: error: invalid partition specified: gold' >&2; exit 1");
    let (code, stdout, stderr) = say(site.path(), "batch two.toml --out run --slurm -- -p gold");
    assert_eq!((code, stdout.as_str()), (Some(3), ""), "{stderr}");
    assert!(stderr.contains("invalid partition specified: gold") && stderr.contains("lookalike.sbatch"), "{stderr}");
}
