//! `transport`, `transport-coarse` and `transport-full`: integrates the transport table of a range of pixels.
//!
//! Inputs: the environment; the list of pixels (an encoded `Vec<Pixel>`); the normal map if the surface has one.

use crate::{
    graph::{Blob, NodeFailure, NodeType, RunContext},
    nodes::wire::{EnvironmentWire, ImageWire, LobeWire, TableWire, read, write},
    render::{
        pyramid::LightPyramid,
        transport::{Accuracy, Pixel, TransportPlan},
    },
    scene::{Geometry, GeometrySpec},
};
use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct TransportParameters {
    pub(crate) geometry: GeometrySpec,
    pub(crate) lobes: Vec<LobeWire>,
    pub(crate) tolerance: f64,
    pub(crate) footprint: f64,
    /// Index of the first pixel in the list, and number of pixels.
    pub(crate) range: (u32, u32),
}

/// The node type, under one of its kinds.
#[derive(Debug)]
pub(super) struct Transport {
    pub(super) kind: &'static str,
}

impl NodeType for Transport {
    fn kind(&self) -> &'static str {
        self.kind
    }

    fn run(&self, parameters: &[u8], inputs: &[Blob], context: &RunContext) -> Result<Vec<u8>, NodeFailure> {
        let parameters: TransportParameters = read("parameters of transport", parameters)?;
        let (environment, pixels, normals) = match inputs {
            [environment, pixels] => (environment, pixels, None),
            [environment, pixels, normals] => (environment, pixels, Some(normals)),
            _ => return Err(NodeFailure::new(format!("transport takes 2 or 3 inputs, found {}", inputs.len()))),
        };
        let pyramid = context.decoded(environment, |bytes| {
            Ok(LightPyramid::new(read::<EnvironmentWire>("environment", bytes)?.environment()?))
        })?;
        let pixels = context.decoded(pixels, |bytes| read::<Vec<Pixel>>("list of pixels", bytes))?;
        let normals = normals
            .map(|map| context.decoded(map, |bytes| read::<ImageWire>("normal map", bytes)?.image()))
            .transpose()?;
        let geometry = Geometry::from_spec(&parameters.geometry, normals.as_deref())
            .map_err(|error| NodeFailure::new(error.to_string()))?;
        let (first, count) = (parameters.range.0 as usize, parameters.range.1 as usize);
        let range = first..first.saturating_add(count);
        let shard = pixels.get(range.clone()).ok_or_else(|| {
            NodeFailure::new(format!("expected pixels {range:?} of the list, found {} in it", pixels.len()))
        })?;
        let outside = |p: &&Pixel| p[0] as usize >= geometry.width() || p[1] as usize >= geometry.height();
        if let Some(pixel) = shard.iter().find(outside) {
            return Err(NodeFailure::new(format!("pixel {pixel:?} lies outside the image")));
        }
        let accuracy = Accuracy { tolerance: parameters.tolerance, footprint: parameters.footprint };
        let lobes = parameters.lobes.into_iter().map(LobeWire::lobe).collect::<Result<Vec<_>, _>>()?;
        let plan = TransportPlan { lobes, accuracy };
        write("transport table", &TableWire::of(plan.integrate(&geometry, &pyramid, shard)))
    }
}
