//! Slurm's job script on stand-ins: `srun` runs its command on this machine, `scontrol` and `squeue` print what the test specifies.

use super::source;
use crate::fit::scene::{Finished, folder, without_timing};
use lookalike_tests::process::{Process, signal, stderr};
use serde_json::Value;
use std::{
    fs,
    net::TcpListener,
    os::unix::fs::PermissionsExt,
    path::Path,
    process::{Command, Output},
};
use tempfile::TempDir;

/// Several shards of the subset's table, so that a process can be killed between them.
const FLAGS: &str = "--model ggx --samples 128 --gammas 1:2:0.5 --seed 5 --polish off";

/// The fit by this machine alone.
static LOCAL: Finished = Finished::new(FLAGS);

/// Sets the node of a step in its environment. With `--export=NONE` of the step or its job, only `SLURM*` and the stand-in's variables
/// stay. SIGTERM is passed on to all processes of the step, as in Slurm.
const SRUN: &str = r#"export="${SLURM_EXPORT_ENV:-ALL}"
for argument; do
  case "$argument" in
    --export=*) export="${argument#--export=}" ;;
    --nodelist=*) export SLURMD_NODENAME="${argument#--nodelist=}" ;;
    bash) break ;;
  esac
  shift
done
if [ "$export" = NONE ]; then
  for name in $(env | sed -n 's/^\([A-Za-z_][A-Za-z_0-9]*\)=.*/\1/p'); do
    case "$name" in SLURM* | SITE | PATH) ;; *) unset "$name" ;; esac
  done
fi
setsid "$@" &
trap 'kill -TERM -$!; wait $!' TERM
wait $!"#;

/// Expands lists of hosts and records requeued jobs.
const SCONTROL: &str = r#"case "$1" in
  show) echo "$3" | tr , '\n' ;;
  requeue) echo "$2" >> "$SITE/requeued" ;;
esac"#;

/// Prints the nodes of the job.
const SQUEUE: &str = r#"cat "$SITE/nodes""#;

/// A folder with the scene of a fit and a stand-in for Slurm with two nodes.
fn site() -> TempDir {
    let folder = folder();
    fs::create_dir(folder.path().join("bin")).unwrap();
    fs::write(folder.path().join("nodes"), "first,second\n").unwrap();
    for (name, body) in [("srun", SRUN), ("scontrol", SCONTROL), ("squeue", SQUEUE)] {
        let path = folder.path().join("bin").join(name);
        fs::write(&path, format!("#!/bin/sh\n{body}\n")).unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
    }
    folder
}

/// The job script with a command line, as Slurm starts it on the first of two nodes.
fn job(site: &Path, line: &str, environment: &[(&str, &str)]) -> Command {
    let path = format!("{}:{}", site.join("bin").display(), std::env::var("PATH").unwrap());
    let mut command = Command::new("bash");
    command.arg(source("deploy/slurm/lookalike.sbatch")).args(line.split_whitespace()).current_dir(site);
    command.env("PATH", path).env("SITE", site).env_remove("RUST_LOG");
    command.env("SLURM_JOB_ID", "7").env("SLURM_JOB_NODELIST", "first,second").env("SLURMD_NODENAME", "first");
    command.env("SLURM_CPUS_ON_NODE", "1").env("LOOKALIKE", env!("CARGO_BIN_EXE_lookalike-under-test"));
    command.env("LOOKALIKE_ADVERTISE", "localhost").env("LOOKALIKE_LISTEN", "127.0.0.1:0");
    command.envs(environment.iter().copied());
    command
}

fn line(out: &str) -> String {
    format!("fit photo.exr --env map.exr --out {out} --progress json {FLAGS}")
}

/// Runs the job; `act` gets the id of the script's process and all events and messages so far, after each new one.
fn watch(mut command: Command, mut act: impl FnMut(u32, &[Value])) -> (Output, Vec<Value>) {
    let process = Process::start(&mut command);
    let script = process.id();
    process.watch_stderr(|events| act(script, events))
}

fn is(event: &Value, name: &str, label: &str) -> bool {
    event["event"] == name && event["label"].as_str().is_some_and(|text| text.starts_with(label))
}

fn says(events: &[Value], words: &str) -> bool {
    events.iter().any(|event| event.as_str().is_some_and(|line| line.contains(words)))
}

/// The child process of a process that has this word in its command line.
fn child(parent: u32, word: &str) -> u32 {
    let listed = Command::new("ps").args(["-o", "pid=,args=", "--ppid", &parent.to_string()]).output().unwrap();
    let listed = String::from_utf8(listed.stdout).unwrap();
    let found = listed.lines().find(|line| line.split_whitespace().any(|argument| argument == word));
    found.and_then(|line| line.split_whitespace().next()?.parse().ok()).unwrap_or_else(|| panic!("{word}: {listed}"))
}

/// Asserts that the results of the job are those of a fit by this machine alone.
fn assert_same_as_local(site: &Path, out: &str) {
    LOCAL.copy_to(&site.join("local"));
    assert_eq!(without_timing(&site.join("local")), without_timing(&site.join(out)));
}

#[test]
fn task_of_an_array_runs_a_worker_on_each_node_and_leaves_the_same_results() {
    let site = site();
    // As with `sbatch --export=NONE`, also for the steps.
    let job = job(site.path(), &line("run-%a"), &[("SLURM_ARRAY_TASK_ID", "3"), ("SLURM_EXPORT_ENV", "NONE")]);
    let (output, events) = watch(job, |_, _| ());
    assert_eq!(output.status.code(), Some(0), "{events:?}");
    let joined = events.iter().filter(|event| event["event"] == "worker-joined");
    let processes: Vec<_> = joined.map(|event| &event["process"]).collect();
    assert!(processes.len() == 2 && processes[0] != processes[1], "{events:?}");
    assert_same_as_local(site.path(), "run-3");
}

