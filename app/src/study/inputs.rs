//! The inputs of the cells of a study.

use super::{cells::Cell, file::Study};
use crate::outputs::OutFolder;
use lookalike::{
    graph::Blob,
    light::Environment,
    scene::{Camera, Circle, Geometry, SceneError},
};
use std::sync::Arc;

/// A light with its encoding for nodes.
#[derive(Debug)]
pub(super) struct Light {
    pub(super) environment: Arc<Environment>,
    pub(super) encoded: Blob,
}

/// The inputs of all cells.
#[derive(Debug)]
pub(super) struct Inputs {
    pub(super) study: Study,
    pub(super) cells: Vec<Cell>,
    pub(super) materials: Vec<Blob>,
    pub(super) lights: Vec<Light>,
    pub(super) out: OutFolder,
    pub(super) workers: usize,
}

/// The sphere that fills a photo.
pub(super) fn geometry(size: u32) -> Result<Geometry, SceneError> {
    let size = size as usize;
    Geometry::sphere(size, size, Circle::inscribed(size, size), Camera::Orthographic)
}
