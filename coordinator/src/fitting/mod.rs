//! One fit from a checked capture to a folder of results: plans the graph, runs it on workers, writes what came out.

mod clock;
mod method;
mod notes;
mod results;
mod running;

pub(crate) use clock::Clock;
pub(crate) use method::method;
pub(crate) use notes::notes;
pub(crate) use results::{final_parameters, final_score, final_scores, judge, write_results};
pub(crate) use running::{run_to_end, runner_options};

use crate::{
    cli::Exit,
    metrics::Metrics,
    outputs::{FitRecord, OutFolder, Pictures, Timing, print_summary},
    progress::display,
    settings::{ClusterSettings, MethodSettings, MetricsAddress, ProgressKind},
};
use anyhow::Context;
use lookalike::{
    fit::{FitOutcome, FitPlanner},
    scene::Capture,
};
use serde_json::Value;
use std::{process::ExitCode, sync::Arc};

/// A fit that is ready to run.
#[derive(Debug)]
pub(crate) struct FitJob {
    pub(crate) capture: Arc<Capture>,
    pub(crate) settings: MethodSettings,
    /// Exposure before the metric.
    pub(crate) exposure: f64,
    /// The `inputs` of `fit.json`.
    pub(crate) inputs: Value,
    pub(crate) cluster: ClusterSettings,
    pub(crate) progress: ProgressKind,
    pub(crate) metrics: Option<MetricsAddress>,
    pub(crate) out: OutFolder,
    pub(crate) out_name: String,
    /// A final score above this makes the exit code 1.
    pub(crate) max_cssim: Option<f64>,
    /// Gammas whose candidates are rendered as well.
    pub(crate) also_render: Vec<f64>,
    /// Seconds spent on loading or making the inputs.
    pub(crate) input_seconds: f64,
}

/// What a finished fit leaves for pictures of its own.
#[derive(Debug)]
pub(crate) struct Finished {
    pub(crate) outcome: FitOutcome,
    pub(crate) pictures: Pictures,
    pub(crate) code: ExitCode,
}

/// Runs a fit and writes its results.
pub(crate) fn run(job: FitJob) -> anyhow::Result<Finished> {
    let method = method(&job.settings)?;
    let planner = FitPlanner::new(Arc::clone(&job.capture), method.clone(), job.exposure)
        .context("the photo cannot be fitted")?
        .also_render(&job.also_render);
    let metrics = job.metrics.map(Metrics::listen).transpose()?;
    let mut display = display(job.progress, planner.best());
    let mut clock = Clock::start();
    let options = runner_options(&job.cluster, &job.out);
    let run = run_to_end(options, planner, metrics.as_ref(), |event| {
        clock.note(event);
        display.event(event);
    });
    let problem = run.as_ref().err().map(|error| format!("{error:#}"));
    display.finish(problem.as_deref().map_or(Ok(()), Err));
    let (planner, summary) = run?;
    let outcome = planner.into_outcome().context("the graph ended without a result: please report this")?;
    let notes = notes(&method, &outcome);
    let mut seconds = vec![("inputs", job.input_seconds)];
    seconds.extend(clock.stages());
    seconds.push(("total", job.input_seconds + clock.total()));
    let timing = Timing {
        seconds,
        cpu_seconds: clock::cpu_seconds(),
        workers: usize::try_from(summary.workers_joined).unwrap_or(usize::MAX),
        out: job.out_name.clone(),
        attempts: summary.attempts,
        requeued: summary.requeued_nodes,
    };
    let record = FitRecord {
        settings: &job.settings,
        method: &method,
        capture: &job.capture,
        inputs: &job.inputs,
        outcome: &outcome,
        display_exposure: job.exposure,
        notes: &notes,
    };
    let pictures = write_results(&job.out, &record, &timing)?;
    print_summary(&record, &timing, &job.out_name).context("cannot write to stdout")?;
    let best = final_score(&method, &outcome);
    let missed = job.max_cssim.is_some_and(|limit| best > limit);
    if let (true, Some(limit)) = (missed, job.max_cssim) {
        eprintln!("the match has a score of {best:.4} (--judge {}), more than --max-cssim {limit}", judge(&method));
    }
    let code = if missed { Exit::MissedMaxCssim } else { Exit::Done };
    Ok(Finished { outcome, pictures, code: code.into() })
}
