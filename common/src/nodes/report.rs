//! `report`: the pictures of a finished fit: full renderings of chosen parameter vectors and the error map of the last one.

use super::view::Scene;
use crate::{
    fit::JudgedBy,
    graph::{Blob, NodeFailure, NodeType, RunContext},
    metric::Block,
    nodes::wire::{ImageWire, read, write},
};
use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct ReportParameters {
    pub(crate) model: String,
    pub(crate) parameters: Vec<Vec<f64>>,
    /// The relative noise of the photo, if it is known.
    pub(crate) noise: Option<f64>,
}

#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct ReportWire {
    /// One rendering per parameter vector, over black.
    pub(crate) images: Vec<ImageWire>,
    /// 1 minus the product of the five features at each window of the last image: `(height - 10) x (width - 10)`.
    pub(crate) error: Vec<f64>,
    /// The windows of the last image that count for the score, as the parts of [`Blocks`](crate::metric::Blocks).
    pub(crate) blocks: Vec<Block>,
    /// What noise like that of the photo costs the last image: CSSIM over the image, and over the object.
    pub(crate) noise_floor: Option<(f64, f64)>,
}

#[derive(Debug)]
pub(super) struct Report;

impl NodeType for Report {
    fn kind(&self) -> &'static str {
        super::REPORT
    }

    fn run(&self, parameters: &[u8], inputs: &[Blob], context: &RunContext) -> Result<Vec<u8>, NodeFailure> {
        let parameters: ReportParameters = read("parameters of report", parameters)?;
        let scene = Scene::read(&parameters.model, inputs, context)?;
        let images: Vec<_> = parameters.parameters.iter().map(|p| scene.full().render(p)).collect();
        let judge = &scene.view.judge;
        let last = images.last().ok_or_else(|| NodeFailure::new("report takes parameters, found none"))?;
        let cannot = |error| NodeFailure::new(format!("the match cannot be judged: {error}"));
        let maps = judge.maps(last).map_err(cannot)?;
        let noise_floor = parameters.noise.map(|noise| scene.view.noise_floor(last, noise)).transpose();
        let noise_floor = noise_floor.map_err(cannot)?.map(|score| (score.cssim, score.cssim_object));
        let blocks = judge.blocks(&maps, scene.view.by == JudgedBy::Object).to_parts().to_vec();
        let images = images.iter().map(ImageWire::of).collect();
        write("report", &ReportWire { images, error: maps.error().error, blocks, noise_floor })
    }
}
