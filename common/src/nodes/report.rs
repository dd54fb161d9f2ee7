//! `report`: the pictures of a finished fit: full renderings of chosen parameter vectors and the error map of the last one.

use super::view::Scene;
use crate::{
    graph::{Blob, NodeFailure, NodeType, RunContext},
    nodes::wire::{ImageWire, read, write},
};
use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct ReportParameters {
    pub(crate) parameters: Vec<Vec<f64>>,
}

#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct ReportWire {
    /// One rendering per parameter vector, over black.
    pub(crate) images: Vec<ImageWire>,
    /// 1 minus the product of the five features at each window of the last image: `(height - 10) x (width - 10)`.
    pub(crate) error: Vec<f64>,
}

#[derive(Debug)]
pub(super) struct Report;

impl NodeType for Report {
    fn kind(&self) -> &'static str {
        super::REPORT
    }

    fn run(&self, parameters: &[u8], inputs: &[Blob], context: &RunContext) -> Result<Vec<u8>, NodeFailure> {
        let parameters: ReportParameters = read("parameters of report", parameters)?;
        let scene = Scene::read(inputs, context)?;
        let images: Vec<_> = parameters.parameters.iter().map(|p| scene.full().render(p)).collect();
        let error = match images.last() {
            Some(last) => scene.view.judge.error_map(last).map(|map| map.error),
            None => Ok(Vec::new()),
        };
        let error = error.map_err(|error| NodeFailure::new(format!("the match cannot be judged: {error}")))?;
        write("report", &ReportWire { images: images.iter().map(ImageWire::of).collect(), error })
    }
}