#[test]
fn folder_and_address_are_accepted_in_all_spellings() {
    let site = site();
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port();
    drop(taken);
    let line = format!("fit photo.exr --env map.exr -o=run --progress json {FLAGS}");
    let (listen, advertise) = (format!("127.0.0.1:{port}"), format!("localhost:{port}"));
    let environment = [("LOOKALIKE_LISTEN", listen.as_str()), ("LOOKALIKE_ADVERTISE", advertise.as_str())];
    let (output, events) = watch(job(site.path(), &line, &environment), |_, _| ());
    assert_eq!(output.status.code(), Some(0), "{events:?}");
    assert!(site.path().join("run/fit.json").exists() && !site.path().join("=run").exists());
}

#[test]
fn killed_worker_and_coordinator_are_restarted_and_results_are_the_same() {
    let site = site();
    let (mut worker, mut coordinator) = (None, None);
    let (output, events) = watch(job(site.path(), &line("run"), &[]), |script, events| {
        let last = events.last().unwrap();
        if worker.is_none() && is(last, "node-started", "transport of the subset") {
            let joined = |event: &&Value| event["event"] == "worker-joined" && event["worker"] == last["worker"];
            let process = events.iter().find(joined).and_then(|event| event["process"].as_u64()).unwrap();
            worker = Some(process);
            signal(u32::try_from(process).unwrap(), "KILL");
        }
        if coordinator.is_none() && is(last, "node-started", "transport in full") {
            let process = child(script, "fit");
            coordinator = Some(process);
            signal(process, "KILL");
        }
    });
    assert!(worker.is_some() && coordinator.is_some(), "{events:?}");
    assert_eq!(output.status.code(), Some(0), "{events:?}");
    assert!(says(&events, "ended with status 137; restarting it in 1 s"), "{events:?}");
    assert!(says(&events, "the coordinator was killed (status 137); restarting it"), "{events:?}");
    assert_same_as_local(site.path(), "run");
}

#[test]
fn time_limit_requeues_the_job_and_its_restart_resumes_the_run() {
    let site = site();
    let mut warned = false;
    let (output, events) = watch(job(site.path(), &line("run"), &[]), |script, events| {
        if !warned && is(events.last().unwrap(), "node-started", "transport in full") {
            warned = true;
            signal(script, "USR1");
        }
    });
    assert_eq!(output.status.code(), Some(130), "{events:?}");
    assert_eq!(fs::read_to_string(site.path().join("requeued")).unwrap(), "7\n");
    assert!(says(&events, "the time limit is near; requeueing the job"), "{events:?}");
    let (output, events) = watch(job(site.path(), &line("run"), &[("SLURM_RESTART_COUNT", "1")]), |_, _| ());
    assert_eq!(output.status.code(), Some(0), "{events:?}");
    assert!(!events.iter().any(|event| is(event, "node-started", "search")), "searches were done twice: {events:?}");
    assert_same_as_local(site.path(), "run");
}

#[test]
fn job_requeued_too_often_reports_it_and_ends() {
    let site = site();
    let environment = [("SLURM_RESTART_COUNT", "2"), ("LOOKALIKE_MAX_RESTARTS", "2")];
    let mut warned = false;
    let (output, events) = watch(job(site.path(), &line("run"), &environment), |script, events| {
        if !warned && events.last().unwrap()["event"] == "worker-joined" {
            warned = true;
            signal(script, "USR1");
        }
    });
    assert_eq!(output.status.code(), Some(130), "{events:?}");
    assert!(says(&events, "the job was requeued 2 times already"), "{events:?}");
    assert!(!site.path().join("requeued").exists());
}

#[test]
fn invalid_command_lines_are_refused_before_anything_is_started() {
    let site = site();
    let cases = [
        ("", "expected a command line of lookalike"),
        ("demo --out run", "expected the command batch, study or fit, found demo"),
        ("fit photo.exr --env map.exr", "expected --out DIR"),
        ("study study.toml", "expected --out DIR"),
        ("fit photo.exr --env map.exr --out run --workers 3", "--workers cannot be used in a Slurm job"),
        ("fit photo.exr --env map.exr --out run --force", "--force cannot be used in a job, because a requeued job"),
        ("fit photo.exr --env map.exr --out run --listen=0.0.0.0:1", "--listen cannot be used in a Slurm job"),
    ];
    for (line, words) in cases {
        let output = Process::start(&mut job(site.path(), line, &[])).output();
        assert_eq!(output.status.code(), Some(2), "{line}: {}", stderr(&output));
        assert!(stderr(&output).contains(words), "{line}: {}", stderr(&output));
    }
    let output = Process::start(&mut job(site.path(), &line("run"), &[("LOOKALIKE", "/no/lookalike")])).output();
    assert!(output.status.code() == Some(2) && stderr(&output).contains("cannot find the program /no/lookalike"));
    let output = Process::start(job(site.path(), &line("run"), &[]).env_remove("SLURM_JOB_ID")).output();
    assert!(output.status.code() == Some(2) && stderr(&output).contains("submit it with sbatch"));
    assert!(!site.path().join("run").exists());
}

#[test]
fn bad_input_ends_the_job_with_the_coordinators_code() {
    let site = site();
    let (output, events) = watch(job(site.path(), "fit photo.exr --env missing.exr --out run", &[]), |_, _| ());
    assert_eq!(output.status.code(), Some(2), "{events:?}");
    assert!(says(&events, "missing.exr") && says(&events, "the coordinator ended with status 2"), "{events:?}");
}
