//! `lookalike study`: runs the paper's experiments and other methods on measured materials under real light, as one run on the
//! job graph.
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
mod effort;
mod file;
mod inputs;
mod pictures;
mod planner;
mod record;
mod seconds;
mod supply;
mod variants;

use crate::{
    exit::Exit,
    fit::version,
    inputs::{load_environment, show_warnings},
    outputs::{Claim, ClaimedFolder, counted, print_result},
    progress::{Activity, Display, Ending, PartCount, Shape, display, print_line},
    run::{Session, access_file, listen},
    settings::{EnvironmentSettings, OldFiles, ProgressKind, StudySettings},
};
use anyhow::Context;
use effort::Effort;
use file::Study;
use inputs::{Inputs, Light};
use lookalike::{
    brdf::merl::MerlTable,
    graph::{Blob, Many},
    plan::encode_light,
};
use lookalike_coordinator::{
    events::RunEvent,
    journal::{JOURNAL_FILE, PartLedger, RunIdentity},
};
use lookalike_report::measured::{About, StudyData};
use seconds::Seconds;
use std::{
    fs,
    path::Path,
    process::ExitCode,
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicUsize, Ordering},
    },
    time::Instant,
};
use supply::{Supply, Tally};

/// Runs a study and writes its report.
pub(crate) fn run(settings: StudySettings) -> anyhow::Result<ExitCode> {
    let began = Instant::now();
    let study = Study::read(&settings.study)?;
    let cells = cells::plan(&study)?;
    let folder = ClaimedFolder::take(&claim(&settings, &study))?;
    let metrics = listen(settings.metrics)?;
    let (materials, lights) = read_inputs(&study, settings.progress)?;
    let (out, workers) = (folder.begin()?, settings.cluster.workers.count());
    let inputs = Arc::new(Inputs { study, cells, materials, lights, out, workers });
    let tally = Arc::new(Mutex::new(Tally::default()));
    let mut seconds = Seconds::open(&inputs.out)?;
    let supply = Supply::new(Arc::clone(&inputs), Arc::clone(&tally))?;
    let mut effort = Effort::read(&inputs.out);
    let out_name = settings.out.display().to_string();
    let session = Session {
        cluster: &settings.cluster,
        out: &inputs.out,
        out_name: &out_name,
        identity: identity(&inputs)?,
        resume: settings.old_files == OldFiles::Resume,
        seed: inputs.study.file.seed,
        metrics: metrics.as_ref(),
        score: None,
        parts: PartLedger::default(),
    };
    // Refuses to resume the run of another study, even if nothing is left to compute.
    session.finished()?;
    let PartCount { total, done, .. } = lock(&tally).count;
    let shape = Shape::Many { noun: "cell", total, done };
    let mut display = display(settings.progress, shape, access_file(&settings.cluster, &inputs.out));
    let run = || -> anyhow::Result<Vec<String>> {
        if !supply.is_complete() || !inputs.out.file(JOURNAL_FILE).exists() {
            let workers = run_cells(&session, &mut *display, &tally, (supply, &mut seconds))?;
            effort.seconds += began.elapsed().as_secs_f64();
            effort.workers = effort.workers.max(workers);
            effort.write(&inputs.out)?;
        }
        write_report(&settings, &inputs, &seconds, &effort)?;
        let failed = std::mem::take(&mut lock(&tally).failed);
        match failed.len() {
            0 => session.finish(inputs.out.hashes(["results.md", "results.json", "report.html"])?)?,
            count => session.settle(Some(&format!("{} of the study failed", counted(count, "cell"))))?,
        }
        Ok(failed)
    };
    let failed = run();
    let problem = failed.as_ref().err().map(|error| format!("{error:#}"));
    display.finish(problem.as_deref().map_or(Ending::Finished, Ending::Failed));
    let failed = failed?;
    for cell in &failed {
        print_line(&format!("failed: {cell}"));
    }
    let page = inputs.out.file("report.html");
    print_result(&format!("{}\n", page.display())).context("cannot write to stdout")?;
    Ok(if failed.is_empty() { Exit::Done } else { Exit::SomeFitsFailed }.into())
}

/// Checks a study that a job is to run.
pub(crate) fn check_job(settings: &StudySettings) -> anyhow::Result<()> {
    let study = Study::read(&settings.study)?;
    claim(settings, &study).check()?;
    cells::plan(&study)?;
    read_inputs(&study, settings.progress)?;
    Ok(())
}

/// Carries out `--force`, which the job does not get.
pub(crate) fn replace_old(settings: &StudySettings) -> anyhow::Result<()> {
    claim(settings, &Study::read(&settings.study)?).replace_now()
}

