//! The settings of `lookalike render`.

use super::{EnvironmentSettings, ModelName, ModelParams, ViewSettings};
use std::{
    num::NonZeroUsize,
    path::{Path, PathBuf},
};

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

impl RenderSettings {
    /// The files that it reads.
    pub(crate) fn files(&self) -> Vec<&Path> {
        let table = match &self.material {
            Material::Measured(path) => Some(path.as_path()),
            Material::Analytic { .. } => None,
        };
        let others = [table, self.view.normals.as_deref()].into_iter().flatten();
        [self.environment.path.as_path()].into_iter().chain(others).collect()
    }
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
