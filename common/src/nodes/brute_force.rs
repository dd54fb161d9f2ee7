//! `brute-force`: the baseline of studies, pattern search on CSSIM at full resolution from one start.
//!
//! Inputs: the view; then the shards of the full-resolution table over the model's whole range of widths. With the direct integrator,
//! instead of the shards: the environment, and the normal map if the surface has one.

use super::{
    search::{DirectScene, DirectWire},
    view::{Scene, View, model_of},
};
use crate::{
    brdf::{Material, Model},
    fit::brute_force,
    graph::{Blob, NodeFailure, NodeType, RunContext},
    image::Image,
    math::narrow,
    nodes::wire::{PolishedWire, read, write},
    render::integrator::Integrator,
};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::ops::ControlFlow;

#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct BruteForceParameters {
    pub(crate) model: String,
    pub(crate) start: Vec<f64>,
    /// Most evaluations; 0 for the limit of the search.
    pub(crate) max_evaluations: u32,
    pub(crate) direct: Option<DirectWire>,
}

#[derive(Debug)]
pub(super) struct BruteForce;

impl NodeType for BruteForce {
    fn kind(&self) -> &'static str {
        super::BRUTE_FORCE
    }

    fn run(&self, parameters: &[u8], inputs: &[Blob], context: &RunContext) -> Result<Vec<u8>, NodeFailure> {
        let parameters: BruteForceParameters = read("parameters of brute-force", parameters)?;
        let outcome = match &parameters.direct {
            None => {
                let scene = Scene::read(&parameters.model, inputs, context)?;
                let full = scene.full();
                search(&parameters, &scene.view, context, &|point| Some(full.render(point)))?
            }
            Some(direct) => {
                let Some((view, of_scene)) = inputs.split_first() else {
                    return Err(NodeFailure::new("brute-force takes a view and an environment, found no input"));
                };
                let view = context.decoded(view, View::decode)?;
                let model = model_of(&parameters.model)?;
                let scene = DirectScene::read(direct, of_scene, context)?;
                if (scene.geometry.width(), scene.geometry.height()) != (view.width, view.height) {
                    return Err(NodeFailure::new("the direct integrator's scene has another size than the view"));
                }
                let outcome = search(&parameters, &view, context, &|point| direct_image(model, (&view, &scene), point));
                view.judge.free_buffers();
                outcome?
            }
        };
        // A cancelled search has no result.
        context.check()?;
        write("brute force", &outcome)
    }
}

fn search(
    parameters: &BruteForceParameters,
    view: &View,
    context: &RunContext,
    render: &dyn Fn(&[f64]) -> Option<Image>,
) -> Result<PolishedWire, NodeFailure> {
    let limit = usize::try_from(parameters.max_evaluations).ok().filter(|&limit| limit > 0);
    let total = limit.unwrap_or(2000 * parameters.start.len()) as u64;
    let mut observe = |progress: &crate::search::Progress<'_>| {
        context.report(progress.evaluations as u64, total);
        if context.is_cancelled() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let score = |point: &[f64]| view.judge.score(&render(point)?).ok();
    let value = |point: &[f64]| score(point).map_or(f64::NAN, |s| view.by.pick(s.cssim, s.cssim_object));
    let minimum = brute_force(model_of(&parameters.model)?, value, &parameters.start, limit, &mut observe)
        .map_err(|error| NodeFailure::new(format!("brute force: {error}")))?;
    let score =
        score(&minimum.point).ok_or_else(|| NodeFailure::new("brute force ended at a point that cannot be scored"))?;
    Ok(PolishedWire::of_minimum(minimum, &score))
}

/// The image of a flat parameter vector over black by the direct integrator; `None` for parameters outside the model.
fn direct_image(model: &'static dyn Model, (view, scene): (&View, &DirectScene), parameters: &[f64]) -> Option<Image> {
    let material = Material::new(model, parameters.to_vec()).ok()?;
    let DirectScene { geometry, light, samples, seed } = scene;
    let integrator = Integrator { geometry, light, samples: *samples, seed: *seed };
    let radiance: Vec<_> = view.pixels.par_iter().map(|pixel| integrator.pixel(*pixel, &material)).collect();
    let mut image = Image::new(view.width, view.height);
    for ([column, row], radiance) in view.pixels.iter().zip(radiance) {
        let place = *row as usize * view.width + *column as usize;
        image.pixels_mut()[place] = narrow(radiance * f64::from(view.coverage[place]));
    }
    Some(image)
}
