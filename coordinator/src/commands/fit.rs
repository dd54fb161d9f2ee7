//! `lookalike fit`: from a photo and its light to the parameters of a BRDF.

use crate::{
    fitting::{self, FitJob},
    inputs::{LoadedCapture, load_capture, resolve_display_exposure, show_warnings},
    outputs::OutFolder,
    settings::FitSettings,
};
use serde_json::{Value, json};
use std::{process::ExitCode, sync::Arc, time::Instant};

pub(crate) fn run(settings: FitSettings) -> anyhow::Result<ExitCode> {
    let began = Instant::now();
    // Whatever can fail fails before any work is done.
    let out = OutFolder::create(&settings.out, settings.resume)?;
    let loaded = load_capture(&(&settings).into())?;
    show_warnings(&loaded.warnings);
    let coverage = loaded.capture.scoring_coverage();
    let exposure = resolve_display_exposure(&settings.display_exposure, loaded.capture.photo(), &coverage)?;
    let job = FitJob {
        inputs: inputs_json(&loaded, &settings),
        capture: Arc::new(loaded.capture),
        settings: settings.method,
        exposure,
        cluster: settings.cluster,
        progress: settings.progress,
        out,
        out_name: settings.out.display().to_string(),
        max_cssim: settings.max_cssim,
        also_render: Vec::new(),
        resume: settings.resume,
        is_resumable: true,
        input_seconds: began.elapsed().as_secs_f64(),
    };
    Ok(fitting::run(job)?.map_or(ExitCode::SUCCESS, |finished| finished.code))
}

fn inputs_json(loaded: &LoadedCapture, settings: &FitSettings) -> Value {
    let mut environment = loaded.environment.to_json();
    environment["mapping"] = json!(loaded.mapping.name());
    environment["rotation_deg"] = json!(settings.environment.rotation_deg);
    let mut inputs = json!({ "photo": loaded.photo.to_json(), "environment": environment });
    for (role, file) in [("mask", &loaded.mask), ("normals", &loaded.normals)] {
        if let Some(file) = file {
            inputs[role] = file.to_json();
        }
    }
    inputs
}
