//! The same bits everywhere (design sections 2 and 9): with any number of workers, a worker killed while executing, no workers, any SIMD
//! level.

use super::scene::{fit, fit_json, folder, folder_of_size, without_timing};
use lookalike::{
    fit::Method,
    graph::{Execution, run_in_process},
    math::simd::{self, Level},
    nodes,
    plan::{FitOutcome, FitPlanner},
    render::subset::SampleCount,
};
use lookalike_app::{
    inputs::{load_capture, resolve_display_exposure},
    settings::{CaptureSettings, DisplayExposure, EnvironmentSettings, ViewSettings},
};
use lookalike_tests::process::{Process, signal};
use serde_json::{Value, json};
use std::{
    fs,
    path::Path,
    process::Command,
    sync::{Arc, Mutex, PoisonError},
};

/// Several shards of the subset's table, so that a worker can be killed between them.
const FLAGS: &str = "--model ggx --samples 128 --gammas 1:3:0.5 --seed 5";

/// The numbers of workers that are compared.
const WORKERS: &[usize] = if cfg!(feature = "slow") { &[1, 2, 5] } else { &[1, 2] };

/// A fit whose first worker at work is killed with SIGKILL; returns its events.
fn fit_with_a_killed_worker(folder: &Path) -> Vec<Value> {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lookalike-under-test"));
    let line = format!("fit photo.exr --env map.exr --out killed --workers 2 --progress json {FLAGS}");
    let process = Process::start(command.args(line.split_whitespace()).current_dir(folder).env_remove("RUST_LOG"));
    let mut victim = None;
    let (output, events) = process.watch_stderr(|events| {
        let Some(Value::Object(event)) = events.last() else { return };
        if victim.is_none() && event["event"] == "node-started" && event["kind"] == "transport" {
            let joined = |e: &&Value| e["event"] == "worker-joined" && e["worker"] == event["worker"];
            let process = events.iter().find(joined).and_then(|e| e["process"].as_u64()).expect("a worker that joined");
            victim = Some(process);
            signal(u32::try_from(process).unwrap(), "KILL");
        }
    });
    assert_eq!(output.status.code(), Some(0), "{events:?}");
    let ended = |e: &Value| e["event"] == "local-worker-ended" && e["process"].as_u64() == victim;
    assert!(victim.is_some() && events.iter().any(ended), "{events:?}");
    events
}

#[test]
fn results_do_not_depend_on_the_number_or_deaths_of_workers() {
    let folder = folder();
    let out = |name: &str| folder.path().join(name);
    for workers in WORKERS {
        fit(folder.path(), &workers.to_string(), &format!("{FLAGS} --workers {workers} --progress none")).done();
    }
    fit_with_a_killed_worker(folder.path());
    let requeued = fit_json(&out("killed"))["timing"]["requeued"].as_u64().unwrap();
    assert!(requeued >= 1, "the worker died between nodes: the test proves nothing");
    let others = WORKERS[1..].iter().map(usize::to_string);
    for other in others.chain(["killed".to_owned()]) {
        assert_eq!(without_timing(&out("1")), without_timing(&out(&other)), "{other}");
        for file in ["match.exr", "match.png", "reference.png", "difference.png", "candidates.csv"] {
            let [one, same] = ["1", &other].map(|name| fs::read(out(name).join(file)).unwrap());
            assert!(one == same, "{file} of {other}");
        }
    }
    let reference = in_this_process(folder.path(), Level::Detected, 128);
    assert_eq!(numbers_of(&reference), numbers_in(&fit_json(&out("1"))));
}

#[test]
fn results_do_not_depend_on_the_simd_level() {
    if !simd::has_levels() {
        println!("skipped: this processor has only the baseline's instructions");
        return;
    }
    let (folder, samples) = (folder_of_size(24), 32);
    let [detected, baseline] =
        [Level::Detected, Level::Baseline].map(|level| in_this_process(folder.path(), level, samples));
    assert_eq!(numbers_of(&detected), numbers_of(&baseline));
    assert!(detected.matched == baseline.matched, "the images differ");
    assert!(detected.error_map == baseline.error_map, "the error maps differ");
}

#[test]
fn choice_among_models_does_not_depend_on_the_number_of_workers() {
    let folder = folder();
    let json = |workers: u32| {
        let out = format!("auto-{workers}");
        let flags = format!("--samples 64 --gammas 1:3:1 --seed 5 --workers {workers} --progress none");
        fit(folder.path(), &out, &flags).done();
        without_timing(&folder.path().join(out))
    };
    assert_eq!(json(1), json(2));
}

/// The fit of [`FLAGS`] with this number of samples, without workers, at a SIMD level.
fn in_this_process(folder: &Path, level: Level, samples: u32) -> FitOutcome {
    // The SIMD level is global to the process, so one fit runs at a time.
    static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());
    let _guard = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
    let environment = EnvironmentSettings { path: folder.join("map.exr"), mapping: None, rotation_deg: 0.0 };
    let view = ViewSettings { camera: lookalike::scene::Camera::Orthographic, normals: None };
    let photo = folder.join("photo.exr");
    let files = CaptureSettings { photo, layer: None, mask: None, environment, view, sphere: None };
    let capture = load_capture(&files).unwrap().capture;
    let coverage = capture.scoring_coverage();
    let exposure =
        resolve_display_exposure(&DisplayExposure::Auto, capture.photo(), &coverage, capture.clipped_at()).unwrap();
    let gammas = vec![1.0, 1.5, 2.0, 2.5, 3.0];
    let method = Method { samples: SampleCount::Draws(samples), seed: 5, gammas, ..Method::default() };
    let planner = FitPlanner::new(Arc::new(capture), method, exposure).unwrap();
    simd::limit(level);
    let planner = run_in_process(planner, &nodes::registry(), Execution::Parallel);
    simd::limit(Level::Detected);
    planner.unwrap().into_outcome().unwrap()
}

/// All numbers that the fit found, in the form of `fit.json`, with every bit.
fn numbers_of(outcome: &FitOutcome) -> Value {
    let judged = outcome.judged.iter().map(|j| {
        let c = &j.candidate;
        json!([c.gamma, c.cost, j.cssim, j.cssim_object, c.evaluations, c.termination.name(), ggx(&c.parameters)])
    });
    let winner = &outcome.judged[outcome.winner];
    let stage_two =
        json!([winner.candidate.gamma, winner.cssim, winner.cssim_object, ggx(&winner.candidate.parameters)]);
    let polished = outcome.polished.as_ref().unwrap();
    let polished = json!([polished.cssim, polished.cssim_object, ggx(&polished.parameters), polished.evaluations]);
    json!({ "candidates": judged.collect::<Vec<_>>(), "stage_two": stage_two, "polished": polished })
}

fn numbers_in(json: &Value) -> Value {
    let pick = |object: &Value, names: &[&str]| Value::Array(names.iter().map(|name| object[*name].clone()).collect());
    let candidate =
        |c: &Value| pick(c, &["gamma", "cost", "cssim", "cssim_object", "evaluations", "termination", "parameters"]);
    let candidates: Vec<Value> = json["candidates"].as_array().unwrap().iter().map(candidate).collect();
    let stage_two = pick(&json["stage_two"], &["gamma", "cssim", "cssim_object", "parameters"]);
    let polished = pick(&json["polished"], &["cssim", "cssim_object", "parameters", "evaluations"]);
    json!({ "candidates": candidates, "stage_two": stage_two, "polished": polished })
}

fn ggx(flat: &[f64]) -> Value {
    json!({ "kd": flat[..3], "f0": flat[3..6], "f90": flat[6], "alpha": flat[7] })
}
