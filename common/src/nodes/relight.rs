//! `relight`: scores of the neighbours of a match against it, under lights made by formula. It has no inputs.

use super::view::model_of;
use crate::{
    fit::relight::relit,
    graph::{Blob, NodeFailure, NodeType, RunContext},
    nodes::wire::{check_parameters, read, write},
};
use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct RelightParameters {
    /// Model and flat parameters of the match, then of its neighbours.
    pub(crate) points: Vec<(String, Vec<f64>)>,
}

/// For each neighbour the score under each light.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct RelitWire(pub(crate) Vec<Vec<f64>>);

#[derive(Debug)]
pub(super) struct Relight;

impl NodeType for Relight {
    fn kind(&self) -> &'static str {
        super::RELIGHT
    }

    fn run(&self, parameters: &[u8], _inputs: &[Blob], _context: &RunContext) -> Result<Vec<u8>, NodeFailure> {
        let RelightParameters { points } = read("parameters of relight", parameters)?;
        let point = |(name, point): (String, Vec<f64>)| {
            let model = model_of(&name)?;
            check_parameters("points", model, &point)?;
            Ok((model, point))
        };
        let points = points.into_iter().map(point).collect::<Result<Vec<_>, NodeFailure>>()?;
        let relit = relit(&points).map_err(|error| NodeFailure::new(format!("relight: {error}")))?;
        write("relight", &RelitWire(relit))
    }
}
