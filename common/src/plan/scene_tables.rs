//! The tables of one capture and the nodes that wait for them, for fits and surveys.

use super::{
    encode::{add, encode, encode_light, index},
    limits::{FitError, check_sizes},
    pixels::{Grid, covered_pixels, intensities},
    tables::{FULL_PER_OCTAVE, FULL_SHARD},
    verify::{self, Shard},
};
use crate::{
    fit::{JudgedBy, Method},
    graph::{Blob, BlobHash, GraphEdit, Input, NodeId, NodeSpec, Placement, PlanError},
    light::LightDistribution,
    nodes::{
        self, TransportParameters, ViewWire,
        wire::{ImageWire, LobeWire},
    },
    render::{
        spans::{LobeKnots, Spans},
        transport::{Accuracy, Pixel},
    },
    scene::Capture,
};
use serde::Serialize;
use std::{collections::BTreeMap, sync::Arc};

/// The tables of one capture and the nodes that wait for them.
#[derive(Debug)]
pub(super) struct SceneTables {
    pub(super) capture: Arc<Capture>,
    /// The settings that all models of a fit have in common.
    pub(super) method: Method,
    /// Exposure of the display transform before CSSIM.
    exposure: f64,
    /// Mean luminance of the usable pixels.
    pub(super) mean_radiance: f64,
    /// The pixels that count for the score, in the order of the full-resolution table.
    pub(super) pixels: Vec<Pixel>,
    /// Where candidates are judged, polish runs and pictures are made.
    pub(super) stage_two: Placement,
    /// The encoded light, if the caller has encoded it.
    pub(super) light: Option<Blob>,
    pub(super) environment: Option<BlobHash>,
    /// The light with its sampling density, once a direct rendering has needed it.
    pub(super) distribution: Option<Arc<LightDistribution>>,
    view: Option<BlobHash>,
    /// Shards of tables whose output has not arrived.
    shards: BTreeMap<NodeId, Shard>,
    /// Full-resolution tables by what they span: each is integrated once.
    tables: Vec<(Spans, Vec<Input>)>,
}

impl SceneTables {
    /// The scene of a capture, without tables.
    ///
    /// # Errors
    /// When a setting is out of range or the photo is black or too large.
    pub(super) fn new(capture: Arc<Capture>, method: Method, exposure: f64) -> Result<Self, FitError> {
        method.check()?;
        check_sizes(&capture, &method)?;
        let candidates = intensities(&capture);
        let mean_radiance = candidates.iter().map(|c| c.intensity).sum::<f64>() / candidates.len() as f64;
        if mean_radiance.is_nan() || mean_radiance <= 0.0 {
            return Err(FitError::Black);
        }
        let pixels = covered_pixels(&capture);
        Ok(Self {
            capture,
            method,
            exposure,
            mean_radiance,
            pixels,
            stage_two: Placement::Coordinator,
            light: None,
            environment: None,
            distribution: None,
            view: None,
            shards: BTreeMap::new(),
            tables: Vec::new(),
        })
    }

    /// Adds the light to the graph.
    pub(super) fn keep_light(&mut self, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        let light = self.light.take().map_or_else(|| encode_light(self.capture.environment()), Ok)?;
        self.environment = Some(graph.keep(light)?);
        Ok(())
    }

    /// The environment, and the normal map if the surface has one.
    pub(super) fn light_and_normals(&self, graph: &mut GraphEdit<'_>) -> Result<Vec<Input>, PlanError> {
        let environment = self.environment.ok_or_else(|| PlanError::new("the environment was not added"))?;
        let mut inputs = vec![Input::Blob(environment)];
        if let Some(map) = self.capture.geometry().normal_map() {
            inputs.push(Input::Blob(add(graph, "normal map", &ImageWire::of(&map.to_image()))?));
        }
        Ok(inputs)
    }

    /// Adds the shards of a table. `pixels` is the blob with the list of pixels, their number, and the pixels per shard.
    pub(super) fn add_transport(
        &mut self,
        graph: &mut GraphEdit<'_>,
        (kind, what): (&str, &str),
        pixels: (BlobHash, usize, usize),
        lobes: Vec<LobeKnots>,
        accuracy: Accuracy,
    ) -> Result<Vec<Input>, PlanError> {
        let (list, count, shard) = pixels;
        let mut inputs = self.light_and_normals(graph)?;
        inputs.insert(1, Input::Blob(list));
        let geometry = self.capture.geometry().spec();
        let mut shards = Vec::new();
        for first in (0..count).step_by(shard) {
            let range = (index(first), index(shard.min(count - first)));
            let parameters = TransportParameters {
                geometry,
                lobes: lobes.iter().map(LobeWire::of).collect(),
                tolerance: accuracy.tolerance,
                footprint: accuracy.footprint,
                range,
            };
            let spec = NodeSpec {
                kind: kind.to_owned(),
                label: format!("transport {what}, pixels {first} to {}", first + range.1 as usize - 1).into(),
                parameters: encode("parameters", &parameters)?,
                inputs: inputs.clone(),
                placement: Placement::Worker,
                priority: 0,
            };
            let node = graph.add_node(spec)?;
            self.shards.insert(node, Shard { pixels: range.1 as usize, lobes: lobes.clone() });
            shards.push(Input::OutputOf(node));
        }
        Ok(shards)
    }

