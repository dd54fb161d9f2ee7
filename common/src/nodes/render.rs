//! `render`: a full image by the direct integrator, of a measured material or of a model. Studies use it for their photos, and to
//! measure the time of one direct rendering.
//!
//! Inputs: the environment; for a measured material, its file in MERL's format.

use crate::{
    brdf::{self, Material, Reflectance, merl::MerlTable},
    graph::{Blob, NodeFailure, NodeType, RunContext},
    light::LightDistribution,
    nodes::wire::{EnvironmentWire, ImageWire, read, write},
    render::image::Shot,
    scene::{Geometry, GeometrySpec},
};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct RenderParameters {
    pub(crate) geometry: GeometrySpec,
    pub(crate) samples: u32,
    pub(crate) seed: u64,
    /// Model and flat parameters; `None` if the second input is a measured material.
    pub(crate) material: Option<(String, Vec<f64>)>,
}

#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct RenderedWire {
    pub(crate) image: ImageWire,
    /// Standard error of a typical pixel relative to its own luminance.
    pub(crate) noise: Option<f64>,
}

#[derive(Debug)]
pub(super) struct Render;

impl NodeType for Render {
    fn kind(&self) -> &'static str {
        super::RENDER
    }

    fn run(&self, parameters: &[u8], inputs: &[Blob], context: &RunContext) -> Result<Vec<u8>, NodeFailure> {
        let parameters: RenderParameters = read("parameters of render", parameters)?;
        let Some((environment, measured)) = inputs.split_first() else {
            return Err(NodeFailure::new("render takes an environment, found no input"));
        };
        let light = context.decoded(environment, |bytes| {
            let environment = read::<EnvironmentWire>("environment", bytes)?.environment()?;
            Ok(LightDistribution::new(Arc::new(environment)))
        })?;
        let geometry =
            Geometry::from_spec(&parameters.geometry, None).map_err(|error| NodeFailure::new(error.to_string()))?;
        let measured = match measured {
            [] => None,
            [file, ..] => Some(context.decoded(file, |bytes| {
                MerlTable::read("measured material", bytes).map_err(|error| NodeFailure::new(error.to_string()))
            })?),
        };
        let analytic = parameters.material.as_ref().map(|(model, flat)| {
            let model = brdf::model(model).map_err(|error| NodeFailure::new(error.to_string()))?;
            Material::new(model, flat.clone()).map_err(|error| NodeFailure::new(error.to_string()))
        });
        let analytic = analytic.transpose()?;
        let reflectance: &dyn Reflectance = match (&analytic, &measured) {
            (Some(material), _) => material,
            (None, Some(table)) => &**table,
            (None, None) => return Err(NodeFailure::new("render takes a material, found none")),
        };
        let shot = Shot {
            geometry: &geometry,
            light: &light,
            reflectance,
            samples: parameters.samples.max(1),
            seed: parameters.seed,
        };
        let rendering = shot.render(|| ());
        let noise = rendering.noise.map(|noise| noise.typical);
        write("rendering", &RenderedWire { image: ImageWire::of(&rendering.image), noise })
    }
}
