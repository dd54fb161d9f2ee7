//! Many fits as one run.
//!
//! ```text
//!   manifest ──► fits ──► check: read the inputs of every fit, report all problems
//!                           │
//!                  loader (a thread): reads a fit's files again when its turn is near
//!                           ▼
//!                  supply ──► Many planners on one graph ──► runner
//!                           │ a fit ends
//!                  results (rayon): OUT/<name>/..., then the summaries
//! ```
//! The board holds the state of every fit. All modules report to it, and it updates the display, the metrics and the summaries.

mod backlog;
mod board;
mod check;
mod lights;
mod loader;
mod prepare;
mod results;
mod resume;
mod row;
mod summary;
mod supply;
mod window;

use crate::{
    exit::Exit,
    inputs::show_warnings,
    outputs::{BATCH_MARK, Claim, ClaimedFolder, FIT_FILES, OutFolder, print_result},
    progress::{Ending, Shape, display},
    run::{Session, access_file, listen},
    settings::{BatchFit, BatchSettings, OldFiles, OnFailure, ProgressKind},
};
use anyhow::Context;
use board::{Board, Watchers};
use lights::Lights;
use lookalike::graph::Many;
use lookalike_coordinator::journal::{JOURNAL_FILE, PartLedger};
use std::{path::Path, process::ExitCode, sync::Arc};
use supply::{Supply, SupplyOptions};
use tokio::sync::Notify;
use window::{Demand, Window};

/// Runs a batch and writes its results.
pub(crate) fn run(settings: BatchSettings) -> anyhow::Result<ExitCode> {
    // Check for errors before any work is done.
    let folder = ClaimedFolder::take(&claim(&settings))?;
    let metrics = listen(settings.metrics)?;
    let lights = Arc::new(Lights::default());
    let checked = check::check(&settings, &lights)?;
    let out_name = settings.out.display().to_string();
    let out = folder.begin()?;
    let identity = resume::identity(&settings.fits, &checked.fits);
    let resume::Earlier { is_finished, complete, remark } =
        resume::earlier(&out, &out_name, &identity, &settings.fits)?;
    let open: Vec<u32> =
        (0..).zip(&complete).filter(|(_, complete)| complete.is_none()).map(|(number, _)| number).collect();
    let fits: Arc<[_]> = settings.fits.into();
    let is_stream = settings.progress == ProgressKind::Json;
    if !is_stream {
        // Before bars are drawn.
        show_warnings(&checked.warnings);
    }
    let done = fits.len() - open.len();
    let shape = Shape::Many { noun: "fit", total: fits.len(), done };
    let mut display = display(settings.progress, shape, access_file(&settings.cluster, &out));
    if is_stream {
        checked.warnings.iter().for_each(|text| display.say(&format!("warning: {text}")));
    }
    remark.iter().for_each(|text| display.say(text));
    metrics.iter().for_each(|metrics| display.say(&format!("metrics at {}", metrics.url())));
    let ledger = PartLedger::default();
    let watchers = Watchers { display, metrics: metrics.clone(), ledger: ledger.clone() };
    let board = Arc::new(Board::new(&fits, complete, watchers, out.clone()).context(Exit::RunFailed)?);
    if is_finished {
        return end(&board, Ok(()));
    }
    let workers = settings.cluster.workers.count();
    let demand = Arc::new(Demand::expecting(workers));
    let wake = Arc::new(Notify::new());
    let (supply, written) = Supply::new(SupplyOptions {
        fits: Arc::clone(&fits),
        open: open.into(),
        checks: checked.fits.into(),
        lights,
        board: Arc::clone(&board),
        window: Window::new(Arc::clone(&demand), settings.stage_two),
        stage_two: settings.stage_two,
        is_fail_fast: settings.on_failure == OnFailure::FailFast,
        out: out.clone(),
        out_name: out_name.clone(),
        wake: Arc::clone(&wake),
    })?;
    let session = Session {
        cluster: &settings.cluster,
        out: &out,
        out_name: &out_name,
        identity,
        resume: settings.old_files == OldFiles::Resume,
        seed: fits.first().map_or(0, |fit| fit.methods.common().seed),
        metrics: metrics.as_ref(),
        score: None,
        parts: ledger,
    };
    let mut options = session.options();
    options.wake = Some(wake);
    let run = session.run(options, Many::new(supply), |event| {
        demand.note(event);
        board.note(event);
    });
    // Also after an error: what was computed is written.
    let run = run.map(|(planner, summary)| (drop(planner), summary).1);
    written.wait();
    let closed = close(&session, &board, run.is_ok(), &fits);
    end(&board, first_error(run.map(|_| ()), closed))
}

