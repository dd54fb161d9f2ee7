//! Transport tables of a fit: planned shard by shard, let go when nothing will read them any more.

use super::{FitPlanner, Span, add, encode, index, verify::Shard};
use crate::{
    brdf::Model,
    fit::Method,
    graph::{BlobHash, GraphEdit, Input, NodeSpec, Placement, PlanError},
    nodes::{
        self, TransportParameters,
        wire::{ImageWire, KnotsWire},
    },
    render::{
        knots::{Knots, PER_OCTAVE},
        transport::Accuracy,
    },
};
use std::sync::Arc;

/// Pixels per shard of a subset's table: small enough to spread over several workers.
pub(super) const SUBSET_SHARD: usize = 32;

/// Pixels per shard of the full-resolution table.
pub(super) const FULL_SHARD: usize = 2048;

/// Pixels per shard of the coarse picture's table: small enough to spread over several workers.
pub(super) const COARSE_SHARD: usize = 512;

/// Knots per factor of two of width in full-resolution tables (design section 7: at least 5).
const FULL_PER_OCTAVE: f64 = 5.0;

impl FitPlanner {
    /// Adds the shards of a table of `count` pixels of the list `pixels`, as nodes of this kind.
    pub(super) fn add_transport(
        &mut self,
        graph: &mut GraphEdit<'_>,
        (kind, what): (&str, &str),
        pixels: (BlobHash, usize, usize),
        knots: Knots,
        accuracy: Accuracy,
    ) -> Result<Vec<Input>, PlanError> {
        let (list, count, shard) = pixels;
        let capture = Arc::clone(&self.capture);
        let geometry = capture.geometry();
        let environment = self.environment.ok_or_else(|| PlanError::new("the environment was not added"))?;
        let mut inputs = vec![Input::Blob(environment), Input::Blob(list)];
        if let Some(map) = geometry.normal_map() {
            inputs.push(Input::Blob(add(graph, "normal map", &ImageWire::of(&map.to_image()))?));
        }
        let mut shards = Vec::new();
        for first in (0..count).step_by(shard) {
            let range = (index(first), index(shard.min(count - first)));
            let parameters = TransportParameters {
                model: self.method.model.name().to_owned(),
                geometry: geometry.spec(),
                knots: KnotsWire::of(&knots),
                tolerance: accuracy.tolerance,
                footprint: accuracy.footprint,
                range,
            };
            let spec = NodeSpec {
                kind: kind.to_owned(),
                label: format!("transport {what}, pixels {first} to {}", first + range.1 as usize - 1),
                parameters: encode("parameters", &parameters)?,
                inputs: inputs.clone(),
                placement: Placement::Worker,
                priority: 0,
            };
            let node = graph.add_node(spec)?;
            self.shards.insert(node, Shard { pixels: range.1 as usize, knots });
            shards.push(Input::OutputOf(node));
        }
        Ok(shards)
    }

    /// The shards of the full-resolution table over a span.
    pub(super) fn full_table(&mut self, graph: &mut GraphEdit<'_>, span: Span) -> Result<Vec<Input>, PlanError> {
        if let Some((_, shards)) = self.tables.iter().find(|(known, _)| *known == span) {
            return Ok(shards.clone());
        }
        let list = add(graph, "list of pixels", &self.pixels)?;
        let knots = match span {
            Some((lower, upper)) => Knots::covering(lower, upper, FULL_PER_OCTAVE),
            None => stage_one_knots(&self.method),
        };
        let pixels = (list, self.pixels.len(), FULL_SHARD);
        let what = if self.tables.is_empty() { "in full" } else { "in full again" };
        let shards = self.add_transport(graph, (nodes::TRANSPORT_FULL, what), pixels, knots, Accuracy::FULL)?;
        self.tables.push((span, shards.clone()));
        Ok(shards)
    }

    /// Stage one is over: nothing reads the tables of the pixel subsets any more.
    pub(super) fn release_subset_tables(&mut self, graph: &mut GraphEdit<'_>) {
        for search in std::mem::take(&mut self.search_of_subset) {
            let inputs = graph.spec(search).map(|spec| spec.inputs.clone()).unwrap_or_default();
            inputs.iter().filter_map(Input::node).for_each(|shard| graph.release(shard));
        }
    }
}

/// The grid of widths of stage one: the model's whole range.
pub(super) fn stage_one_knots(method: &Method) -> Knots {
    let (low, high) = whole_span(method.model).unwrap_or((0.5, 1.0));
    Knots::covering(low, high, PER_OCTAVE)
}

/// The span of all widths that the model has.
pub(super) fn whole_span(model: &dyn Model) -> Span {
    let width = model.lobes().iter().find_map(|b| b.width)?;
    Some(width.span(model.parameters()))
}

/// Lets go of full-resolution tables.
pub(super) fn release_tables(tables: Vec<(Span, Vec<Input>)>, graph: &mut GraphEdit<'_>) {
    let shards = tables.iter().flat_map(|(_, shards)| shards);
    shards.filter_map(Input::node).for_each(|shard| graph.release(shard));
}
