//! The direct integrator in a fit: the inputs of its searches, and the means to check their results.

use super::scene_tables::SceneTables;
use crate::{
    fit::{DirectPixels, Integration},
    graph::{GraphEdit, Input, PlanError},
    light::LightDistribution,
    nodes::DirectWire,
    render::transport::Pixel,
};
use std::sync::Arc;

impl SceneTables {
    /// How searches render by the direct integrator, and their further inputs; `None` and no inputs with tables.
    pub(super) fn direct_searches(
        &self,
        graph: &mut GraphEdit<'_>,
    ) -> Result<(Option<DirectWire>, Vec<Input>), PlanError> {
        let Integration::Direct { samples } = self.method.integration else { return Ok((None, Vec::new())) };
        let (direct, inputs) = self.direct_scene(samples, graph)?;
        Ok((Some(direct), inputs))
    }

    /// How a node renders by the direct integrator, and its further inputs: the environment, and the normal map if there is one.
    pub(super) fn direct_scene(
        &self,
        samples: u32,
        graph: &mut GraphEdit<'_>,
    ) -> Result<(DirectWire, Vec<Input>), PlanError> {
        let inputs = self.light_and_normals(graph)?;
        let (geometry, has_normals) = (self.capture.geometry().spec(), inputs.len() > 1);
        Ok((DirectWire { geometry, has_normals, samples, seed: self.method.seed }, inputs))
    }

    /// The light with its sampling density for the direct integrator, computed once; `None` with tables.
    pub(super) fn distribution(&mut self) -> Option<Arc<LightDistribution>> {
        if self.method.integration == Integration::Tables {
            return None;
        }
        let environment = self.capture.environment();
        Some(Arc::clone(
            self.distribution.get_or_insert_with(|| Arc::new(LightDistribution::new(Arc::clone(environment)))),
        ))
    }

    /// The renderer of these pixels by the direct integrator; `None` with tables.
    pub(super) fn direct_pixels<'a>(
        &'a self,
        light: Option<&'a LightDistribution>,
        pixels: &'a [Pixel],
    ) -> Option<DirectPixels<'a>> {
        let Integration::Direct { samples } = self.method.integration else { return None };
        Some(DirectPixels { geometry: self.capture.geometry(), light: light?, pixels, samples, seed: self.method.seed })
    }
}
