//! `lookalike study`: the paper's experiments on measured materials under real light, beside rival methods, as one run on the job
//! graph.
//!
//! ```text
//!   STUDY.toml ──► cells (a photo, a fit, brute force, ..), each with those it needs
//!                    ▼
//!                  supply ──► Many planners on one graph ──► runner
//!                    │ a cell ends
//!                  OUT/cells/<cell>.json, .exr; OUT/pictures
//!                    ▼ all have ended
//!                  data (one flat table) ──► report: results.md, report.html, figures, CSV, JSON
//! ```

mod cells;
mod data;
mod file;
mod pictures;
mod planner;
mod record;
mod report;
mod row;
mod seconds;
mod supply;
mod variants;

use crate::{
    cli::Exit,
    fitting::{run_to_end, runner_options, version},
    inputs::{load_environment, show_warnings},
    journal::{FitLedger, JOURNAL_FILE, JournalOptions},
    metrics::Metrics,
    outputs::{OutFolder, print_result},
    progress::{Ending, display_of_many},
    settings::{EnvironmentSettings, StudySettings},
};
use anyhow::Context;
use file::Study;
use lookalike::{
    brdf::merl::MerlTable,
    fit::encode_light,
    graph::{Blob, Many},
};
use row::{About, StudyData};
use seconds::Seconds;
use std::{
    fs,
    process::ExitCode,
    sync::{Arc, Mutex, PoisonError},
    time::Instant,
};
use supply::{Inputs, Light, Supply, Tally};

/// Runs a study and writes its report.
pub(crate) fn run(settings: StudySettings) -> anyhow::Result<ExitCode> {
    let began = Instant::now();
    let study = Study::read(&settings.study)?;
    let cells = cells::plan(&study)?;
    let out = OutFolder::create(&settings.out, settings.resume)?;
    let metrics = settings.metrics.map(Metrics::listen).transpose()?;
    let inputs = Arc::new(load(study, cells, out.clone(), settings.cluster.workers.count())?);
    let tally = Arc::new(Mutex::new(Tally::default()));
    let seconds = Seconds::open(&out)?;
    let supply = Supply::new(Arc::clone(&inputs), Arc::clone(&tally))?;
    let mut display = display_of_many(settings.progress, inputs.cells.len());
    display.say(&format!(
        "{} cells: photos, tables, fits and rivals; complete: {}",
        inputs.cells.len(),
        lock(&tally).complete
    ));
    let mut options = runner_options(&settings.cluster, &out, inputs.study.file.seed);
    // Seconds of a node are those of one core.
    options.threads_per_worker = std::num::NonZeroUsize::new(1);
    options.journal = Some(JournalOptions {
        path: out.file(JOURNAL_FILE),
        identity: identity(&inputs),
        resume: settings.resume,
        survivors: true,
        best: None,
        fits: FitLedger::default(),
    });
    let (mut seconds, mut told, mut workers) = (seconds, lock(&tally).complete, 0_u32);
    let run = run_to_end(options, Many::new(supply), metrics.as_ref(), |event| {
        seconds.note(event);
        workers += u32::from(matches!(event, crate::comm::RunEvent::WorkerJoined { .. }));
        display.event(event);
        let complete = lock(&tally).complete;
        if complete >= told + 10 {
            told = complete;
            let minutes = began.elapsed().as_secs_f64() / 60.0;
            display.say(&format!("{complete} of {} cells complete, {minutes:.1} min", inputs.cells.len()));
        }
    });
    let problem = run.as_ref().err().map(|error| format!("{error:#}"));
    display.finish(problem.as_deref().map_or(Ending::Finished, Ending::Failed));
    drop(run?);
    write_report(&settings, &inputs, &seconds, (began.elapsed().as_secs_f64(), workers))?;
    let failed = std::mem::take(&mut lock(&tally).failed);
    for cell in &failed {
        eprintln!("failed: {cell}");
    }
    print_result(&format!("{}\n", out.file("report.html").display())).context("cannot write to stdout")?;
    Ok(if failed.is_empty() { Exit::Done } else { Exit::SomeFitsFailed }.into())
}

fn lock(tally: &Mutex<Tally>) -> std::sync::MutexGuard<'_, Tally> {
    tally.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Reads materials and lights, which is also their check.
fn load(study: Study, cells: Vec<cells::Cell>, out: OutFolder, workers: usize) -> anyhow::Result<Inputs> {
    let mut materials = Vec::new();
    for (_, path) in &study.materials {
        let shown = path.display().to_string();
        let bytes = fs::read(path).with_context(|| format!("cannot read the measured material {shown}"))?;
        MerlTable::read(&shown, &bytes)?;
        materials.push(Blob::new(bytes));
    }
    let mut lights = Vec::new();
    for (_, path) in &study.lights {
        let settings = EnvironmentSettings { path: path.clone(), mapping: None, rotation_deg: 0.0 };
        let loaded = load_environment(&settings)?;
        show_warnings(&loaded.warnings);
        let encoded = encode_light(&loaded.environment)?;
        lights.push(Light { environment: loaded.environment, encoded });
    }
    Ok(Inputs { study, cells, materials, lights, out, workers })
}

/// What the run is a run of.
fn identity(inputs: &Inputs) -> crate::journal::RunIdentity {
    let study = &inputs.study;
    let mut identity = version().with("the study", study.text.clone());
    for ((name, _), blob) in study.materials.iter().zip(&inputs.materials) {
        identity = identity.with(format!("material {name}"), blob.hash().to_string());
    }
    for ((name, _), light) in study.lights.iter().zip(&inputs.lights) {
        identity = identity.with(format!("light {name}"), light.encoded.hash().to_string());
    }
    identity
}

fn write_report(
    settings: &StudySettings,
    inputs: &Inputs,
    nodes: &Seconds,
    (seconds, workers): (f64, u32),
) -> anyhow::Result<()> {
    let data = data::collect(inputs, nodes)?;
    let study = &inputs.study;
    let names = |list: &[(String, std::path::PathBuf)]| list.iter().map(|(name, _)| name.clone()).collect::<Vec<_>>();
    let about = About {
        command: settings.command.clone(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        machine: machine(),
        seconds,
        workers,
        study: study.text.clone(),
        materials: names(&study.materials),
        six: study.file.six.clone(),
        probes: names(&study.lights[..study.probes]),
        held_out: names(&study.lights[study.probes..]),
        size: study.file.size,
        model: study.file.model.clone(),
        seed: study.file.seed,
    };
    let data =
        StudyData { about, photos: data.photos, rows: data.rows, direct: data.direct, agreements: data.agreements };
    report::write(&data, &settings.out)
}

/// The processor and how many cores of it this process may use.
fn machine() -> String {
    let text = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = text.lines().find_map(|line| line.strip_prefix("model name")).and_then(|rest| rest.split_once(':'));
    let model = model.map_or("unknown processor", |(_, name)| name.trim());
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZeroUsize::get);
    format!("{model}, {cores} cores")
}
