//! `select`: stage two, the scores of all candidates.

use super::view::Scene;
use crate::{
    fit::judge_candidates,
    graph::{Blob, NodeFailure, NodeType, RunContext},
    nodes::wire::{CandidateWire, ScoresWire, read, write},
};
use serde::{Deserialize, Serialize};
use std::sync::atomic::{AtomicU64, Ordering};

#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct SelectParameters {
    pub(crate) candidates: Vec<CandidateWire>,
}

#[derive(Debug)]
pub(super) struct Select;

impl NodeType for Select {
    fn kind(&self) -> &'static str {
        super::SELECT
    }

    fn run(&self, parameters: &[u8], inputs: &[Blob], context: &RunContext) -> Result<Vec<u8>, NodeFailure> {
        let parameters: SelectParameters = read("parameters of select", parameters)?;
        let scene = Scene::read(inputs, context)?;
        let model = scene.view.model;
        let candidates = parameters.candidates.into_iter().map(|wire| wire.candidate(model));
        let candidates = candidates.collect::<Result<Vec<_>, _>>()?;
        let done = AtomicU64::new(0);
        let each = || context.report(1 + done.fetch_add(1, Ordering::Relaxed), candidates.len() as u64);
        let judged = judge_candidates(&scene.full(), &scene.view.judge, &candidates, each)
            .map_err(|error| NodeFailure::new(format!("a candidate cannot be judged: {error}")))?;
        write("scores", &ScoresWire::of(&judged))
    }
}
