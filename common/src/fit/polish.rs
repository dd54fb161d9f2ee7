//! Stage three, always reported apart: a short search on CSSIM itself from the winner of stage two, on the full-resolution table around
//! the winner's width (design section 2).
//!
//! CSSIM is smooth in the parameters, but its valleys are narrow. In a few hundred evaluations a projected quasi-Newton search reaches
//! the score that a pattern search reaches in 7,000 (docs/results.md).

use super::{
    method::{JudgedBy, SearchKind},
    objective::flat_roles,
    ranges::Ranges,
    stage_one::{search_bounds, within_table},
    stage_two::{FullView, Renderer},
};
use crate::{
    brdf::{Model, Role, Width, lit_lobes, main_lobe},
    math::elementary::ln,
    metric::{Judge, Score},
    search::{
        Bounds, Progress, Scale, SearchError, Termination,
        quasi_newton::{self, QuasiNewtonOptions},
    },
};
use std::ops::ControlFlow;

/// Most evaluations of CSSIM.
pub const MAX_EVALUATIONS: usize = 500;

/// Where a search on CSSIM may go, and when it ends.
#[derive(Debug, Clone, Copy)]
pub struct Limits<'a> {
    /// The ranges of the parameters.
    pub ranges: &'a Ranges,
    /// Most evaluations.
    pub evaluations: usize,
    /// Decrease of CSSIM below which two iterations in a row end the search.
    pub tolerance: f64,
}

impl<'a> Limits<'a> {
    /// Limits of polish.
    #[must_use]
    pub fn of_polish(ranges: &'a Ranges, evaluations: usize) -> Self {
        Self { ranges, evaluations, tolerance: QuasiNewtonOptions::default().function_tolerance }
    }
}

/// The outcome of stage three.
#[derive(Debug, Clone, PartialEq)]
pub struct Polished {
    /// Flat parameter vector.
    pub parameters: Vec<f64>,
    /// CSSIM over the whole image.
    pub cssim: f64,
    /// CSSIM over windows centred on the object.
    pub cssim_object: f64,
    /// Evaluations of CSSIM.
    pub evaluations: usize,
    /// Why the search ended.
    pub termination: Termination,
    /// Whether the width ended at an edge of the table that is not the bound of its range: a wider table may give a better match.
    pub at_table_edge: bool,
}

/// The judges of a search: evaluations in single precision, results in double precision.
#[derive(Debug, Clone, Copy)]
pub struct Judges<'a> {
    /// Of the search.
    pub searching: &'a Judge<f32>,
    /// Of its result.
    pub reporting: &'a Judge,
    /// The score that counts.
    pub by: JudgedBy,
}

