//! The direct integrator in a fit: what its searches read, and how their claims are checked.

use super::{FitPlanner, add};
use crate::{
    fit::{DirectPixels, Integration},
    graph::{GraphEdit, Input, PlanError},
    light::LightDistribution,
    nodes::{DirectWire, wire::ImageWire},
    render::transport::Pixel,
};
use std::sync::Arc;

impl FitPlanner {
    /// What tells a search to render directly, and what it reads for that; nothing with tables.
    pub(super) fn direct_searches(
        &self,
        graph: &mut GraphEdit<'_>,
    ) -> Result<(Option<DirectWire>, Vec<Input>), PlanError> {
        let Integration::Direct { samples } = self.method.integration else { return Ok((None, Vec::new())) };
        let geometry = self.capture.geometry();
        let environment = self.environment.ok_or_else(|| PlanError::new("the environment was not added"))?;
        let mut inputs = vec![Input::Blob(environment)];
        if let Some(map) = geometry.normal_map() {
            inputs.push(Input::Blob(add(graph, "normal map", &ImageWire::of(&map.to_image()))?));
        }
        let (geometry, has_normals) = (geometry.spec(), inputs.len() > 1);
        Ok((Some(DirectWire { geometry, has_normals, samples, seed: self.method.seed }), inputs))
    }

    /// The light as the direct integrator samples it, made once; `None` with tables.
    pub(super) fn distribution(&mut self) -> Option<Arc<LightDistribution>> {
        if self.method.integration == Integration::Tables {
            return None;
        }
        let environment = self.capture.environment();
        Some(Arc::clone(
            self.distribution.get_or_insert_with(|| Arc::new(LightDistribution::new(Arc::clone(environment)))),
        ))
    }

    /// These pixels of the capture by the direct integrator; `None` with tables.
    pub(super) fn direct_pixels<'a>(
        &'a self,
        light: Option<&'a LightDistribution>,
        pixels: &'a [Pixel],
    ) -> Option<DirectPixels<'a>> {
        let Integration::Direct { samples } = self.method.integration else { return None };
        Some(DirectPixels { geometry: self.capture.geometry(), light: light?, pixels, samples, seed: self.method.seed })
    }
}
