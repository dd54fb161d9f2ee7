//! The pictures at the end of a fit: the nodes that make them, and the checks of their outputs.

use super::verify::wrong;
use crate::{
    graph::{Blob, NodeId, PlanError},
    image::Image,
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

/// All pictures in order, and the error of the last one per window.
pub(super) type Made = (Vec<Image>, Vec<f64>);

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
        let (mut images, mut error) = (Vec::new(), Vec::new());
        for (node, _) in &self.asked {
            let Some(made) = self.come.remove(node) else { continue };
            images.extend(made.0);
            error = made.1;
        }
        Ok(Some((images, error)))
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
    match report.error.iter().find(|error| !error.is_finite()) {
        Some(error) => Err(wrong("a finite error", error)),
        None => Ok((images, report.error)),
    }
}

/// Side of the metric's windows, in pixels: an image of N columns has N + 1 - `WINDOW` of them across, and likewise down.
const WINDOW: usize = 11;
