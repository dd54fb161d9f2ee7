//! `explore`: searches on CSSIM over a coarse picture from several very different lobes. Parameters and output are those of `polish`.

use super::{PolishParameters, view::Scene};
use crate::{
    fit::explore::{explore, most_evaluations},
    graph::{Blob, NodeFailure, NodeType, RunContext},
    metric::Block,
    nodes::wire::{PolishedWire, check_parameters, read, write},
};
use serde::{Deserialize, Serialize};
use std::ops::ControlFlow;

#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct ExploredWire {
    pub(crate) found: PolishedWire,
    /// The windows of its picture that count for the score, as the parts of [`Blocks`](crate::metric::Blocks).
    pub(crate) blocks: Vec<Block>,
}

#[derive(Debug)]
pub(super) struct Explore;

impl NodeType for Explore {
    fn kind(&self) -> &'static str {
        super::EXPLORE
    }

    fn run(&self, parameters: &[u8], inputs: &[Blob], context: &RunContext) -> Result<Vec<u8>, NodeFailure> {
        let PolishParameters { model, ranges, starts, max_evaluations } = read("parameters of explore", parameters)?;
        let scene = Scene::read(&model, inputs, context)?;
        ranges.check(scene.model).map_err(|error| NodeFailure::new(error.to_string()))?;
        starts.iter().try_for_each(|start| check_parameters("starts", scene.model, start))?;
        let total = most_evaluations(starts.len(), max_evaluations as usize) as u64;
        // Evaluations of the earlier searches, and of the current one so far: each search counts from 1.
        let (mut before, mut last) = (0, 0);
        let mut observe = |progress: &crate::search::Progress<'_>| {
            let now = progress.evaluations as u64;
            if now < last {
                before += last;
            }
            last = now;
            context.report((before + now).min(total), total);
            if context.is_cancelled() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let (view, limit) = (scene.full(), max_evaluations as usize);
        let searching = scene.view.searching()?;
        let found = explore(&view, scene.view.judges(&searching), &starts, (&ranges, limit), &mut observe)
            .map_err(|error| NodeFailure::new(format!("explore: {error}")))?;
        // A cancelled search has no result.
        context.check()?;
        let blocks = scene.blocks(&found.parameters)?.to_parts().to_vec();
        write("explore", &ExploredWire { found: PolishedWire::of(found), blocks })
    }
}
