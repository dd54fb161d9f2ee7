//! What a fit is a fit of: what may not change when its run is gone on with.

use super::FitJob;
use crate::{journal::RunIdentity, outputs::name_of};
use anyhow::Context;

/// The inputs of a fit, by content, and the settings that shape its result. Names are those of the command line.
pub(super) fn identity(job: &FitJob) -> anyhow::Result<RunIdentity> {
    let mut identity = RunIdentity::default().with("the version of lookalike", env!("CARGO_PKG_VERSION"));
    let inputs = [("photo", "the photo"), ("environment", "--env"), ("mask", "--mask"), ("normals", "--normals")];
    for (role, name) in inputs {
        if let Some(content) = job.inputs[role]["blake3"].as_str() {
            // Enough to tell contents apart, and short enough to be read.
            identity = identity.with(name, content.get(..16).unwrap_or(content));
        }
    }
    let environment = &job.inputs["environment"];
    for (field, name) in [("mapping", "--env-mapping"), ("rotation_deg", "--env-rotation")] {
        if let Some(value) = environment.get(field) {
            identity = identity.with(name, value.to_string().trim_matches('"'));
        }
    }
    let geometry = serde_json::to_string(&job.capture.geometry().spec()).context("the geometry")?;
    let settings = &job.settings;
    Ok(identity
        .with("the place of the object (--sphere, --camera)", geometry)
        .with("--display-exposure", job.exposure.to_string())
        .with("--model", settings.model.to_string())
        .with("--gammas", settings.gammas.to_string())
        .with("--samples", settings.samples.to_string())
        .with("--sampling", name_of(&settings.sampling))
        .with("--subsets", settings.subsets.to_string())
        .with("--search", name_of(&settings.search))
        .with("the start of the searches (--preset)", format!("{:?}", settings.start).to_lowercase())
        .with("compression at zero (--preset)", format!("{:?}", settings.compress_at_zero).to_lowercase())
        .with("--polish", if settings.polish { "on" } else { "off" })
        .with("--judge", name_of(&settings.judge))
        .with("--seed", settings.seed.to_string())
        .with("the gammas that are shown", format!("{:?}", job.also_render)))
}