/// Polishes the best of `starts`. `observe` is called at every iteration and may end the search.
///
/// Scores on different tables cannot be compared. To continue on another table, pass all results so far as starts: the outcome scores
/// no worse than any of them *on this table*.
///
/// # Errors
/// If there is no start, or no start can be rendered and scored.
pub fn polish(
    view: &FullView<'_>,
    judges: Judges<'_>,
    starts: &[Vec<f64>],
    limits: Limits<'_>,
    observe: &mut dyn FnMut(&Progress<'_>) -> ControlFlow<()>,
) -> Result<Polished, SearchError> {
    let (bounds, table_is_tighter) = polish_bounds(view, limits.ranges)?;
    let picked = |score: &Score| judges.by.pick(score.cssim, score.cssim_object);
    let renderer = Renderer::new(view);
    let objective = |point: &[f64]| {
        // A point whose rendering cannot be scored is rejected.
        judges.searching.score(&renderer.render(point)).map_or(f64::NAN, |score| picked(&score))
    };
    let report = |point: &[f64]| {
        let score = judges.reporting.score(&view.render(point));
        score.map_err(|_| SearchError::NotFinite { what: "the CSSIM", point: point.to_vec() })
    };
    let (start, compared) =
        best_start(starts, &bounds, |start| report(start).map_or(f64::NAN, |score| picked(&score)))?;
    judges.reporting.free_buffers();
    let max_evaluations = limits.evaluations.saturating_sub(compared).max(1);
    let function_tolerance = limits.tolerance;
    let options = QuasiNewtonOptions { max_evaluations, function_tolerance, ..QuasiNewtonOptions::default() };
    let minimum = quasi_newton::minimise(objective, &start, &bounds, &options, observe)?;
    let mut score = report(&minimum.point)?;
    let mut point = minimum.point;
    if point != start {
        // Single precision may rank start and result wrongly; double precision decides.
        let of_start = report(&start)?;
        if picked(&of_start) < picked(&score) {
            (point, score) = (start, of_start);
        }
    }
    let at_table_edge = main_lobe(view.model).is_some_and(|(_, width)| {
        let (x, step) = (bounds.to_scaled(width.entry, point[width.entry]), EDGE);
        (table_is_tighter[0] && x < step) || (table_is_tighter[1] && x > 1.0 - step)
    });
    let tail_at_edge = end_at_the_edge(view, &mut point);
    Ok(Polished {
        parameters: point,
        cssim: score.cssim,
        cssim_object: score.cssim_object,
        evaluations: compared + minimum.evaluations,
        termination: minimum.termination,
        at_table_edge: at_table_edge || tail_at_edge,
    })
}

/// The table has no wider lobe than its last one, so that all wider ones look like that: moves the entries that widen a lobe to where it
/// becomes the last one, which looks the same. Returns whether a lobe is at that edge of the table and could be wider.
fn end_at_the_edge(view: &FullView<'_>, point: &mut [f64]) -> bool {
    let Some((_, last)) = view.span() else { return false };
    let mut is_at_edge = false;
    for (basis, is_lit) in view.model.lobes().iter().zip(lit_lobes(view.model, point)) {
        let Some((width, t)) = basis.width.and_then(|width| Some((width, width.widened_by?))) else { continue };
        let is_whole = last >= width.span(view.model.parameters()).1 * (1.0 - 1e-9);
        is_at_edge |= is_lit && !is_whole && width.at(point) > last * (1.0 - EDGE);
        if !is_whole && width.at(point) > last {
            point[t] = (1.0 - ln(last) / ln((width.of)(point[width.entry]))).max(0.0);
        }
    }
    is_at_edge
}

/// The start of lowest score (the first of equal ones), and the number of evaluations: 0 for a single start.
fn best_start(
    starts: &[Vec<f64>],
    bounds: &Bounds,
    objective: impl Fn(&[f64]) -> f64,
) -> Result<(Vec<f64>, usize), SearchError> {
    let mut inside = starts.to_vec();
    inside.iter_mut().for_each(|start| bounds.clamp(start));
    if inside.len() == 1 {
        return inside.pop().map(|start| (start, 0)).ok_or(SearchError::NoParameters);
    }
    let scores: Vec<f64> = inside.iter().map(|start| objective(start)).collect();
    let best = (0..inside.len()).filter(|&i| scores[i].is_finite()).min_by(|&a, &b| scores[a].total_cmp(&scores[b]));
    let Some(best) = best else {
        return Err(SearchError::NotFinite { what: "the CSSIM", point: inside.concat() });
    };
    let compared = inside.len();
    Ok((inside.swap_remove(best), compared))
}

/// A width in this outermost share of the table's logarithmic span counts as at its edge.
const EDGE: f64 = 0.02;

/// The box of the parameters with the main lobe's width restricted to the table's span, and whether the span is tighter than the lower
/// and the upper bound of its range.
fn polish_bounds(view: &FullView<'_>, ranges: &Ranges) -> Result<(Bounds, [bool; 2]), SearchError> {
    within_table(view.model, &visible_bounds(view.model, ranges)?, view.span())
}

/// The box of the parameters, scaled so that equal steps look about equal.
pub(super) fn visible_bounds(model: &dyn Model, ranges: &Ranges) -> Result<Bounds, SearchError> {
    let bounds = search_bounds(model, ranges, SearchKind::LeastSquares)?;
    // Small steps of a reflectance are visible where the reflectance is small.
    let is_of = |width: &Width, entry| width.entry == entry || width.widened_by == Some(entry);
    let is_width = |entry| model.lobes().iter().any(|b| b.width.is_some_and(|width| is_of(&width, entry)));
    let scale = |(entry, role)| match role {
        Role::Width => Scale::Logarithmic,
        _ if is_width(entry) => Scale::Linear,
        _ => Scale::OffsetLogarithmic,
    };
    let scales: Vec<Scale> = flat_roles(model).into_iter().enumerate().map(scale).collect();
    Bounds::new(bounds.lower().to_vec(), bounds.upper().to_vec(), scales)
}
