//! The coarse picture on which stage three searches for the lobe to start from, with its table, which all models of a fit share.

use super::{encode::add, pixels::Grid, scene_tables::SceneTables, tables::COARSE_SHARD};
use crate::{
    graph::{BlobHash, GraphEdit, Input, PlanError},
    nodes,
    render::{
        spans::Spans,
        transport::{Accuracy, Pixel},
    },
};

/// Columns or rows of the object on the coarse picture, whichever are fewer.
const COARSE_SIZE: u32 = 96;

/// Most pixels of the coarse picture's table.
const MOST_COARSE: usize = 40_000;

/// Fewest pixels of the object on the coarse picture: fewer do not show a lobe.
const FEWEST_COARSE: usize = 150;

/// Pixels from the centre of one of the metric's windows to its edge.
const REACH: usize = 5;

/// Knots per factor of two of width in the coarse table.
const COARSE_PER_OCTAVE: f64 = 4.0;

/// The view and the table of the coarse picture.
#[derive(Debug)]
pub(super) struct Coarse {
    view: BlobHash,
    table: Vec<Input>,
}

impl Coarse {
    /// Adds the table; `None` if the picture would be too small to be scored.
    pub(super) fn add(
        scene: &mut SceneTables,
        spans: &Spans,
        graph: &mut GraphEdit<'_>,
    ) -> Result<Option<Self>, PlanError> {
        let grid = Grid::around(&scene.pixels, COARSE_SIZE, MOST_COARSE);
        let pixels: Vec<Pixel> = scene.pixels.iter().copied().filter(|pixel| grid.holds(*pixel)).collect();
        if !shows_the_object(scene, grid, &pixels) {
            return Ok(None);
        }
        let view = add(graph, "coarse view", &scene.view_wire(grid, pixels.clone()))?;
        let list = add(graph, "list of pixels", &pixels)?;
        let list = (list, pixels.len(), COARSE_SHARD);
        let kind = (nodes::TRANSPORT_COARSE, "of the coarse picture");
        let table = scene.add_transport(graph, kind, list, spans.knots(COARSE_PER_OCTAVE), Accuracy::COARSE)?;
        Ok(Some(Self { view, table }))
    }

    /// The inputs of a node that reads the picture and its table.
    pub(super) fn inputs(&self) -> Vec<Input> {
        [&[Input::Blob(self.view)], &self.table[..]].concat()
    }

    /// Releases the table.
    pub(super) fn release(self, graph: &mut GraphEdit<'_>) {
        self.table.iter().filter_map(Input::node).for_each(|shard| graph.release(shard));
    }
}

/// Whether a coarse picture can be scored: it has enough pixels of the object, and at least one of the metric's windows is centred
/// on the object.
fn shows_the_object(scene: &SceneTables, grid: Grid, pixels: &[Pixel]) -> bool {
    let photo = scene.capture.photo();
    let inside = |place: u32, length: usize| {
        let (at, count) = ((place / grid.stride()) as usize, grid.count(length));
        at >= REACH && at + REACH < count
    };
    let is_centre = |p: &Pixel| inside(p[0], photo.width()) && inside(p[1], photo.height());
    pixels.len() >= FEWEST_COARSE && pixels.iter().any(is_centre)
}
