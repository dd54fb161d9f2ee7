//! The plan of stage three: explore on a coarse picture to find the lobe to start from, then polish from there on a full-resolution
//! table, and on wider tables while the width ends at the edge of its table. If the end is worse than the winner of stage two, polish
//! runs again from the winner, on the table that the winner was judged on. So the outcome never scores worse than the winner.

use super::{coarse::Coarse, encode::index, scene_tables::SceneTables, step::Step, verify};
use crate::{
    brdf::{Model, main_lobe},
    fit::{
        Judged, Method, Polished,
        candidate::{whole_span, widths},
        explore::{MAX_EXPLORATIONS, most_evaluations, starts, starts_after},
        needed_span,
        polish::MAX_EVALUATIONS,
    },
    graph::{Blob, GraphEdit, PlanError},
    metric::Blocks,
    nodes::{self, PolishParameters},
    render::spans::Spans,
};

/// Most rounds of polish; each round after the first is on a wider table.
const MAX_ROUNDS: usize = 4;

/// Factor by which the next table extends to either side of the width at which the last round ended.
const AROUND: f64 = 1.6;

/// Largest ratio of widths, margins included, that one table may span to hold both the winner and the lobe that `explore` found.
const FAR: f64 = 4.0;

/// For a lobe with a tail: largest ratio of the widths of both to those of one of them.
const WITH_TAIL: f64 = 1.5;

/// Most starts that a round of polish compares: the winner, the result of `explore`, and the ends of earlier rounds.
const MAX_STARTS: usize = MAX_ROUNDS + 2;

/// The state of stage three of one model.
#[derive(Debug)]
pub(super) struct Polishing {
    method: Method,
    /// What tells the model from the others of the fit, for labels; empty for a single model.
    label: String,
    /// What the table spans on which the candidates were judged.
    judged_on: Spans,
    /// What the table of the last or the next round spans.
    spans: Spans,
    /// The outcome of the last round.
    pub(super) outcome: Option<Polished>,
    /// What was found on the coarse picture.
    pub(super) explored: Option<Polished>,
    /// The most evaluations there.
    most_explorations: usize,
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
    pub(super) fn new(method: &Method, label: &str) -> Self {
        Self {
            method: method.clone(),
            label: label.to_owned(),
            judged_on: Spans::default(),
            spans: Spans::default(),
            outcome: None,
            explored: None,
            most_explorations: 0,
            starts: Vec::new(),
            has_retreated: false,
            rounds: 0,
            evaluations: 0,
            spent: 0,
        }
    }

    /// The candidates are judged on a table that spans this.
    pub(super) fn judge_on(&mut self, spans: &Spans) {
        (self.judged_on, self.spans) = (spans.clone(), spans.clone());
    }

    /// What the table spans on which the candidates were judged.
    pub(super) fn judged_on(&self) -> &Spans {
        &self.judged_on
    }

    /// What the table spans on which it ended.
    pub(super) fn spans(&self) -> &Spans {
        &self.spans
    }

    /// Searches on the coarse picture for the lobe that polish starts from; from fewer starts if another model's lobe is known.
    pub(super) fn explore(
        &mut self,
        won: &[f64],
        other: Option<(&dyn Model, &[f64])>,
        coarse: &Coarse,
        scene: &SceneTables,
        graph: &mut GraphEdit<'_>,
    ) -> Result<Step, PlanError> {
        let (model, ranges) = (self.method.model, &self.method.ranges);
        let starts = other.map_or_else(|| starts(model, ranges, won), |other| starts_after(model, ranges, won, other));
        self.most_explorations = most_evaluations(starts.len(), MAX_EXPLORATIONS);
        let parameters = self.parameters(starts, MAX_EXPLORATIONS);
        let label = format!("{}{}", nodes::EXPLORE, self.label);
        let node = scene.add_on_view(graph, (nodes::EXPLORE, &label), coarse.inputs(), &parameters)?;
        Ok(Step::Exploring(node))
    }

    fn parameters(&self, starts: Vec<Vec<f64>>, most: usize) -> PolishParameters {
        let (model, ranges) = (self.method.model.name().to_owned(), self.method.ranges.clone());
        PolishParameters { model, ranges, starts, max_evaluations: index(most) }
    }

