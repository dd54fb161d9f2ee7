//! The settings of `lookalike render`.

use super::{EnvironmentSettings, ModelName, ModelParams, ViewSettings};
use std::{num::NonZeroUsize, path::PathBuf};

/// A sphere, or a map of normals, of one material under one light.
#[derive(Debug, Clone, PartialEq)]
pub struct RenderSettings {
    /// The material.
    pub material: Material,
    /// The light.
    pub environment: EnvironmentSettings,
    /// Camera and shape.
    pub view: ViewSettings,
    /// Width and height of the image in pixels; ignored with a map of normals, whose size counts.
    pub size_px: NonZeroUsize,
    /// Directions per pixel.
    pub samples: NonZeroUsize,
    /// The seed of the directions.
    pub seed: u64,
    /// The image to write; its extension is the format.
    pub out: PathBuf,
}

/// A material to render.
#[derive(Debug, Clone, PartialEq)]
pub enum Material {
    /// A table in MERL's file format.
    Measured(PathBuf),
    /// A model with parameters.
    Analytic {
        /// The model.
        model: ModelName,
        /// Its parameters; the model checks that they are complete.
        params: ModelParams,
    },
}
