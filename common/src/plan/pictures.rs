//! The pictures at the end of a fit: the nodes that make them, and the checks of their outputs.

use super::verify::{check_score, wrong};
use crate::{
    graph::{Blob, NodeId, PlanError},
    image::Image,
    metric::Blocks,
    nodes::{
        ReportWire,
        wire::{ImageWire, read},
    },
};
use std::collections::BTreeMap;

/// The pictures that were requested.
#[derive(Debug, Default)]
pub(super) struct Pictures {
    /// Nodes in the order of their pictures, each with its number of pictures.
    asked: Vec<(NodeId, usize)>,
    come: BTreeMap<NodeId, Made>,
}

/// All pictures in order, and the errors of the last one.
#[derive(Debug)]
pub(super) struct Made {
    pub(super) images: Vec<Image>,
    /// Per window.
    pub(super) error: Vec<f64>,
    pub(super) blocks: Blocks,
    /// What noise like that of the photo costs, over the image and over the object; `None` if the noise is unknown.
    pub(super) noise_floor: Option<(f64, f64)>,
}

impl Pictures {
    /// Registers a node that makes `count` pictures.
    pub(super) fn ask(&mut self, node: NodeId, count: usize) {
        self.asked.push((node, count));
    }

    /// Whether this node makes pictures.
    pub(super) fn is_of(&self, node: NodeId) -> bool {
        self.asked.iter().any(|(asked, _)| *asked == node)
    }

    /// Takes the pictures of a node, each of `width` x `height`. Returns the pictures of all nodes once the last node is done.
    pub(super) fn made(
        &mut self,
        node: NodeId,
        output: &Blob,
        (width, height): (usize, usize),
    ) -> Result<Option<Made>, PlanError> {
        let expected = self.asked.iter().find(|(asked, _)| *asked == node).map_or(0, |(_, count)| *count);
        let made = checked(output, expected, (width, height))?;
        self.come.insert(node, made);
        if self.come.len() < self.asked.len() {
            return Ok(None);
        }
        let mut all: Option<Made> = None;
        for (node, _) in &self.asked {
            let Some(mut made) = self.come.remove(node) else { continue };
            if let Some(before) = all {
                made.images.splice(0..0, before.images);
            }
            all = Some(made);
        }
        Ok(all)
    }
}

fn checked(output: &Blob, expected: usize, (width, height): (usize, usize)) -> Result<Made, PlanError> {
    let report: ReportWire = read("report", output).map_err(|failure| wrong("pictures", &failure))?;
    let images = report.images.into_iter().map(ImageWire::image).collect::<Result<Vec<_>, _>>();
    let images = images.map_err(|failure| wrong("pictures", &failure))?;
    if images.len() != expected {
        return Err(wrong(format!("{expected} pictures"), &images.len()));
    }
    for image in &images {
        if (image.width(), image.height()) != (width, height) {
            let found = format!("{} x {}", image.width(), image.height());
            return Err(wrong(format!("pictures of {width} x {height}"), &found));
        }
        if let Some(value) = image.pixels().iter().flatten().find(|value| !value.is_finite()) {
            return Err(wrong("finite pictures", value));
        }
    }
    let windows = width.saturating_sub(WINDOW - 1) * height.saturating_sub(WINDOW - 1);
    if report.error.len() != windows {
        return Err(wrong(format!("the error of {windows} windows"), &report.error.len()));
    }
    if let Some(error) = report.error.iter().find(|error| !error.is_finite()) {
        return Err(wrong("a finite error", error));
    }
    if let Some((image, object)) = report.noise_floor {
        check_score(image).and_then(|()| check_score(object))?;
    }
    let (found, noise_floor) = (report.blocks.len(), report.noise_floor);
    match Blocks::from_parts(report.blocks) {
        Some(blocks) => Ok(Made { images, error: report.error, blocks, noise_floor }),
        None => Err(wrong("the windows in blocks", &found)),
    }
}

/// Side of the metric's windows, in pixels: an image of N columns has N + 1 - `WINDOW` of them across, and likewise down.
const WINDOW: usize = 11;
