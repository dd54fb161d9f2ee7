//! The identity of a fit: the inputs and settings that may not change when its run is resumed.

use anyhow::Context;
use lookalike::{fit::Methods, scene::Capture};
use lookalike_coordinator::journal::RunIdentity;
use serde_json::Value;

/// Everything that determines the result of a fit.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FitIdentity<'a> {
    /// The `inputs` of `fit.json`.
    pub(crate) inputs: &'a Value,
    pub(crate) capture: &'a Capture,
    pub(crate) methods: &'a Methods,
    /// The exposure that is applied before the metric.
    pub(crate) exposure: f64,
    /// Additional gammas whose candidates are rendered.
    pub(crate) also_render: &'a [f64],
}

impl FitIdentity<'_> {
    /// The identity of a run that consists of this fit alone.
    pub(crate) fn of_run(&self) -> anyhow::Result<RunIdentity> {
        Ok(self.parts()?.into_iter().fold(version(), |identity, (name, value)| identity.with(name, value)))
    }

    /// The inputs, by content, and the method, by the names of the command line.
    pub(crate) fn parts(&self) -> anyhow::Result<Vec<(&'static str, String)>> {
        let mut parts = Vec::new();
        let inputs = [("photo", "the photo"), ("environment", "--env"), ("mask", "--mask"), ("normals", "--normals")];
        for (role, name) in inputs {
            if let Some(content) = self.inputs[role]["blake3"].as_str() {
                // Long enough to tell contents apart, short enough to read.
                parts.push((name, content.get(..16).unwrap_or(content).to_owned()));
            }
        }
        let environment = &self.inputs["environment"];
        for (field, name) in [("mapping", "--env-mapping"), ("rotation_deg", "--env-rotation")] {
            if let Some(value) = environment.get(field) {
                parts.push((name, value.to_string().trim_matches('"').to_owned()));
            }
        }
        let geometry = serde_json::to_string(&self.capture.geometry().spec()).context("the geometry")?;
        parts.extend([
            ("the place of the object (--sphere, --camera)", geometry),
            ("--display-exposure", self.exposure.to_string()),
        ]);
        parts.extend(self.methods.settings().into_iter().map(|setting| (setting.flag, setting.text)));
        parts.push(("the gammas that are shown", format!("{:?}", self.also_render)));
        Ok(parts)
    }
}

/// The part of the identity that all runs share: the version of this program.
pub(crate) fn version() -> RunIdentity {
    RunIdentity::default().with("the version of lookalike", env!("CARGO_PKG_VERSION"))
}
