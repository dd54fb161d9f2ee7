//! `appraise`: scores given parameter vectors, for studies: CSSIM, and Eq. 1 (with the tangent below its knee) for several gammas over
//! all pixels that the object covers completely.
//!
//! Inputs: the view; the shards of the full-resolution table, in order.

use super::view::Scene;
use crate::{
    graph::{Blob, NodeFailure, NodeType, RunContext},
    metric::cost::{Compression, cost},
    nodes::wire::{check_parameters, read, write},
};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct AppraiseParameters {
    pub(crate) model: String,
    pub(crate) points: Vec<Vec<f64>>,
    pub(crate) gammas: Vec<f64>,
    /// Mean luminance of the photo over its usable pixels.
    pub(crate) mean_radiance: f64,
}

/// One per point: CSSIM over the image, over the object, and the cost for each gamma.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct AppraisedWire(pub(crate) Vec<(f64, f64, Vec<f64>)>);

#[derive(Debug)]
pub(super) struct Appraise;

impl NodeType for Appraise {
    fn kind(&self) -> &'static str {
        super::APPRAISE
    }

    fn run(&self, parameters: &[u8], inputs: &[Blob], context: &RunContext) -> Result<Vec<u8>, NodeFailure> {
        let parameters: AppraiseParameters = read("parameters of appraise", parameters)?;
        let positive = |x: &f64| x.is_finite() && *x > 0.0;
        if !positive(&parameters.mean_radiance) || !parameters.gammas.iter().all(positive) {
            return Err(NodeFailure::new("gammas and mean radiance must be positive"));
        }
        let scene = Scene::read(&parameters.model, inputs, context)?;
        parameters.points.iter().try_for_each(|point| check_parameters("points", scene.model, point))?;
        let full = scene.full();
        let planes = |image: &crate::image::Image| -> [Vec<f64>; 3] {
            let inside = image.pixels().iter().zip(full.coverage).filter(|(_, coverage)| **coverage >= 1.0);
            let inside: Vec<&[f32; 3]> = inside.map(|(rgb, _)| rgb).collect();
            std::array::from_fn(|c| inside.iter().map(|rgb| f64::from(rgb[c])).collect())
        };
        let photo = planes(&scene.view.photo);
        let weights = vec![1.0; photo[0].len()];
        let compressions: Vec<Compression> =
            parameters.gammas.iter().map(|&gamma| Compression::new(gamma, parameters.mean_radiance)).collect();
        let compressed =
            |c: &Compression| photo.each_ref().map(|plane| plane.iter().map(|&x| c.apply(x.max(0.0))).collect());
        let references: Vec<[Vec<f64>; 3]> = compressions.iter().map(compressed).collect();
        let appraise = |point: &Vec<f64>| {
            let image = full.render(point);
            let score = scene.view.judge.score(&image)?;
            let radiance = planes(&image);
            let costs = compressions.iter().zip(&references).map(|(c, a)| cost(c, &weights, a, &radiance));
            Ok((score.cssim, score.cssim_object, costs.collect()))
        };
        let appraised: Result<Vec<_>, crate::metric::MetricError> =
            parameters.points.par_iter().map(appraise).collect();
        let appraised = appraised.map_err(|error| NodeFailure::new(format!("a match cannot be judged: {error}")))?;
        write("appraisals", &AppraisedWire(appraised))
    }
}