    /// The shards of the full-resolution table over these widths.
    pub(super) fn full_table(&mut self, graph: &mut GraphEdit<'_>, spans: &Spans) -> Result<Vec<Input>, PlanError> {
        if let Some((_, shards)) = self.tables.iter().find(|(known, _)| known == spans) {
            return Ok(shards.clone());
        }
        let list = add(graph, "list of pixels", &self.pixels)?;
        let pixels = (list, self.pixels.len(), FULL_SHARD);
        let what = if self.tables.is_empty() { "in full" } else { "in full again" };
        let shards = self.add_transport(
            graph,
            (nodes::TRANSPORT_FULL, what),
            pixels,
            spans.knots(FULL_PER_OCTAVE),
            Accuracy::FULL,
        )?;
        self.tables.push((spans.clone(), shards.clone()));
        Ok(shards)
    }

    /// Adds a node of `kind` that reads the full-resolution table over these widths.
    pub(super) fn add_judging<T: Serialize>(
        &mut self,
        graph: &mut GraphEdit<'_>,
        (kind, label): (&str, &str),
        spans: &Spans,
        parameters: &T,
    ) -> Result<NodeId, PlanError> {
        let inputs = self.inputs_on_full_table(graph, spans)?;
        self.add_on_view(graph, (kind, label), inputs, parameters)
    }

    /// The view and the full-resolution table over these widths.
    pub(super) fn inputs_on_full_table(
        &mut self,
        graph: &mut GraphEdit<'_>,
        spans: &Spans,
    ) -> Result<Vec<Input>, PlanError> {
        let mut inputs = vec![self.full_view(graph)?];
        inputs.extend(self.full_table(graph, spans)?);
        Ok(inputs)
    }

    /// The view at full resolution.
    pub(super) fn full_view(&mut self, graph: &mut GraphEdit<'_>) -> Result<Input, PlanError> {
        let view = match self.view {
            Some(view) => view,
            None => add(graph, "view", &self.view_wire(Grid::FULL, self.pixels.clone()))?,
        };
        self.view = Some(view);
        Ok(Input::Blob(view))
    }

    /// Adds a node of a kind, with a label, that reads a view and its table.
    pub(super) fn add_on_view<T: Serialize>(
        &self,
        graph: &mut GraphEdit<'_>,
        (kind, label): (&str, &str),
        inputs: Vec<Input>,
        parameters: &T,
    ) -> Result<NodeId, PlanError> {
        graph.add_node(NodeSpec {
            kind: kind.to_owned(),
            label: label.into(),
            parameters: encode("parameters", parameters)?,
            inputs,
            placement: self.stage_two,
            priority: 0,
        })
    }

    /// The photo on a grid of its pixels; `pixels` are those of the table.
    pub(super) fn view_wire(&self, grid: Grid, pixels: Vec<Pixel>) -> ViewWire {
        let photo = self.capture.photo();
        ViewWire {
            photo: ImageWire::of(&grid.image(photo)),
            coverage: grid.values(&self.capture.scoring_coverage(), photo.width()),
            exposure: self.exposure,
            judge_object: self.method.judge == JudgedBy::Object,
            stride: grid.stride(),
            pixels,
        }
    }

    /// Checks the output of a node if it is a shard of a table; returns whether it is.
    pub(super) fn check_if_shard(&mut self, node: NodeId, output: &Blob) -> Result<bool, PlanError> {
        let Some(shard) = self.shards.remove(&node) else { return Ok(false) };
        verify::check_shard(&shard, output)?;
        Ok(true)
    }

    /// Whether every shard has arrived.
    pub(super) fn are_complete(&self) -> bool {
        self.shards.is_empty()
    }

    /// Releases the full-resolution tables that are not among these.
    pub(super) fn release_tables_but(&mut self, kept: &[&Spans], graph: &mut GraphEdit<'_>) {
        self.tables.retain(|(spans, shards)| {
            let is_kept = kept.contains(&spans);
            if !is_kept {
                shards.iter().filter_map(Input::node).for_each(|shard| graph.release(shard));
            }
            is_kept
        });
    }
}
