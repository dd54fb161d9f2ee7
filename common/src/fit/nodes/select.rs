//! `select`: stage two, the scores of all candidates.

use super::view::Scene;
use crate::{
    fit::{
        judge_candidates,
        wire::{CandidateWire, ScoresWire, read, write},
    },
    graph::{Blob, NodeFailure, NodeType, RunContext},
};
use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, Serialize, Deserialize)]
pub(in crate::fit) struct SelectParameters {
    pub(in crate::fit) candidates: Vec<CandidateWire>,
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
        let judged = judge_candidates(&scene.full(), &scene.view.judge, &candidates)
            .map_err(|error| NodeFailure::new(format!("a candidate cannot be judged: {error}")))?;
        write("scores", &ScoresWire::of(&judged))
    }
}
