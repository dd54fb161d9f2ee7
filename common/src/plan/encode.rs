//! Encodes values of a plan into the bytes that nodes read.

use crate::{
    graph::{Blob, BlobHash, GraphEdit, NodeFailure, PlanError},
    light::Environment,
    nodes::wire::{EnvironmentWire, write},
};
use serde::Serialize;

/// Encodes a map for the nodes of a fit, for [`FitPlanner::with_encoded_light`](super::FitPlanner::with_encoded_light).
///
/// # Errors
/// When it does not fit into a blob.
pub fn encode_light(environment: &Environment) -> Result<Blob, PlanError> {
    Ok(Blob::new(encode("environment", &EnvironmentWire::of(environment))?))
}

pub(super) fn add<T: Serialize>(graph: &mut GraphEdit<'_>, what: &str, value: &T) -> Result<BlobHash, PlanError> {
    graph.add_blob(encode(what, value)?)
}

pub(super) fn encode<T: Serialize>(what: &str, value: &T) -> Result<Vec<u8>, PlanError> {
    write(what, value).map_err(other)
}

pub(super) fn other(failure: NodeFailure) -> PlanError {
    PlanError::new(failure.to_string())
}

pub(super) fn index(value: usize) -> u32 {
    u32::try_from(value).unwrap_or(u32::MAX)
}
