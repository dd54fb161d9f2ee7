//! `polish`: stage three, a short search on CSSIM from the winner or from the result of `explore`.

use super::view::Scene;
use crate::{
    fit::{Limits, Ranges, polish},
    graph::{Blob, NodeFailure, NodeType, RunContext},
    nodes::wire::{PolishedWire, check_parameters, read, write},
};
use serde::{Deserialize, Serialize};
use std::ops::ControlFlow;

#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct PolishParameters {
    pub(crate) model: String,
    pub(crate) ranges: Ranges,
    /// Possible starts; the search starts from the best of them on this node's table.
    pub(crate) starts: Vec<Vec<f64>>,
    pub(crate) max_evaluations: u32,
}

#[derive(Debug)]
pub(super) struct Polish;

impl NodeType for Polish {
    fn kind(&self) -> &'static str {
        super::POLISH
    }

    fn run(&self, parameters: &[u8], inputs: &[Blob], context: &RunContext) -> Result<Vec<u8>, NodeFailure> {
        let PolishParameters { model, ranges, starts, max_evaluations } = read("parameters of polish", parameters)?;
        let scene = Scene::read(&model, inputs, context)?;
        ranges.check(scene.model).map_err(|error| NodeFailure::new(error.to_string()))?;
        starts.iter().try_for_each(|start| check_parameters("starts", scene.model, start))?;
        let mut observe = |progress: &crate::search::Progress<'_>| {
            context.report(progress.evaluations as u64, u64::from(max_evaluations));
            if context.is_cancelled() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let searching = scene.view.searching()?;
        let (view, limits) = (scene.full(), Limits::of_polish(&ranges, max_evaluations as usize));
        let polished = polish(&view, scene.view.judges(&searching), &starts, limits, &mut observe)
            .map_err(|error| NodeFailure::new(format!("polish: {error}")))?;
        // A cancelled search has no result.
        context.check()?;
        write("polish", &PolishedWire::of(polished))
    }
}
