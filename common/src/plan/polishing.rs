//! The plan of stage three: explore on a coarse picture to find the lobe to start from, then polish from there on a full-resolution
//! table, and on wider tables while the width ends at the edge of its table. If the end is worse than the winner of stage two, polish
//! runs again from the winner, on the table that the winner was judged on. So the outcome never scores worse than the winner.

use super::{
    encode::{add, index},
    pixels::Grid,
    scene_tables::SceneTables,
    step::Step,
    tables::COARSE_SHARD,
    verify,
};
use crate::{
    brdf::Model,
    fit::{
        Judged, Polished,
        explore::{MAX_EXPLORATIONS, explored_span, most_evaluations, starts},
        needed_span,
        polish::MAX_EVALUATIONS,
    },
    graph::{Blob, BlobHash, GraphEdit, Input, PlanError},
    nodes::{self, PolishParameters},
    render::{
        knots::Knots,
        transport::{Accuracy, Pixel},
    },
};

/// Most rounds of polish; each round after the first is on a wider table.
const MAX_ROUNDS: usize = 4;

/// Factor by which the next table extends to either side of the width at which the last round ended.
const AROUND: f64 = 1.6;

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

/// Largest ratio of widths, margins included, that one table may span to hold both the winner and the lobe that `explore` found.
const FAR: f64 = 4.0;

/// Most starts that a round of polish compares: the winner, the result of `explore`, and the ends of earlier rounds.
const MAX_STARTS: usize = MAX_ROUNDS + 2;

/// The state of stage three.
#[derive(Debug, Default)]
pub(super) struct Polishing {
    /// The outcome of the last round.
    pub(super) outcome: Option<Polished>,
    /// Evaluations of CSSIM on the coarse picture.
    pub(super) explored_evaluations: usize,
    /// The view and the table of the coarse picture.
    coarse: Option<(BlobHash, Vec<Input>)>,
    /// Possible starts of the next round, which takes the best of them on its table.
    starts: Vec<Vec<f64>>,
    /// Whether it went back to the winner and to the table that the winner was judged on; it ends there.
    has_retreated: bool,
    rounds: usize,
    /// Evaluations of the rounds since the start or the retreat.
    evaluations: usize,
    /// Evaluations of the rounds before the retreat.
    spent: usize,
}

impl Polishing {
    /// Adds the table of the coarse picture.
    pub(super) fn add_coarse_table(
        &mut self,
        scene: &mut SceneTables,
        graph: &mut GraphEdit<'_>,
    ) -> Result<(), PlanError> {
        let Some((low, high)) = explored_span(scene.method.model) else { return Ok(()) };
        let grid = Grid::around(&scene.pixels, COARSE_SIZE, MOST_COARSE);
        let pixels: Vec<Pixel> = scene.pixels.iter().copied().filter(|pixel| grid.holds(*pixel)).collect();
        if !shows_the_object(scene, grid, &pixels) {
            return Ok(());
        }
        let view = add(graph, "coarse view", &scene.view_wire(grid, pixels.clone()))?;
        let list = add(graph, "list of pixels", &pixels)?;
        let knots = Knots::covering(low, high, COARSE_PER_OCTAVE);
        let list = (list, pixels.len(), COARSE_SHARD);
        let table = scene.add_transport(
            graph,
            (nodes::TRANSPORT_COARSE, "of the coarse picture"),
            list,
            knots,
            Accuracy::COARSE,
        )?;
        self.coarse = Some((view, table));
        Ok(())
    }

    /// Searches on the coarse picture for the lobe that polish starts from.
    pub(super) fn explore(
        &mut self,
        won: &[f64],
        scene: &mut SceneTables,
        graph: &mut GraphEdit<'_>,
    ) -> Result<Step, PlanError> {
        let Some((view, table)) = &self.coarse else { return self.polish_winner(won, scene, graph) };
        let inputs = [vec![Input::Blob(*view)], table.clone()].concat();
        let ranges = scene.method.ranges.clone();
        let starts = starts(scene.method.model, &ranges, won);
        let parameters = PolishParameters { ranges, starts, max_evaluations: index(MAX_EXPLORATIONS) };
        let node = scene.add_on_view(graph, (nodes::EXPLORE, nodes::EXPLORE), inputs, &parameters)?;
        Ok(Step::Exploring(node))
    }

