//! `lookalike status`: shows the state of a run from its journal, without disturbing the run.

use crate::{
    outputs::{CSSIM_HINT, counted, print_result},
    run::NAMES,
    settings::StatusSettings,
    wrap::wrap,
};
use anyhow::Context;
use lookalike_coordinator::journal::{
    PartStatus,
    status::{Counts, RunState, Status},
};
use std::{process::ExitCode, time::Duration};

/// The most fits that are listed. If there are more, fits in these states come first.
const MOST_FITS: usize = 40;
const FIRST_STATES: [&str; 3] = ["running", "failed", "missed"];

/// The most workers that are listed.
const MOST_WORKERS: usize = 20;

pub(crate) fn run(settings: &StatusSettings) -> anyhow::Result<ExitCode> {
    let status = Status::of(&settings.run, NAMES)?;
    let text = if settings.json {
        status.to_json(NAMES).context("the status as JSON")?
    } else {
        table(&status, &settings.run.display().to_string())
    };
    print_result(&text).context("cannot write to stdout")?;
    Ok(ExitCode::SUCCESS)
}

/// The status as text.
fn table(status: &Status, folder: &str) -> String {
    let mut text = format!("{folder}: {}\n\n", headline(status));
    let mut line = |name: &str, value: String| text.push_str(&format!("{name:<12}{value}\n"));
    line("started", format!("{}, {} elapsed", short(&status.started_at), seconds(status.elapsed_s)));
    match &status.finished_at {
        Some(finished) => line("finished", short(finished)),
        None => line("last seen", short(&status.updated_at)),
    }
    let which = if status.epoch > 1 { format!(", the {} of this run", ordinal(status.epoch)) } else { String::new() };
    line("coordinator", format!("process {} on {}{which}", status.process, status.host));
    line("nodes", progress(&status.nodes));
    line("attempts", format!("{}, {} of them lost with their workers", status.attempts, status.requeued));
    if let Some(best) = status.best_score {
        line("best CSSIM", format!("{best:.4}"));
    }
    if !status.parts.is_empty() {
        line("fits", fit_count(&status.parts));
    }
    text.push_str(&fits(&status.parts));
    if status.best_score.is_some() || status.parts.iter().any(|fit| fit.score.is_some()) {
        text.push_str(&format!("\n{CSSIM_HINT}\n"));
    }
    text.push_str(&kinds(status));
    text.push_str(&workers(status));
    for failure in &status.failures {
        let failed = format!("failed: {} {:?}: {}", failure.kind, failure.label, failure.error);
        text.push_str(&format!("\n{}\n", wrap(&failed)));
    }
    let why = status.error.as_deref().unwrap_or("no reason is recorded");
    match status.state {
        RunState::Stopped => {
            text.push_str(&format!("\n{}\n", wrap(&format!("stopped: {why}"))));
            text.push_str("to resume it, repeat the command with --resume\n");
        }
        RunState::Ended => {
            text.push_str(&format!("\n{}\n", wrap(&format!("ended: {why}"))));
            text.push_str("to retry what failed, repeat the command with --resume\n");
        }
        RunState::Running | RunState::Finished => {}
    }
    text
}

/// How many fits are in each state, in one line.
fn fit_count(fits: &[PartStatus]) -> String {
    let of = |state: &str| fits.iter().filter(|fit| fit.state == state).count();
    let mut text = format!("{} of {} done", of("done") + of("missed"), fits.len());
    for state in ["missed", "failed", "running", "waiting", "stopped"] {
        if of(state) > 0 {
            text.push_str(&format!(", {} {state}", of(state)));
        }
    }
    text
}

/// One line per fit. If there are too many, failed and unusual ones come first.
fn fits(all: &[PartStatus]) -> String {
    if all.is_empty() {
        return String::new();
    }
    let mut shown: Vec<&PartStatus> = all.iter().collect();
    if all.len() > MOST_FITS {
        shown
            .sort_by_key(|fit| FIRST_STATES.iter().position(|state| *state == fit.state).unwrap_or(FIRST_STATES.len()));
        shown.truncate(MOST_FITS);
    }
    let width = shown.iter().map(|fit| fit.name.chars().count()).chain([3]).max().unwrap_or(3);
    let mut text = format!("\n{:<width$}  {:<7}  {:>6}  {:>9}\n", "fit", "state", "CSSIM", "seconds");
    for PartStatus { name, state, score, seconds, error } in &shown {
        let cssim = score.map(|cssim| format!("{cssim:.4}")).unwrap_or_default();
        let seconds = seconds.map(|seconds| format!("{seconds:.1}")).unwrap_or_default();
        let error = error.as_deref().map(|error| format!("  {error}")).unwrap_or_default();
        let line = format!("{name:<width$}  {state:<7}  {cssim:>6}  {seconds:>9}{error}");
        text.push_str(&wrap(line.trim_end()));
        text.push('\n');
    }
    match all.len() - shown.len() {
        0 => {}
        more => text.push_str(&format!("and {} (--json lists them all)\n", counted(more, "more fit"))),
    }
    text
}

fn headline(status: &Status) -> &'static str {
    match status.state {
        RunState::Running => "running",
        RunState::Stopped => "stopped, not finished",
        RunState::Ended => "ended with failures",
        RunState::Finished => "finished",
    }
}

