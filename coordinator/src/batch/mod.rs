//! Many fits as one run.
//!
//! ```text
//!   manifest ──► fits ──► check: read every file once, tell all that is wrong
//!                           │
//!                  loader (a thread): reads a fit's files again when its turn is near
//!                           ▼
//!                  supply ──► Many planners on one graph ──► runner
//!                           │ a fit ends
//!                  results (rayon): OUT/<name>/..., then the summaries
//! ```
//! The board knows how every fit is doing. Everybody tells it, and it tells the display, the metrics and the summaries.

mod board;
mod check;
mod lights;
mod loader;
mod prepare;
mod results;
mod resume;
mod summary;
mod supply;
mod window;

use crate::{
    cli::Exit,
    fitting::{is_finished, journal_failed, run_to_end, runner_options},
    inputs::show_warnings,
    journal::{self, Finished, JOURNAL_FILE, JournalOptions},
    metrics::Metrics,
    outputs::{FIT_FILES, OutFolder, print_result},
    progress::display_of_many,
    settings::{BatchFit, BatchSettings, OnFailure, ProgressKind},
};
use anyhow::Context;
use board::Board;
use lights::Lights;
use lookalike::graph::Many;
use std::{process::ExitCode, sync::Arc};
use supply::{Supply, SupplyOptions};
use window::{Demand, Window};

/// Runs a batch and writes its results.
pub(crate) fn run(settings: BatchSettings) -> anyhow::Result<ExitCode> {
    // Whatever can fail fails before any work is done.
    if !settings.resume {
        resume::refuse_old(&settings.out)?;
    }
    let out = OutFolder::create(&settings.out, settings.resume)?;
    let metrics = settings.metrics.map(Metrics::listen).transpose()?;
    let lights = Arc::new(Lights::default());
    let checked = check::check(&settings, &lights)?;
    let out_name = settings.out.display().to_string();
    let identity = resume::identity(&settings.fits, &checked.fits);
    let is_finished = settings.resume && is_finished(&out, &out_name, &identity)?;
    let complete = |fit: &BatchFit| settings.resume.then(|| resume::complete(&out, fit)).flatten();
    let complete: Vec<_> = settings.fits.iter().map(complete).collect();
    let open: Vec<u32> =
        (0..).zip(&complete).filter(|(_, complete)| complete.is_none()).map(|(number, _)| number).collect();
    let fits: Arc<[_]> = settings.fits.into();
    let mut display = display_of_many(settings.progress, fits.len());
    match settings.progress {
        ProgressKind::Json => checked.warnings.iter().for_each(|text| display.say(&format!("warning: {text}"))),
        _ => show_warnings(&checked.warnings),
    }
    metrics.iter().for_each(|metrics| display.say(&format!("metrics at {}", metrics.url())));
    let board = Arc::new(Board::new(&fits, complete, out.clone(), display, metrics.clone())?);
    if is_finished {
        return end(&board, Ok(()));
    }
    let workers = settings.cluster.workers.count();
    let demand = Arc::new(Demand::expecting(workers));
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
        out_name,
    })?;
    let seed = fits.first().map_or(0, |fit| fit.method.seed);
    let mut options = runner_options(&settings.cluster, &out, seed);
    options.journal = Some(JournalOptions {
        path: out.file(JOURNAL_FILE),
        identity,
        resume: settings.resume,
        survivors: true,
        best: None,
    });
    let run = run_to_end(options, Many::new(supply), metrics.as_ref(), |event| {
        demand.note(event);
        board.note(event);
    });
    // Also of a run that failed: what was computed is written.
    let run = run.map(|(planner, summary)| (drop(planner), summary).1);
    written.wait();
    if run.is_ok() && board.is_complete() {
        let finished = Finished { outputs: outputs(&out, &fits)? };
        journal::finish(&out.file(JOURNAL_FILE), &finished).map_err(journal_failed)?;
    }
    end(&board, run.map(|_| ()))
}

/// Tells all that is wrong with a batch, without running it.
pub(crate) fn check(settings: &BatchSettings) -> anyhow::Result<()> {
    if !settings.resume {
        resume::refuse_old(&settings.out)?;
    }
    show_warnings(&check::check(settings, &Lights::default())?.warnings);
    Ok(())
}

/// The files of all fits, each with its hash.
fn outputs(out: &OutFolder, fits: &[BatchFit]) -> anyhow::Result<Vec<(String, String)>> {
    let files = fits.iter().flat_map(|fit| FIT_FILES.map(|file| format!("{}/{file}", fit.name)));
    let there = files.filter_map(|name| out.hash(&name).transpose().map(|hash| hash.map(|hash| (name, hash))));
    there.collect()
}

/// Tells how it went.
fn end(board: &Board, run: anyhow::Result<()>) -> anyhow::Result<ExitCode> {
    let outcome = finish(board, run);
    let summary = board.finish(outcome.as_ref().err())?;
    print_result(&summary).context("cannot write to stdout")?;
    outcome.map(|()| board.exit().into())
}

/// How the run ended, as the user is to be told. One that a failed fit ended has told that already.
fn finish(board: &Board, run: anyhow::Result<()>) -> anyhow::Result<()> {
    match run {
        Err(error) if board.was_stopped_by_a_fit() => {
            tracing::info!(%error, "the run was ended by a fit that failed");
            Ok(())
        }
        other => other,
    }
}

/// The exit code of a batch: a fit that failed outweighs one that missed its score.
fn exit(count: &crate::progress::FitCount) -> Exit {
    if count.failed > 0 {
        Exit::SomeFitsFailed
    } else if count.missed > 0 {
        Exit::MissedMaxCssim
    } else {
        Exit::Done
    }
}