    /// Starts polish from the lobe that `explore` found, on a table that spans its width; from the winner too, if the table spans
    /// the winner's width as well.
    pub(super) fn explored(
        &mut self,
        output: &Blob,
        won: Vec<f64>,
        scene: &mut SceneTables,
        graph: &mut GraphEdit<'_>,
    ) -> Result<Step, PlanError> {
        let model = scene.method.model;
        // Not released earlier: the plan checks every shard when it arrives.
        let table = self.coarse.take().map_or_else(Vec::new, |(_, table)| table);
        table.iter().filter_map(Input::node).for_each(|shard| graph.release(shard));
        let most = most_evaluations(starts(model, &scene.method.ranges, &won).len(), MAX_EXPLORATIONS);
        let found = verify::polished(model, output, most)?;
        self.explored_evaluations = found.evaluations;
        let mut found = found.parameters;
        // A width may be held outside the span of the coarse picture's table.
        let (lower, upper) = scene.method.ranges.bounds(model);
        if let Some(width) = model.lobes().iter().find_map(|basis| basis.width) {
            found[width.entry] = found[width.entry].clamp(lower[width.entry], upper[width.entry]);
        }
        verify::check_ranges(&scene.method, &found)?;
        let inside =
            |span: Option<(f64, f64)>| span.zip(width(model, &found)).is_none_or(|(s, w)| s.0 <= w && w <= s.1);
        let both = needed_span(model, [&won[..], &found[..]].into_iter());
        let near = both.is_none_or(|(low, high)| high / low <= FAR);
        let starts = if inside(scene.span) || near { vec![won, found.clone()] } else { vec![found.clone()] };
        if !inside(scene.span) {
            scene.span = needed_span(model, starts.iter().map(|start| &start[..]));
        }
        self.starts = starts;
        self.add_polish(scene, graph)
    }

    fn polish_winner(
        &mut self,
        won: &[f64],
        scene: &mut SceneTables,
        graph: &mut GraphEdit<'_>,
    ) -> Result<Step, PlanError> {
        self.starts = vec![won.to_vec()];
        self.add_polish(scene, graph)
    }

    fn add_polish(&self, scene: &mut SceneTables, graph: &mut GraphEdit<'_>) -> Result<Step, PlanError> {
        let left = MAX_EVALUATIONS.saturating_sub(self.evaluations);
        let ranges = scene.method.ranges.clone();
        let parameters = PolishParameters { ranges, starts: self.starts.clone(), max_evaluations: index(left) };
        Ok(Step::Polishing(scene.add_judging(graph, nodes::POLISH, scene.span, &parameters)?))
    }

    /// Takes the outcome of a round. Polish ends, or continues on a wider table if the width reached the edge of this one.
    pub(super) fn polished(
        &mut self,
        output: &Blob,
        winner: &Judged,
        scene: &mut SceneTables,
        graph: &mut GraphEdit<'_>,
    ) -> Result<Step, PlanError> {
        let left = MAX_EVALUATIONS.saturating_sub(self.evaluations);
        let mut polished = verify::polished(scene.method.model, output, left.max(MAX_STARTS))?;
        verify::check_ranges(&scene.method, &polished.parameters)?;
        self.rounds += 1;
        self.evaluations += polished.evaluations;
        polished.evaluations = self.spent + self.evaluations;
        // Another table is worth it only if enough evaluations are left for a gradient and a few steps.
        let enough_left = self.evaluations + 3 * polished.parameters.len() < MAX_EVALUATIONS;
        let continues = polished.at_table_edge && self.rounds < MAX_ROUNDS && enough_left && !self.has_retreated;
        self.starts.push(polished.parameters.clone());
        let judge = scene.method.judge;
        let score = judge.pick(polished.cssim, polished.cssim_object);
        let is_worse = score > judge.pick(winner.cssim, winner.cssim_object);
        self.outcome = Some(polished);
        if continues {
            self.widen_span(scene);
            scene.release_tables_after(1, graph);
            self.add_polish(scene, graph)
        } else if is_worse && scene.span != scene.judged_span() {
            // Start again from the winner, on the table that it was judged on, where polish cannot end worse.
            scene.span = scene.judged_span();
            scene.release_tables_after(1, graph);
            *self = Self {
                outcome: self.outcome.take(),
                explored_evaluations: self.explored_evaluations,
                spent: self.evaluations,
                has_retreated: true,
                ..Self::default()
            };
            self.polish_winner(&winner.candidate.parameters, scene, graph)
        } else {
            Ok(Step::Reporting)
        }
    }

    /// Widens the span to hold the width of every round so far and the surroundings of the last one: on the next table all of
    /// them are judged again, and polish continues from the best.
    fn widen_span(&self, scene: &mut SceneTables) {
        let model = scene.method.model;
        let Some(width) = model.lobes().iter().find_map(|b| b.width) else { return };
        let (lower, upper) = width.span(model.parameters());
        let widths = || self.starts.iter().map(|start| width.at(start));
        let last = widths().next_back().unwrap_or(upper);
        let (low, high) = (widths().fold(last / AROUND, f64::min), widths().fold(last * AROUND, f64::max));
        scene.span = Some((low.max(lower), high.min(upper)));
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

/// The width of a parameter vector's main lobe.
fn width(model: &dyn Model, parameters: &[f64]) -> Option<f64> {
    model.lobes().iter().find_map(|basis| basis.width_at(parameters))
}