fn progress(nodes: &Counts) -> String {
    let mut text = format!("{} of {} done", nodes.completed, nodes.total);
    if nodes.recalled > 0 {
        text.push_str(&format!(" ({} by an earlier coordinator)", nodes.recalled));
    }
    let others =
        [(nodes.running, "running"), (nodes.ready, "ready"), (nodes.waiting, "waiting"), (nodes.failed, "failed")];
    for (count, state) in others.iter().filter(|(count, _)| *count > 0) {
        text.push_str(&format!(", {count} {state}"));
    }
    text
}

fn kinds(status: &Status) -> String {
    let kind_width = status.kinds.iter().map(|kind| kind.kind.len()).chain([4]).max().unwrap_or(4);
    let mut text = format!(
        "\n{:<kind_width$}  {:>7}  {:>7}  {:>7}  {:>7}  {:>7}\n",
        "kind", "done", "running", "ready", "waiting", "failed"
    );
    for kind in &status.kinds {
        let Counts { completed, running, ready, waiting, failed, .. } = kind.counts;
        let name = &kind.kind;
        text.push_str(&format!(
            "{name:<kind_width$}  {completed:>7}  {running:>7}  {ready:>7}  {waiting:>7}  {failed:>7}\n"
        ));
    }
    text
}

fn workers(status: &Status) -> String {
    if status.workers.is_empty() || status.state != RunState::Running {
        return String::new();
    }
    let mut text = format!("\n{:>6}  {:>8}  {:>7}  {:>8}  {:>7}\n", "worker", "process", "threads", "running", "done");
    for worker in status.workers.iter().take(MOST_WORKERS) {
        let (number, process, threads) = (worker.worker, worker.process, worker.threads);
        text.push_str(&format!(
            "{number:>6}  {process:>8}  {threads:>7}  {:>8}  {:>7}\n",
            worker.leases.min(threads),
            worker.finished
        ));
    }
    match status.workers.len().saturating_sub(MOST_WORKERS) {
        0 => {}
        more => text.push_str(&format!("and {} (--json lists them all)\n", counted(more, "more worker"))),
    }
    text
}

/// Formats an RFC 3339 time as `2026-11-22 09:20:11 UTC`.
fn short(instant: &str) -> String {
    match (instant.get(..10), instant.get(11..19)) {
        (Some(day), Some(time)) => format!("{day} {time} UTC"),
        _ => instant.to_owned(),
    }
}

fn seconds(elapsed: f64) -> String {
    if elapsed < 100.0 {
        return format!("{elapsed:.1} s");
    }
    humantime::format_duration(Duration::try_from_secs_f64(elapsed.floor()).unwrap_or_default()).to_string()
}

fn ordinal(number: u64) -> String {
    let ending = match (number % 100, number % 10) {
        (11..=13, _) => "th",
        (_, 1) => "st",
        (_, 2) => "nd",
        (_, 3) => "rd",
        _ => "th",
    };
    format!("{number}{ending}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn stopped_run_shows_its_progress_and_how_to_resume_it() {
        let counts =
            json!({ "total": 30, "waiting": 3, "ready": 4, "running": 1, "completed": 21, "recalled": 5, "failed": 1 });
        let mut kind = counts.clone();
        kind["kind"] = json!("search");
        let status = json!({
            "schema": "lookalike.status/1", "state": "stopped", "error": "interrupted", "run": "00", "epoch": 2,
            "process": 7, "host": "h", "started_at": "2026-11-22T09:20:11.123Z", "updated_at": "2026-11-22T09:21:11.123Z",
            "finished_at": null, "elapsed_s": 3723.5, "nodes": counts, "kinds": [kind], "workers": [], "attempts": 40,
            "requeued": 2, "best_cssim": 0.03721, "failures": [{ "kind": "search", "label": "gamma 1", "error": "black" }],
        });
        let status = Status::from_json(status.to_string().as_bytes(), NAMES).unwrap();
        let expected = "\
run: stopped, not finished

started     2026-11-22 09:20:11 UTC, 1h 2m 3s elapsed
last seen   2026-11-22 09:21:11 UTC
coordinator process 7 on h, the 2nd of this run
nodes       21 of 30 done (5 by an earlier coordinator), 1 running, 4 ready, 3 waiting, 1 failed
attempts    40, 2 of them lost with their workers
best CSSIM  0.0372

CSSIM is a difference: 0 = identical, larger = worse.

kind       done  running    ready  waiting   failed
search       21        1        4        3        1

failed: search \"gamma 1\": black

stopped: interrupted
to resume it, repeat the command with --resume
";
        assert_eq!(table(&status, "run"), expected);
        let fit = PartStatus { name: "a".to_owned(), state: "done".to_owned(), ..PartStatus::default() };
        let listed = fits(&vec![fit; MOST_FITS + 1]);
        assert!(listed.ends_with("\nand 1 more fit (--json lists them all)\n"), "{listed}");
        assert_eq!([1, 2, 3, 11, 22, 112].map(ordinal), ["1st", "2nd", "3rd", "11th", "22nd", "112th"]);
    }
}