/// Computes the cells that are not complete. Returns how many workers joined.
fn run_cells(
    session: &Session<'_>,
    display: &mut dyn Display,
    tally: &Arc<Mutex<Tally>>,
    (supply, seconds): (Supply, &mut Seconds),
) -> anyhow::Result<u32> {
    let mut options = session.options();
    // The seconds of a node are to be those of one core.
    options.threads_per_worker = std::num::NonZeroUsize::new(1);
    let mut workers = 0;
    let show = |display: &mut dyn Display| {
        lock(tally).news.drain(..).for_each(|(event, count)| display.part(&event, count));
    };
    let run = session.run(options, Many::new(supply), |event| {
        seconds.note(event);
        workers += u32::from(matches!(event, RunEvent::WorkerJoined { .. }));
        show(display);
        display.event(event);
    });
    show(display);
    drop(run?);
    Ok(workers)
}

/// The files that the study reads and writes.
fn claim<'a>(settings: &'a StudySettings, study: &'a Study) -> Claim<'a> {
    let mut inputs: Vec<&Path> = study.materials.iter().chain(&study.lights).map(|(_, path)| path.as_path()).collect();
    inputs.push(&settings.study);
    inputs.extend(settings.cluster.access.as_deref());
    Claim {
        command: "study",
        files: vec![effort::FILE, "results.json", "data.json", "results.md", "report.html"],
        growing: vec![seconds::FILE],
        folders: vec!["cells", "pictures", "figures"],
        inputs,
        access: settings.cluster.access.as_deref(),
        ..Claim::of_fit(&settings.out, settings.old_files)
    }
}

fn lock(tally: &Mutex<Tally>) -> std::sync::MutexGuard<'_, Tally> {
    tally.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Reads the materials and the lights.
fn read_inputs(study: &Study, progress: ProgressKind) -> anyhow::Result<(Vec<Blob>, Vec<Light>)> {
    let read = Arc::new(AtomicUsize::new(0));
    let _activity = Activity::reading(progress, counted(study.materials.len() + study.lights.len(), "file"), &read);
    Ok((read_materials(study, &read)?, read_lights(study, &read)?))
}

fn read_materials(study: &Study, read: &AtomicUsize) -> anyhow::Result<Vec<Blob>> {
    let mut materials = Vec::new();
    for (_, path) in &study.materials {
        let shown = path.display().to_string();
        let bytes = fs::read(path).with_context(|| format!("cannot read the measured material {shown}"))?;
        MerlTable::read(&shown, &bytes)?;
        materials.push(Blob::new(bytes));
        read.fetch_add(1, Ordering::Relaxed);
    }
    Ok(materials)
}

fn read_lights(study: &Study, read: &AtomicUsize) -> anyhow::Result<Vec<Light>> {
    let mut lights = Vec::new();
    for (_, path) in &study.lights {
        let settings = EnvironmentSettings { path: path.clone(), mapping: None, rotation_deg: 0.0 };
        let loaded = load_environment(&settings)?;
        show_warnings(&loaded.warnings);
        let encoded = encode_light(&loaded.environment)?;
        lights.push(Light { environment: loaded.environment, encoded });
        read.fetch_add(1, Ordering::Relaxed);
    }
    Ok(lights)
}

/// The identity of the run. It depends on the settings in the file, not on how the file is written.
fn identity(inputs: &Inputs) -> anyhow::Result<RunIdentity> {
    let study = &inputs.study;
    let mut identity = version();
    for (key, value) in toml::from_str::<toml::Table>(&study.text)? {
        identity = identity.with(format!("the study: {key}"), value.to_string());
    }
    for ((name, _), blob) in study.materials.iter().zip(&inputs.materials) {
        identity = identity.with(format!("material {name}"), blob.hash().to_string());
    }
    for ((name, _), light) in study.lights.iter().zip(&inputs.lights) {
        identity = identity.with(format!("light {name}"), light.encoded.hash().to_string());
    }
    Ok(identity)
}

fn write_report(settings: &StudySettings, inputs: &Inputs, nodes: &Seconds, effort: &Effort) -> anyhow::Result<()> {
    let data = data::collect(inputs, nodes)?;
    let study = &inputs.study;
    let names = |list: &[(String, std::path::PathBuf)]| list.iter().map(|(name, _)| name.clone()).collect::<Vec<_>>();
    let about = About {
        command: settings.command.clone(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        machine: machine(),
        seconds: effort.seconds,
        workers: effort.workers,
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
    lookalike_report::write(&data, &settings.out, |name, bytes| match name.split_once('/') {
        Some((folder, name)) => inputs.out.sub(folder)?.write(name, bytes),
        None => inputs.out.write(name, bytes),
    })
}

/// The processor and how many cores of it this process may use.
fn machine() -> String {
    let text = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = text.lines().find_map(|line| line.strip_prefix("model name")).and_then(|rest| rest.split_once(':'));
    let model = model.map_or("unknown processor", |(_, name)| name.trim());
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZeroUsize::get);
    format!("{model}, {cores} cores")
}
