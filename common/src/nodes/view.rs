//! Common inputs of the nodes that render and score images (`select`, `explore`, `polish`, `report`, `uncertainty`, `brute-force`, `appraise`): the
//! photo, the judge, and a table of the photo's pixels.
//!
//! Their inputs: the view; the shards of the table, in order.

use crate::{
    brdf::{self, Model},
    fit::{FullView, JudgedBy, Judges},
    graph::{Blob, NodeFailure, RunContext},
    image::Image,
    metric::{Blocks, Judge, JudgeOptions, MetricError, Score, noise_floor},
    nodes::wire::{ImageWire, TableWire, read},
    render::{table::TransportTable, transport::Pixel},
};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// The photo and how it is scored.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct ViewWire {
    pub(crate) photo: ImageWire,
    /// One value in [0, 1] per pixel. Renderings are multiplied by it, and pixels with coverage 0 are not scored. The photo is not
    /// multiplied: it is over black, so its pixels contain the coverage already.
    pub(crate) coverage: Vec<f32>,
    pub(crate) exposure: f64,
    pub(crate) judge_object: bool,
    /// The photo has the middle pixel of every square of `stride` x `stride` pixels of the scene; 1 for all pixels.
    pub(crate) stride: u32,
    /// The pixels of the full-resolution table.
    pub(crate) pixels: Vec<Pixel>,
}

/// A decoded view with its prepared judge.
#[derive(Debug)]
pub(super) struct View {
    pub(super) judge: Judge,
    /// Exposure and scored pixels of the judges.
    exposure: f64,
    scored: Vec<f32>,
    pub(super) by: JudgedBy,
    pub(super) photo: Image,
    pub(super) pixels: Vec<Pixel>,
    pub(super) coverage: Vec<f32>,
    stride: u32,
    pub(super) width: usize,
    pub(super) height: usize,
}

/// A view with the transport table of its pixels, for one model.
#[derive(Debug)]
pub(super) struct Scene {
    pub(super) model: &'static dyn Model,
    pub(super) view: Arc<View>,
    table: Vec<Arc<TransportTable>>,
}

impl Scene {
    pub(super) fn read(model: &str, inputs: &[Blob], context: &RunContext) -> Result<Self, NodeFailure> {
        let model = model_of(model)?;
        let Some((view, shards)) = inputs.split_first() else {
            return Err(NodeFailure::new("expected a view and a transport table, found no input"));
        };
        let view = context.decoded(view, View::decode)?;
        let table = decoded(shards, context)?;
        if !table.iter().all(|shard| shard.is_of(model) && shard.has_the_grids_of(&table[0])) {
            return Err(of_different_tables(model));
        }
        let (expected, found) = (view.pixels.len(), table.iter().map(|shard| shard.pixels).sum::<usize>());
        if expected != found {
            return Err(NodeFailure::new(format!("expected a table of {expected} pixels, found {found}")));
        }
        Ok(Self { model, view, table })
    }

    pub(super) fn full(&self) -> FullView<'_> {
        let View { pixels, coverage, stride, width, height, .. } = &*self.view;
        let (stride, width, height) = (*stride, *width, *height);
        FullView { model: self.model, table: &self.table, pixels, coverage, stride, width, height }
    }

    /// The windows that count for the score of the picture of a parameter vector.
    pub(super) fn blocks(&self, parameters: &[f64]) -> Result<Blocks, NodeFailure> {
        let maps = self.view.judge.maps(&self.full().render(parameters)).map_err(cannot_be_judged)?;
        Ok(self.view.judge.blocks(&maps, self.view.by == JudgedBy::Object))
    }
}

impl Drop for Scene {
    /// The cache may keep the view for long after the node.
    fn drop(&mut self) {
        self.view.judge.free_buffers();
    }
}

impl View {
    /// The judge of searches.
    pub(super) fn searching(&self) -> Result<Judge<f32>, NodeFailure> {
        Judge::single(&self.photo, &self.scored, self.exposure, &JudgeOptions::default()).map_err(cannot_be_judged)
    }

    /// What noise costs a match.
    pub(super) fn noise_floor(&self, matched: &Image, noise: f64) -> Result<Score, MetricError> {
        noise_floor(matched, &self.scored, self.exposure, noise)
    }

    /// Both judges, and which score counts.
    pub(super) fn judges<'a>(&'a self, searching: &'a Judge<f32>) -> Judges<'a> {
        Judges { searching, reporting: &self.judge, by: self.by }
    }

    pub(super) fn decode(bytes: &[u8]) -> Result<Self, NodeFailure> {
        let wire: ViewWire = read("view", bytes)?;
        let photo: Image = wire.photo.image()?;
        let scored: Vec<f32> = wire.coverage.iter().map(|&c| if c > 0.0 { 1.0 } else { 0.0 }).collect();
        let judge = Judge::new(&photo, &scored, wire.exposure, &JudgeOptions::default()).map_err(cannot_be_judged)?;
        let (width, height) = (photo.width(), photo.height());
        let stride = wire.stride.max(1);
        let outside = |p: &&Pixel| (p[0] / stride) as usize >= width || (p[1] / stride) as usize >= height;
        if let Some(p) = wire.pixels.iter().find(outside) {
            return Err(NodeFailure::new(format!("pixel {p:?} lies outside the {width} x {height} photo")));
        }
        let by = if wire.judge_object { JudgedBy::Object } else { JudgedBy::Image };
        let ViewWire { exposure, pixels, coverage, .. } = wire;
        Ok(Self { judge, exposure, scored, by, photo, pixels, coverage, stride, width, height })
    }
}

fn cannot_be_judged(error: MetricError) -> NodeFailure {
    NodeFailure::new(format!("the photo cannot be judged: {error}"))
}

/// A model by its name.
pub(super) fn model_of(name: &str) -> Result<&'static dyn Model, NodeFailure> {
    brdf::model(name).map_err(|error| NodeFailure::new(error.to_string()))
}

/// Joins consecutive shards into one table, which must have the lobes of `model`.
pub(super) fn concatenated(
    model: &dyn Model,
    shards: &[Blob],
    context: &RunContext,
) -> Result<TransportTable, NodeFailure> {
    let tables = decoded(shards, context)?;
    let tables: Vec<&TransportTable> = tables.iter().map(|table| &**table).collect();
    joined(model, &tables)
}

fn decoded(shards: &[Blob], context: &RunContext) -> Result<Vec<Arc<TransportTable>>, NodeFailure> {
    let table = |bytes: &[u8]| read::<TableWire>("transport table", bytes)?.table();
    shards.iter().map(|shard| context.decoded(shard, table)).collect()
}

/// As [`concatenated`], for shards that are already decoded.
pub(crate) fn joined(model: &dyn Model, shards: &[&TransportTable]) -> Result<TransportTable, NodeFailure> {
    TransportTable::concatenate(shards).filter(|table| table.is_of(model)).ok_or_else(|| of_different_tables(model))
}

fn of_different_tables(model: &dyn Model) -> NodeFailure {
    NodeFailure::new(format!(
        "expected shards of one transport table of {}, found none or shards of different tables",
        model.name()
    ))
}
