use super::script::{COMMAND_LINE, OPTIONS, TEMPLATE};
use super::*;
use std::os::unix::fs::PermissionsExt;

fn job(out: &Path) -> SlurmJob {
    SlurmJob {
        program: "/opt/look alike/bin/lookalike".into(),
        folder: "/home/ada".into(),
        command: ["batch", "it's $HOME.toml", "--out", "run"].map(String::from).to_vec(),
        options: ["-N", "4", "--comment=a 'b' \\ # c"].map(String::from).to_vec(),
        out: out.to_owned(),
    }
}

/// A program that stands for sbatch: a shell script with this body.
fn sbatch(folder: &Path, body: &str) -> String {
    let path = folder.join("sbatch");
    fs::write(&path, format!("#!/bin/sh\n{body}\n")).unwrap();
    fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
    path.to_str().unwrap().to_owned()
}

#[test]
fn template_has_each_mark_once() {
    for mark in [OPTIONS, COMMAND_LINE] {
        assert_eq!(TEMPLATE.matches(mark).count(), 1, "{mark}");
    }
}

#[test]
fn options_of_the_user_come_last_and_before_any_command() {
    let script = job(Path::new("/scratch/50%")).script().unwrap();
    let directives: Vec<&str> = script.lines().filter(|line| line.starts_with("#SBATCH")).collect();
    assert_eq!(
        directives[directives.len() - 2..],
        [
            "#SBATCH '--job-name=50%' --chdir=/home/ada '--output=/scratch/50%%/slurm-%j.out'",
            r"#SBATCH -N 4 '--comment=a '\''b'\'' \\ # c'",
        ]
    );
    let commands = script.lines().position(|line| !line.is_empty() && !line.starts_with('#')).unwrap();
    let last = script.lines().position(|line| line == directives[directives.len() - 1]).unwrap();
    assert!(last < commands, "sbatch reads options up to the first command, line {commands}");
}

#[test]
fn shell_reads_the_command_line_as_it_was_given() {
    let script = job(Path::new("/scratch/a run")).script().unwrap();
    let begin = script.find("export LOOKALIKE=").unwrap();
    let lines: String = script[begin..].lines().take(3).map(|line| format!("{line}\n")).collect();
    let shown = format!("{lines}printf '%s|' \"$LOOKALIKE\" \"$results\" \"$@\"");
    let output = Command::new("bash").args(["-c", &shown]).output().unwrap();
    let expected = "/opt/look alike/bin/lookalike|/scratch/a run|batch|it's $HOME.toml|--out|run|";
    assert_eq!(String::from_utf8_lossy(&output.stdout), expected);
}

#[test]
fn flags_that_say_where_workers_are_and_options_of_two_lines_are_refused() {
    let mut wrong = job(Path::new("/scratch/run"));
    wrong.command.push("--workers=3".into());
    assert!(wrong.script().unwrap_err().to_string().starts_with("--workers cannot be used in a Slurm job"));
    let mut wrong = job(Path::new("/scratch/run"));
    wrong.options.push("--comment=a\nrm -rf b".into());
    assert!(wrong.script().unwrap_err().to_string().contains("one line"));
}

#[test]
fn submitted_job_has_its_number_and_its_script() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("new/run");
    // The script that sbatch gets is the one that is named.
    let said = r#"test "$1" = --parsable && grep -q '^set -- batch' "$2" && echo '4711;east'"#;
    let mut job = job(&out);
    job.folder = folder.path().to_owned();
    let submitted = job.submit(&sbatch(folder.path(), said)).unwrap();
    assert_eq!((submitted.job.as_str(), &submitted.log), ("4711", &out.join("slurm-4711.out")));
    for words in ["squeue --jobs=4711", "scancel 4711", &format!("lookalike status {}", out.display())] {
        assert!(submitted.advice().contains(words), "{}", submitted.advice());
    }
    assert_eq!(fs::read_to_string(submitted.script).unwrap(), job.script().unwrap());
}

#[test]
fn only_job_scripts_of_this_program_are_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let mut job = job(&folder.path().join("run"));
    job.folder = folder.path().to_owned();
    let sbatch = sbatch(folder.path(), "echo 7");
    let script = job.submit(&sbatch).unwrap().script;
    job.command.push("--resume".into());
    job.submit(&sbatch).unwrap();
    assert!(fs::read_to_string(&script).unwrap().contains("--resume"));
    fs::write(&script, "#!/usr/bin/env bash\nmine").unwrap();
    let error = job.submit(&sbatch).unwrap_err().to_string();
    assert!(error.contains("lookalike.sbatch is not a job script of this program"), "{error}");
    fs::remove_file(&script).unwrap();
    std::os::unix::fs::symlink(&sbatch, &script).unwrap();
    assert!(job.submit(&sbatch).is_err());
    assert!(fs::read_to_string(&sbatch).unwrap().ends_with("echo 7\n"));
}

#[test]
fn message_of_sbatch_reaches_the_user_with_the_exit_code() {
    let folder = tempfile::tempdir().unwrap();
    let mut job = job(&folder.path().join("run"));
    job.folder = folder.path().to_owned();
    let refusal = sbatch(folder.path(), "echo 'sbatch: error: invalid partition specified: gpu' >&2; exit 1");
    let error = job.submit(&refusal).unwrap_err();
    assert!(format!("{error:#}").contains("invalid partition specified: gpu"), "{error:#}");
    assert!(format!("{error:#}").contains("lookalike.sbatch"), "{error:#}");
    assert_eq!(error.downcast_ref::<Exit>(), Some(&Exit::RunFailed));
    let error = job.submit("no-such-sbatch").unwrap_err();
    assert!(error.to_string().starts_with("cannot find no-such-sbatch"), "{error}");
    assert_eq!(error.downcast_ref::<Exit>(), None);
    // Its exit code says that it accepted the job.
    let silent = sbatch(folder.path(), "echo welcome");
    let error = format!("{:#}", job.submit(&silent).unwrap_err());
    assert!(
        error.contains("accepted the job, but its number is not in \"welcome\"; look it up with squeue"),
        "{error}"
    );
    assert!(!error.contains("not submitted"), "{error}");
    for banner in ["echo 'Welcome to Vega'; echo 4711", "echo; echo '1 job(s) of yours wait'; echo '4711;east'; echo"] {
        assert_eq!(job.submit(&sbatch(folder.path(), banner)).unwrap().job, "4711", "{banner}");
    }
}
