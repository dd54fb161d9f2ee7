//! Stage three as a plan: look on a coarse picture for the lobe to start from, polish on the full-resolution table there, on wider
//! tables where the width runs into an edge. Where that ends worse than the winner, it is done again from the winner, on the table that
//! it was judged on: the outcome never scores worse than the winner.

use super::{FitPlanner, Grid, Step, add, index, release_tables, verify};
use crate::{
    brdf::Model,
    fit::{
        explore::{MAX_EXPLORATIONS, explored_span, starts},
        needed_span,
        polish::MAX_EVALUATIONS,
        winner,
    },
    graph::{Blob, BlobHash, GraphEdit, Input, PlanError},
    nodes::{self, PolishParameters},
    render::{
        knots::Knots,
        transport::{Accuracy, Pixel},
    },
};

/// How often polish may run on towards a width beyond its table.
const MAX_ROUNDS: usize = 4;

/// Reach of the next table around a width that polish took to the edge of this one.
const AROUND: f64 = 1.6;

/// Columns or rows of the object on the coarse picture, the fewer of the two.
const COARSE_SIZE: u32 = 96;

/// Most pixels of the coarse picture's table.
const MOST_COARSE: usize = 40_000;

/// Fewer pixels of an object show no lobe.
const FEWEST_COARSE: usize = 150;

/// Pixels from the centre of one of the metric's windows to its edge.
const REACH: usize = 5;

/// Knots per factor of two of width in the coarse table.
const COARSE_PER_OCTAVE: f64 = 4.0;

/// A table that would have to span more than this factor of widths, margins included, is not made for both winner and find.
const FAR: f64 = 4.0;

/// Most starts that a round of polish compares: winner, find, and the ends of earlier rounds.
const MAX_STARTS: usize = MAX_ROUNDS + 2;

/// Where stage three stands.
#[derive(Debug, Default)]
pub(super) struct Polishing {
    /// The view and the table of the coarse picture.
    coarse: Option<(BlobHash, Vec<Input>)>,
    /// What the next round may start from: the best on its table.
    starts: Vec<Vec<f64>>,
    /// Whether it went back to the winner and the table that it was judged on, where it ends.
    has_retreated: bool,
    rounds: usize,
    /// Evaluations of these rounds.
    evaluations: usize,
    /// Those of a start that has led nowhere.
    spent: usize,
}

impl FitPlanner {
    /// Adds the table of the coarse picture.
    pub(super) fn add_coarse_table(&mut self, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        let Some((low, high)) = explored_span(self.method.model) else { return Ok(()) };
        let grid = Grid::around(&self.pixels, COARSE_SIZE, MOST_COARSE);
        let pixels: Vec<Pixel> = self.pixels.iter().copied().filter(|pixel| grid.holds(*pixel)).collect();
        if !self.shows_the_object(grid, &pixels) {
            return Ok(());
        }
        let view = add(graph, "coarse view", &self.view_wire(grid, pixels.clone()))?;
        let list = add(graph, "list of pixels", &pixels)?;
        let knots = Knots::covering(low, high, COARSE_PER_OCTAVE);
        let list = (list, pixels.len(), super::tables::COARSE_SHARD);
        let table =
            self.add_transport(graph, (nodes::TRANSPORT, "of the coarse picture"), list, knots, Accuracy::COARSE)?;
        self.polishing.coarse = Some((view, table));
        Ok(())
    }

    /// Whether a coarse picture can be scored: the object has pixels enough, and one of the metric's windows is centred on it.
    fn shows_the_object(&self, grid: Grid, pixels: &[Pixel]) -> bool {
        let photo = self.capture.photo();
        let inside = |place: u32, length: usize| {
            let (at, count) = ((place / grid.stride()) as usize, grid.count(length));
            at >= REACH && at + REACH < count
        };
        let is_centre = |p: &Pixel| inside(p[0], photo.width()) && inside(p[1], photo.height());
        pixels.len() >= FEWEST_COARSE && pixels.iter().any(is_centre)
    }

    /// Looks on the coarse picture for the lobe that polish starts from.
    pub(super) fn add_exploration(&mut self, won: &[f64], graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        let Some((view, table)) = &self.polishing.coarse else { return self.polish_winner(won, graph) };
        let inputs = [vec![Input::Blob(*view)], table.clone()].concat();
        let parameters =
            PolishParameters { starts: starts(self.method.model, won), max_evaluations: index(MAX_EXPLORATIONS) };
        let node = self.add_on_view(graph, (nodes::EXPLORE, nodes::EXPLORE), inputs, &parameters)?;
        self.step = Step::Exploring(node);
        Ok(())
    }

