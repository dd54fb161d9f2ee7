//! One fit, from a checked capture to a folder of results: plans the graph, runs it on workers, writes the results.

mod identity;
mod notes;
mod results;

pub(crate) use identity::{FitIdentity, version};
pub(crate) use notes::notes;
pub(crate) use results::{final_parameters, final_score, final_scores, write_results};

use crate::{
    exit::Exit,
    outputs::{FitRecord, OutFolder, Pictures, Timing, print_summary},
    progress::{Display, Ending, PartCount, PartEvent, Shape, display, print_line},
    run::{Clock, Session, access_file, cpu_seconds, listen},
    settings::{ClusterSettings, MetricsAddress, ProgressKind},
};
use anyhow::Context;
use lookalike::{
    fit::Methods,
    plan::{FitOutcome, FitPlanner},
    scene::Capture,
};
use lookalike_coordinator::{journal::PartLedger, metrics::Metrics};
use serde_json::Value;
use std::{process::ExitCode, sync::Arc};

/// A fit that is ready to run.
#[derive(Debug)]
pub(crate) struct FitJob {
    pub(crate) capture: Arc<Capture>,
    pub(crate) methods: Methods,
    /// The exposure that is applied before the metric.
    pub(crate) exposure: f64,
    /// The `inputs` of `fit.json`.
    pub(crate) inputs: Value,
    pub(crate) cluster: ClusterSettings,
    pub(crate) progress: ProgressKind,
    pub(crate) metrics: Option<MetricsAddress>,
    pub(crate) out: OutFolder,
    pub(crate) out_name: String,
    /// The exit code is 1 if the final score exceeds this.
    pub(crate) max_cssim: Option<f64>,
    /// Additional gammas whose candidates are rendered.
    pub(crate) also_render: Vec<f64>,
    /// Resume the run in the folder, if there is one.
    pub(crate) resume: bool,
    /// Seconds spent on loading or generating the inputs.
    pub(crate) input_seconds: f64,
}

/// The data of a finished fit for further pictures.
#[derive(Debug)]
pub(crate) struct Finished {
    pub(crate) outcome: FitOutcome,
    pub(crate) pictures: Pictures,
    pub(crate) code: ExitCode,
}

/// Runs a fit and writes its results; `None` if an earlier run has finished it.
pub(crate) fn run(job: FitJob) -> anyhow::Result<Option<Finished>> {
    let planner = FitPlanner::new(Arc::clone(&job.capture), job.methods.clone(), job.exposure)
        .context("the photo cannot be fitted")?
        .also_render(&job.also_render);
    let metrics = listen(job.metrics)?;
    let mut display = display(job.progress, Shape::OneFit, access_file(&job.cluster, &job.out));
    let done = run_shown(&job, planner, metrics.as_ref(), &mut *display);
    let problem = done.as_ref().err().map(|error| format!("{error:#}"));
    display.finish(problem.as_deref().map_or(Ending::Finished, Ending::Failed));
    let Some(Done { outcome, pictures, timing, notes }) = done? else { return Ok(None) };
    let record = record(&job, &outcome, &notes);
    print_summary(&record, &timing, &job.out_name).context("cannot write to stdout")?;
    let judge = job.methods.common().judge;
    let best = final_score(judge, &outcome);
    let missed = job.max_cssim.is_some_and(|limit| best > limit);
    if let (true, Some(limit)) = (missed, job.max_cssim) {
        print_line(&format!("the match has a score of {best:.4} (--judge {}), more than --max-cssim {limit}", judge));
    }
    let code = if missed { Exit::MissedMaxCssim } else { Exit::Done };
    Ok(Some(Finished { outcome, pictures, code: code.into() }))
}

/// A fit whose results are written.
struct Done {
    outcome: FitOutcome,
    pictures: Pictures,
    timing: Timing,
    notes: Vec<String>,
}

/// Runs the fit while its display is shown, and writes its files.
fn run_shown(
    job: &FitJob,
    planner: FitPlanner,
    metrics: Option<&Metrics>,
    display: &mut dyn Display,
) -> anyhow::Result<Option<Done>> {
    let identity = FitIdentity {
        inputs: &job.inputs,
        capture: &job.capture,
        methods: &job.methods,
        exposure: job.exposure,
        also_render: &job.also_render,
    };
    let best = planner.best();
    let session = Session {
        cluster: &job.cluster,
        out: &job.out,
        out_name: &job.out_name,
        identity: identity.of_run()?,
        resume: job.resume,
        seed: job.methods.common().seed,
        metrics,
        score: Some(Arc::new(move || best.get())),
        parts: PartLedger::default(),
    };
    if job.resume && session.is_finished(|text| display.say(text))? {
        return Ok(None);
    }
    let started = PartEvent::Started { number: 0, name: String::new(), best: planner.best() };
    display.part(&started, PartCount { total: 1, running: 1, ..PartCount::default() });
    let mut clock = Clock::start();
    let (planner, summary) = session.run(session.options(), planner, |event| {
        clock.note(event);
        display.event(event);
    })?;
    let outcome = planner.into_outcome().context("the graph ended without a result: please report this")?;
    let notes = notes(job.methods.get(outcome.chosen), &outcome);
    let mut seconds = vec![("inputs", job.input_seconds)];
    seconds.extend(clock.stages());
    seconds.push(("total", job.input_seconds + clock.total()));
    let timing = Timing {
        seconds,
        cpu_seconds: cpu_seconds(),
        workers: usize::try_from(summary.workers_joined).unwrap_or(usize::MAX),
        out: job.out_name.clone(),
        attempts: summary.attempts,
        requeued: summary.requeued_nodes,
    };
    // Not an error of the input: a full disk may have room later, and the resumed run computes nothing again.
    let pictures = write_results(&job.out, &record(job, &outcome, &notes), &timing);
    let pictures = pictures.context(Exit::RunFailed)?;
    session.finish(job.out.results().context(Exit::RunFailed)?)?;
    Ok(Some(Done { outcome, pictures, timing, notes }))
}

fn record<'a>(job: &'a FitJob, outcome: &'a FitOutcome, notes: &'a [String]) -> FitRecord<'a> {
    let (methods, capture, inputs, display_exposure) = (&job.methods, &*job.capture, &job.inputs, job.exposure);
    FitRecord { methods, capture, inputs, outcome, display_exposure, notes }
}