    /// Takes what `explore` found; returns the windows of its picture.
    pub(super) fn explored(&mut self, output: &Blob) -> Result<Blocks, PlanError> {
        let model = self.method.model;
        let (mut found, blocks) = verify::explored(&self.method, output, self.most_explorations)?;
        // A width may be held outside the span of the coarse picture's table.
        let (lower, upper) = self.method.ranges.bounds(model);
        if let Some((_, width)) = main_lobe(model) {
            found.parameters[width.entry] = found.parameters[width.entry].clamp(lower[width.entry], upper[width.entry]);
        }
        verify::check_ranges(&self.method, &found.parameters)?;
        self.explored = Some(found);
        Ok(blocks)
    }

    /// Starts polish from the lobe that `explore` found, on a table that spans its width; from the winner too, if the table spans
    /// the winner's width as well. Without `explore`, from the winner.
    pub(super) fn polish(
        &mut self,
        won: Vec<f64>,
        scene: &mut SceneTables,
        graph: &mut GraphEdit<'_>,
    ) -> Result<Step, PlanError> {
        let Some(found) = self.explored.as_ref().map(|found| found.parameters.clone()) else {
            return self.polish_winner(&won, scene, graph);
        };
        let (model, ranges) = (self.method.model, &self.method.ranges);
        let inside =
            |span: Option<(f64, f64)>| span.zip(width(model, &found)).is_none_or(|(s, w)| s.0 <= w && w <= s.1);
        let ratio = |points: &[&[f64]]| needed_span(model, ranges, points.iter().copied()).map_or(1.0, |(l, h)| h / l);
        // A core and its tail may be far from each other.
        let alone = ratio(&[&won]).max(ratio(&[&found]));
        let near = ratio(&[&won, &found]) <= FAR.max(WITH_TAIL * alone);
        let is_inside = inside(self.spans.main(model));
        let starts = if is_inside || near { vec![won, found.clone()] } else { vec![found.clone()] };
        if !is_inside {
            self.spans = Spans::of_model(model, needed_span(model, ranges, starts.iter().map(|start| &start[..])));
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
        let parameters = self.parameters(self.starts.clone(), MAX_EVALUATIONS.saturating_sub(self.evaluations));
        let label = format!("{}{}", nodes::POLISH, self.label);
        Ok(Step::Polishing(scene.add_judging(graph, (nodes::POLISH, &label), &self.spans, &parameters)?))
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
        let mut polished = verify::polished(self.method.model, output, left.max(MAX_STARTS))?;
        verify::check_ranges(&self.method, &polished.parameters)?;
        self.rounds += 1;
        self.evaluations += polished.evaluations;
        polished.evaluations = self.spent + self.evaluations;
        // Another table is worth it only if enough evaluations are left for a gradient and a few steps.
        let enough_left = self.evaluations + 3 * polished.parameters.len() < MAX_EVALUATIONS;
        let continues = polished.at_table_edge && self.rounds < MAX_ROUNDS && enough_left && !self.has_retreated;
        self.starts.push(polished.parameters.clone());
        let judge = self.method.judge;
        let score = judge.pick(polished.cssim, polished.cssim_object);
        let is_worse = score > judge.pick(winner.cssim, winner.cssim_object);
        self.outcome = Some(polished);
        if continues {
            self.widen_span();
            self.add_polish(scene, graph)
        } else if is_worse && self.spans != self.judged_on {
            // Start again from the winner, on the table that it was judged on, where polish cannot end worse.
            *self = Self {
                outcome: self.outcome.take(),
                explored: self.explored.take(),
                spent: self.evaluations,
                has_retreated: true,
                judged_on: self.judged_on.clone(),
                spans: self.judged_on.clone(),
                ..Self::new(&self.method, &self.label)
            };
            self.polish_winner(&winner.candidate.parameters, scene, graph)
        } else {
            Ok(Step::Reporting)
        }
    }

    /// Widens the span to hold the width of every round so far and the surroundings of the last one: on the next table all of
    /// them are judged again, and polish continues from the best.
    fn widen_span(&mut self) {
        let (model, ranges) = (self.method.model, &self.method.ranges);
        let points = || self.starts.iter().map(|start| &start[..]);
        let spans = widths(model, ranges, points()).zip(widths(model, ranges, points().next_back().into_iter()));
        if let Some((((low, high), last), (lower, upper))) = spans.zip(whole_span(model)) {
            let (low, high) = (low.min(last.0 / AROUND).max(lower), high.max(last.1 * AROUND).min(upper));
            self.spans = Spans::of_model(model, Some((low, high)));
        }
    }
}

/// The width of a parameter vector's main lobe.
fn width(model: &dyn Model, parameters: &[f64]) -> Option<f64> {
    main_lobe(model).map(|(_, width)| width.at(parameters))
}
