//! `lookalike fit`: from a photo and its light to the parameters of a BRDF.

use crate::{
    fit::{self, FitJob},
    inputs::{load_capture, resolve_display_exposure, show_warnings},
    outputs::{Claim, ClaimedFolder},
    progress::Activity,
    settings::{FitSettings, OldFiles},
};
use std::{process::ExitCode, sync::Arc, time::Instant};

pub(crate) fn run(settings: FitSettings) -> anyhow::Result<ExitCode> {
    let began = Instant::now();
    // Check for errors before any work is done.
    let folder = ClaimedFolder::take(&claim(&settings))?;
    let activity = Activity::shown(settings.progress, || "reading the inputs".to_owned());
    let loaded = load_capture(&settings.capture)?;
    show_warnings(&loaded.warnings);
    let coverage = loaded.capture.scoring_coverage();
    let exposure = resolve_display_exposure(
        &settings.display_exposure,
        loaded.capture.photo(),
        &coverage,
        loaded.capture.clipped_at(),
    )?;
    drop(activity);
    let out = folder.begin()?;
    let job = FitJob {
        inputs: loaded.to_json(),
        capture: Arc::new(loaded.capture),
        methods: settings.methods,
        exposure,
        cluster: settings.cluster,
        progress: settings.progress,
        metrics: settings.metrics,
        out,
        out_name: settings.out.display().to_string(),
        max_cssim: settings.max_cssim,
        also_render: Vec::new(),
        resume: settings.old_files == OldFiles::Resume,
        input_seconds: began.elapsed().as_secs_f64(),
    };
    Ok(fit::run(job)?.map_or(ExitCode::SUCCESS, |finished| finished.code))
}

/// The files that the fit reads and writes.
fn claim(settings: &FitSettings) -> Claim<'_> {
    let mut inputs = settings.capture.files();
    inputs.extend(settings.display_exposure.file());
    inputs.extend(settings.cluster.access.as_deref());
    Claim { inputs, access: settings.cluster.access.as_deref(), ..Claim::of_fit(&settings.out, settings.old_files) }
}