    /// Polish starts from what was found, on a table that has its width, and from the winner where that table has the winner's too.
    pub(super) fn explored(&mut self, output: &Blob, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        let model = self.method.model;
        // Until now every part of the table may still have come, to be looked at.
        let table = self.polishing.coarse.take().map_or_else(Vec::new, |(_, table)| table);
        table.iter().filter_map(Input::node).for_each(|shard| graph.release(shard));
        let most = MAX_EXPLORATIONS * starts(model, &self.winner_of_stage_two()?).len();
        let found = verify::polished(model, output, most)?;
        self.explored_evaluations = found.evaluations;
        let found = found.parameters;
        let won = self.winner_of_stage_two()?;
        let inside =
            |span: Option<(f64, f64)>| span.zip(width(model, &found)).is_none_or(|(s, w)| s.0 <= w && w <= s.1);
        let both = needed_span(model, [&won[..], &found[..]].into_iter());
        let near = both.is_none_or(|(low, high)| high / low <= FAR);
        let starts = if inside(self.span) || near { vec![won, found.clone()] } else { vec![found.clone()] };
        if !inside(self.span) {
            self.span = needed_span(model, starts.iter().map(|start| &start[..]));
        }
        self.polishing.starts = starts;
        self.add_polish(graph)
    }

    fn winner_of_stage_two(&self) -> Result<Vec<f64>, PlanError> {
        let best = winner(&self.judged, self.method.judge).ok_or_else(|| PlanError::new("no candidate was judged"))?;
        Ok(self.judged[best].candidate.parameters.clone())
    }

    fn polish_winner(&mut self, won: &[f64], graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        self.polishing.starts = vec![won.to_vec()];
        self.add_polish(graph)
    }

    fn add_polish(&mut self, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        let left = MAX_EVALUATIONS.saturating_sub(self.polishing.evaluations);
        let parameters = PolishParameters { starts: self.polishing.starts.clone(), max_evaluations: index(left) };
        self.step = Step::Polishing(self.add_judging(graph, nodes::POLISH, self.span, &parameters)?);
        Ok(())
    }

    /// Polish ends, or goes on with a wider table where it ran into the edge of this one.
    pub(super) fn polished(&mut self, output: &Blob, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        let left = MAX_EVALUATIONS.saturating_sub(self.polishing.evaluations);
        let mut polished = verify::polished(self.method.model, output, left.max(MAX_STARTS))?;
        let polishing = &mut self.polishing;
        polishing.rounds += 1;
        polishing.evaluations += polished.evaluations;
        polished.evaluations = polishing.spent + polishing.evaluations;
        // Another table pays only with evaluations left for a gradient and a few steps.
        let enough_left = polishing.evaluations + 3 * polished.parameters.len() < MAX_EVALUATIONS;
        let goes_on =
            polished.at_table_edge && polishing.rounds < MAX_ROUNDS && enough_left && !polishing.has_retreated;
        polishing.starts.push(polished.parameters.clone());
        let score = self.method.judge.pick(polished.cssim, polished.cssim_object);
        let best = winner(&self.judged, self.method.judge).ok_or_else(|| PlanError::new("no candidate was judged"))?;
        let is_worse = score > self.score_of_winner(best);
        let judged_on = self.tables.first().map_or(self.span, |(span, _)| *span);
        self.best.set(score.min(self.score_of_winner(best)));
        self.polished = Some(polished);
        if goes_on {
            self.widen_span();
            self.release_tables_between(graph);
            self.add_polish(graph)
        } else if is_worse && self.span != judged_on {
            // Nothing better was there: what polish owes is the winner's own surroundings, on the table that it won on.
            self.span = judged_on;
            self.release_tables_between(graph);
            let spent = self.polishing.evaluations;
            self.polishing = Polishing { spent, has_retreated: true, ..Polishing::default() };
            let won = self.winner_of_stage_two()?;
            self.polish_winner(&won, graph)
        } else {
            self.add_report(graph)
        }
    }

    /// The pictures are made of the first table and the last.
    fn release_tables_between(&mut self, graph: &mut GraphEdit<'_>) {
        let between = self.tables.split_off(1);
        release_tables(between, graph);
    }

    /// A span around the width where polish stands that holds the widths of all earlier rounds: on the next table all of them
    /// are judged again, and the best goes on.
    fn widen_span(&mut self) {
        let model = self.method.model;
        let Some(width) = model.lobes().iter().find_map(|b| b.width) else { return };
        let (lower, upper) = width.span(model.parameters());
        let widths = || self.polishing.starts.iter().map(|start| width.at(start));
        let last = widths().next_back().unwrap_or(upper);
        let (low, high) = (widths().fold(last / AROUND, f64::min), widths().fold(last * AROUND, f64::max));
        self.span = Some((low.max(lower), high.min(upper)));
    }
}

/// The width of a parameter vector's main lobe.
fn width(model: &dyn Model, parameters: &[f64]) -> Option<f64> {
    model.lobes().iter().find_map(|basis| basis.width_at(parameters))
}
