//! `select`: stage two, the scores of all candidates. `scout`: the same on the coarse picture.

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
    pub(crate) model: String,
    pub(crate) candidates: Vec<CandidateWire>,
}

/// The node type, under one of its kinds.
#[derive(Debug)]
pub(super) struct Select {
    pub(super) kind: &'static str,
}

impl NodeType for Select {
    fn kind(&self) -> &'static str {
        self.kind
    }

    fn run(&self, parameters: &[u8], inputs: &[Blob], context: &RunContext) -> Result<Vec<u8>, NodeFailure> {
        let parameters: SelectParameters = read("parameters of select", parameters)?;
        let scene = Scene::read(&parameters.model, inputs, context)?;
        let candidates = parameters.candidates.into_iter().map(|wire| wire.candidate(scene.model));
        let candidates = candidates.collect::<Result<Vec<_>, _>>()?;
        let done = AtomicU64::new(0);
        let each = || context.report(1 + done.fetch_add(1, Ordering::Relaxed), candidates.len() as u64);
        let judged = judge_candidates(&scene.full(), &scene.view.judge, &candidates, each)
            .map_err(|error| NodeFailure::new(format!("a candidate cannot be judged: {error}")))?;
        write("scores", &ScoresWire::of(&judged))
    }
}
