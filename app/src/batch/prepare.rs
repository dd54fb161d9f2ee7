//! Prepares a fit of the manifest: loads its inputs and plans it.

use super::lights::Lights;
use crate::{
    fit::FitIdentity,
    inputs::{load_capture_under, resolve_display_exposure},
    settings::{BatchFit, StageTwo},
};
use anyhow::Context;
use lookalike::{fit::Methods, graph::Placement, plan::FitPlanner, scene::Capture};
use serde_json::Value;
use std::{sync::Arc, time::Instant};

/// A fit with its inputs in memory.
#[derive(Debug)]
pub(super) struct Prepared {
    pub(super) capture: Arc<Capture>,
    pub(super) methods: Methods,
    pub(super) exposure: f64,
    /// The `inputs` of `fit.json`.
    pub(super) inputs: Value,
    pub(super) planner: FitPlanner,
    pub(super) warnings: Vec<String>,
    /// Seconds that reading the inputs took.
    pub(super) seconds: f64,
}

impl Prepared {
    /// Reads the inputs of a fit and plans it. All checks of a fit are made here.
    pub(super) fn new(fit: &BatchFit, lights: &Lights, stage_two: StageTwo) -> anyhow::Result<Self> {
        let began = Instant::now();
        let mut encoded = None;
        let loaded = load_capture_under(&fit.capture, |settings| {
            let light = lights.get(settings)?;
            encoded = Some(light.encoded.clone());
            Ok(light.loaded.clone())
        })?;
        let inputs = loaded.to_json();
        let capture = Arc::new(loaded.capture);
        let coverage = capture.scoring_coverage();
        let exposure =
            resolve_display_exposure(&fit.display_exposure, capture.photo(), &coverage, capture.clipped_at())?;
        let methods = fit.methods.clone();
        let placement = match stage_two {
            StageTwo::Coordinator => Placement::Coordinator,
            StageTwo::Workers => Placement::Worker,
        };
        let planner = FitPlanner::new(Arc::clone(&capture), methods.clone(), exposure);
        let mut planner = planner.context("the photo cannot be fitted")?.judging_on(placement);
        if let Some(encoded) = encoded {
            planner = planner.with_encoded_light(encoded);
        }
        let (warnings, seconds) = (loaded.warnings, began.elapsed().as_secs_f64());
        Ok(Self { capture, methods, exposure, inputs, planner, warnings, seconds })
    }

    /// The inputs and settings that may not change when the batch is resumed, by name.
    pub(super) fn identity(&self) -> anyhow::Result<Vec<(&'static str, String)>> {
        let (inputs, capture, methods, exposure) = (&self.inputs, &*self.capture, &self.methods, self.exposure);
        FitIdentity { inputs, capture, methods, exposure, also_render: &[] }.parts()
    }

    /// Pixels of the photo.
    pub(super) fn pixels(&self) -> usize {
        self.capture.photo().width() * self.capture.photo().height()
    }
}