/// Adds to the closed journal the fits whose results were written last, and how the run ended.
fn close(session: &Session<'_>, board: &Board, is_whole: bool, fits: &[BatchFit]) -> anyhow::Result<()> {
    if !session.out.file(JOURNAL_FILE).exists() {
        // The run did not begin.
        return Ok(());
    }
    let ended = board.problem().filter(|_| is_whole);
    session.settle(ended.as_deref())?;
    if is_whole && ended.is_none() {
        session.finish(outputs(session.out, fits).context(Exit::RunFailed)?)?;
    }
    Ok(())
}

/// The files that the batch reads and writes.
fn claim(settings: &BatchSettings) -> Claim<'_> {
    let mut inputs: Vec<&Path> = vec![&settings.manifest];
    for fit in &settings.fits {
        inputs.extend(fit.capture.files());
        inputs.extend(fit.display_exposure.file());
    }
    inputs.extend(settings.cluster.access.as_deref());
    Claim {
        command: "batch",
        files: vec![summary::CSV, BATCH_MARK],
        fits: settings.fits.iter().map(|fit| fit.name.as_str()).collect(),
        inputs,
        access: settings.cluster.access.as_deref(),
        ..Claim::of_fit(&settings.out, settings.old_files)
    }
}

/// Checks a batch that a job is to run.
pub(crate) fn check_job(settings: &BatchSettings) -> anyhow::Result<()> {
    claim(settings).check()?;
    show_warnings(&check::check(settings, &Lights::default())?.warnings);
    Ok(())
}

/// Carries out `--force`, which the job does not get.
pub(crate) fn replace_old(settings: &BatchSettings) -> anyhow::Result<()> {
    claim(settings).replace_now()
}

/// The files of all fits, each with its hash.
fn outputs(out: &OutFolder, fits: &[BatchFit]) -> anyhow::Result<Vec<(String, String)>> {
    let files: Vec<String> = fits.iter().flat_map(|fit| FIT_FILES.map(|file| format!("{}/{file}", fit.name))).collect();
    out.hashes(files.iter().map(String::as_str))
}

/// Writes the last summaries and prints the outcome.
fn end(board: &Board, run: anyhow::Result<()>) -> anyhow::Result<ExitCode> {
    // Not an error of the input: a full disk may have room when the batch is resumed.
    let written = board.close().context(Exit::RunFailed);
    let stopped =
        run.as_ref().err().filter(|_| board.was_stopped_by_a_fit()).map(|error| error.root_cause().to_string());
    let outcome = first_error(if stopped.is_some() { Ok(()) } else { run }, written);
    let failed = outcome.as_ref().err().map(|error| format!("{error:#}"));
    board.end(match (&failed, &stopped) {
        (Some(error), _) => Ending::Failed(error),
        (None, Some(reason)) => Ending::Stopped(reason),
        (None, None) => Ending::Finished,
    });
    let printed = print_result(&board.table()).context("cannot write to stdout");
    first_error(outcome, printed).map(|()| board.exit().into())
}

/// The first error is returned; a later one, most likely a consequence, is logged.
fn first_error(first: anyhow::Result<()>, then: anyhow::Result<()>) -> anyhow::Result<()> {
    match (first, then) {
        (Err(first), Err(then)) => {
            tracing::warn!("{then:#}");
            Err(first)
        }
        (first, then) => first.and(then),
    }
}
