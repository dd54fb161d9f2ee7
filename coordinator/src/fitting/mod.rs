//! One fit from a checked capture to a folder of results: plans the graph, runs it on workers, writes what came out.

mod clock;
mod identity;
mod method;
mod notes;
mod resume;

pub(crate) use method::method;

use crate::{
    cli::Exit,
    journal::{self, JOURNAL_FILE, JournalError, JournalOptions},
    outputs::{FitRecord, OutFolder, Pictures, Timing, candidates_csv, parameters_json, print_summary, write_pictures},
    progress::{Display, display},
    runner::{self, RunnerOptions},
    settings::{ClusterSettings, MethodSettings, ProgressKind},
};
use anyhow::Context;
use clock::Clock;
use lookalike::{
    fit::{FitOutcome, FitPlanner, JudgedBy, Method, nodes},
    image::metadata,
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
    pub(crate) out: OutFolder,
    pub(crate) out_name: String,
    /// A final score above this makes the exit code 1.
    pub(crate) max_cssim: Option<f64>,
    /// Gammas whose candidates are rendered as well.
    pub(crate) also_render: Vec<f64>,
    /// Go on with the run that is in the folder, if there is one.
    pub(crate) resume: bool,
    /// Whether somebody may want to go on with this run.
    pub(crate) is_resumable: bool,
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

/// Runs a fit and writes its results; `None` if that was done before.
pub(crate) fn run(job: FitJob) -> anyhow::Result<Option<Finished>> {
    if resume::is_done(&job)? {
        eprintln!("the run in {} is finished, and its results are as it wrote them", job.out_name);
        return Ok(None);
    }
    let method = method(&job.settings)?;
    let planner = FitPlanner::new(Arc::clone(&job.capture), method.clone(), job.exposure)
        .context("the photo cannot be fitted")?
        .also_render(&job.also_render);
    let mut display = display(job.progress, planner.best());
    let mut clock = Clock::start();
    let run = run_graph(&job, planner, &mut *display, &mut clock);
    let problem = run.as_ref().err().map(|error| format!("{error:#}"));
    display.finish(problem.as_deref().map_or(Ok(()), Err));
    let (planner, summary) = run?;
    let outcome = planner.into_outcome().context("the graph ended without a result: please report this")?;
    let notes = notes::notes(&method, &outcome);
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
    let pictures = write_results(&job, &method, &outcome, &notes, &timing)?;
    let finished = journal::Finished { outputs: job.out.results()? };
    journal::finish(&job.out.file(JOURNAL_FILE), &finished).map_err(journal_failed)?;
    let record = record(&job, &method, &outcome, &notes);
    print_summary(&record, &timing, &job.out_name).context("cannot write to stdout")?;
    let best = final_score(&method, &outcome);
    let missed = job.max_cssim.is_some_and(|limit| best > limit);
    if let (true, Some(limit)) = (missed, job.max_cssim) {
        eprintln!("the match has a score of {best:.4} (--judge {}), more than --max-cssim {limit}", judge(&method));
    }
    let code = if missed { Exit::MissedMaxCssim } else { Exit::Done };
    Ok(Some(Finished { outcome, pictures, code: code.into() }))
}

fn journal_failed(error: JournalError) -> anyhow::Error {
    let exit = if error.exit_code() == 2 { Exit::BadInput } else { Exit::ClusterFailed };
    anyhow::Error::new(error).context(exit)
}

fn run_graph(
    job: &FitJob,
    planner: FitPlanner,
    display: &mut dyn Display,
    clock: &mut Clock,
) -> anyhow::Result<(FitPlanner, crate::core::RunSummary)> {
    let mut options = RunnerOptions::new(job.cluster.workers.count(), job.out.file("access.json"));
    options.listen = job.cluster.listen_for_others();
    options.access = job.cluster.access.clone();
    options.advertise = job.cluster.advertise.as_ref().map(ToString::to_string);
    options.log.clone_from(&job.cluster.log);
    options.policy = job.cluster.policy;
    options.policy.verify_seed = job.settings.seed;
    options.journal = Some(JournalOptions {
        path: job.out.file(JOURNAL_FILE),
        identity: identity::identity(job)?,
        resume: job.resume,
        survivors: job.is_resumable,
        best: Some(planner.best()),
    });
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .build()
        .context("cannot start the network runtime")?;
    let run = runner::run(options, planner, Arc::new(nodes::registry()), |event| {
        clock.note(event);
        display.event(event);
    });
    runtime.block_on(run).map_err(|error| {
        match error.exit_code() {
            2 => anyhow::Error::new(error).context(Exit::BadInput),
            // The heading says it all.
            130 => Exit::Interrupted.into(),
            _ => anyhow::Error::new(error).context(Exit::ClusterFailed),
        }
    })
}

fn record<'a>(job: &'a FitJob, method: &'a Method, outcome: &'a FitOutcome, notes: &'a [String]) -> FitRecord<'a> {
    FitRecord {
        settings: &job.settings,
        method,
        capture: &job.capture,
        inputs: &job.inputs,
        outcome,
        display_exposure: job.exposure,
        notes,
    }
}

fn write_results(
    job: &FitJob,
    method: &Method,
    outcome: &FitOutcome,
    notes: &[String],
    timing: &Timing,
) -> anyhow::Result<Pictures> {
    let pictures = Pictures::new(&job.capture, outcome, job.exposure);
    let parameters = parameters_json(method.model, final_parameters(outcome)).to_string();
    let about = [
        (metadata::SOFTWARE, "lookalike".to_owned()),
        (metadata::VERSION, env!("CARGO_PKG_VERSION").to_owned()),
        (metadata::CONVENTIONS, "linear Rec. 709; +Y up, camera on +Z; alpha is the microfacet width".to_owned()),
        (metadata::MODEL, method.model.name().to_owned()),
        (metadata::PARAMETERS, parameters),
        (metadata::DISPLAY_EXPOSURE, job.exposure.to_string()),
        (metadata::SEED, method.seed.to_string()),
    ];
    let about: Vec<(String, String)> = about.into_iter().map(|(k, v)| (k.to_owned(), v)).collect();
    write_pictures(&job.out, &pictures, &about)?;
    job.out.write("candidates.csv", candidates_csv(method.model, &outcome.judged).as_bytes())?;
    // Last, for it marks a finished fit.
    let document = record(job, method, outcome, notes).json(timing);
    let text = serde_json::to_string_pretty(&document).context("fit.json")? + "\n";
    job.out.write("fit.json", text.as_bytes())?;
    Ok(pictures)
}

fn judge(method: &Method) -> &'static str {
    match method.judge {
        JudgedBy::Image => "image",
        JudgedBy::Object => "object",
    }
}

fn final_parameters(outcome: &FitOutcome) -> &[f64] {
    let winner = &outcome.judged[outcome.winner].candidate.parameters;
    outcome.polished.as_ref().map_or(winner, |p| &p.parameters)
}

fn final_score(method: &Method, outcome: &FitOutcome) -> f64 {
    let winner = &outcome.judged[outcome.winner];
    let polished = outcome.polished.as_ref().map(|p| method.judge.pick(p.cssim, p.cssim_object));
    polished.unwrap_or_else(|| method.judge.pick(winner.cssim, winner.cssim_object))
}
