//! Stage one for one gamma: minimise Eq. 1 over the parameters of the model.

use super::{
    candidate::Candidate,
    direct::DirectPixels,
    method::{Compress, Method, SearchKind, Start},
    objective::{Objective, flat_roles},
    ranges::Ranges,
    scan::scan,
};
use crate::{
    brdf::{self, Model, Role, flat_len, main_lobe},
    metric::cost::Compression,
    render::{subset::PixelSubset, table::TransportTable},
    search::{
        self, Bounds, SearchError,
        least_squares::{self, LeastSquaresOptions},
        multi_start::{self, MultiStartOptions, Refined},
        pattern::{self, PatternOptions},
    },
};
use thiserror::Error;

/// Why a search has no candidate.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum SearchFailure {
    /// The search itself failed.
    #[error("gamma {gamma}: {source}")]
    Search {
        /// The gamma of the search.
        gamma: f64,
        /// The cause.
        source: SearchError,
    },
    /// The scan found no start of finite cost.
    #[error("gamma {gamma}: no start of the scan has a finite cost; the photo's values may be out of range")]
    NoStart {
        /// The gamma of the search.
        gamma: f64,
    },
}

/// The table of a pixel subset with the starts of a search on it, which are the same for every gamma.
#[derive(Debug, Clone)]
pub struct ScannedTable {
    /// The table.
    pub table: TransportTable,
    starts: Vec<Vec<f64>>,
}

impl ScannedTable {
    /// Finds the starts. `photo` holds the subset's pixels.
    #[must_use]
    pub fn new(method: &Method, table: TransportTable, subset: &PixelSubset, photo: &[[f32; 3]]) -> Self {
        let starts = match method.start {
            Start::Paper => vec![paper_start(method.model)],
            Start::Scan => scan(method.model, &method.ranges, &table, &subset.weights, photo),
        };
        Self { table, starts }
    }
}

/// Minimises `C(A, B, gamma)` over the parameters. `photo` holds the subset's pixels. `mean_radiance` is the photo's mean luminance over
/// all usable pixels; it sets the knee of the compression, the same for every gamma and subset. With `direct`, the cost is that of
/// direct renderings, and the table is used for the starts only.
///
/// # Errors
/// When no search from any start succeeds.
pub fn search_gamma(
    method: &Method,
    gamma: f64,
    scanned: &ScannedTable,
    subset: &PixelSubset,
    photo: &[[f32; 3]],
    mean_radiance: f64,
    direct: Option<DirectPixels<'_>>,
) -> Result<Candidate, SearchFailure> {
    let fail = |source| SearchFailure::Search { gamma, source };
    let bounds = search_bounds(method.model, &method.ranges, method.search).map_err(fail)?;
    let ScannedTable { table, starts } = scanned;
    let (bounds, _) = within_table(method.model, &bounds, table.span(method.model)).map_err(fail)?;
    let mut objective = objective_of(method, gamma, table, subset, photo, mean_radiance);
    if let Some(direct) = direct {
        objective = objective.rendered_by(direct);
    }
    // The paper's start may be outside the ranges.
    let inside = |point: &Vec<f64>| {
        let mut point = point.clone();
        bounds.clamp(&mut point);
        multi_start::Start { cost: objective.cost(&point), point }
    };
    let starts: Vec<multi_start::Start> = starts.iter().map(inside).collect();
    let options = MultiStartOptions::default();
    let mut evaluations = starts.len();
    let best = match method.search {
        SearchKind::LeastSquares => multi_start::refine_best(&starts, &bounds, &options, |start| {
            let m = least_squares::minimise(&mut objective, &start.point, &bounds, &LeastSquaresOptions::default())?;
            evaluations += beyond_its_start(m.evaluations);
            Ok(Found { point: m.point, value: m.value, termination: m.termination })
        }),
        SearchKind::Pattern => {
            // Pattern search takes thousands of evaluations, so it gets one start.
            let options = MultiStartOptions { refine: 1, ..options };
            multi_start::refine_best(&starts, &bounds, &options, |start| {
                let n = bounds.dimension();
                let cost = |x: &[f64]| objective.cost(x);
                let m = pattern::minimise(cost, &start.point, &bounds, &PatternOptions::matlab(n))?;
                evaluations += beyond_its_start(m.evaluations);
                Ok(Found { point: m.point, value: m.value, termination: m.termination })
            })
        }
    };
    let best = best.map_err(fail)?.into_iter().next().ok_or(SearchFailure::NoStart { gamma })?;
    Ok(Candidate {
        gamma,
        subset: 0,
        parameters: best.point,
        cost: best.value,
        evaluations,
        termination: best.termination,
    })
}

/// The objective of a search with `gamma`. Coordinator and workers both call this function, so they compute the same cost bit for bit.
pub(crate) fn objective_of<'a>(
    method: &Method,
    gamma: f64,
    table: &'a TransportTable,
    subset: &'a PixelSubset,
    photo: &[[f32; 3]],
    mean_radiance: f64,
) -> Objective<'a> {
    let compression = match method.compress {
        Compress::Tangent => Compression::new(gamma, mean_radiance),
        Compress::Clamp => Compression::clamped(gamma),
        Compress::ClampTo { white } => Compression::clamped_to(gamma, white),
        Compress::Logarithm => Compression::logarithm(mean_radiance),
    };
    Objective::new(method.model, table, subset, photo, compression)
}

/// The evaluations of a search except that of its start, which the scan has already counted.
fn beyond_its_start(evaluations: usize) -> usize {
    evaluations.saturating_sub(1)
}

#[derive(Debug)]
struct Found {
    point: Vec<f64>,
    value: f64,
    termination: search::Termination,
}

impl Refined for Found {
    fn point(&self) -> &[f64] {
        &self.point
    }
    fn value(&self) -> f64 {
        self.value
    }
}

/// The paper's single start.
pub(super) fn paper_start(model: &dyn Model) -> Vec<f64> {
    model.parameters().iter().flat_map(|p| std::iter::repeat_n(p.start, p.channels.count())).collect()
}

/// Bounds with the main lobe's width restricted to the span of a table, and whether the span is tighter than the lower and the upper bound.
/// A range outside the span becomes the end of the span that is nearest to it. If the table reaches a bound, its outermost knot may differ
/// from the bound by rounding; then the bound is used.
pub(super) fn within_table(
    model: &dyn Model,
    bounds: &Bounds,
    span: Option<(f64, f64)>,
) -> Result<(Bounds, [bool; 2]), SearchError> {
    let (mut lower, mut upper) = (bounds.lower().to_vec(), bounds.upper().to_vec());
    let mut tighter = [false, false];
    if let Some(((_, width), span)) = main_lobe(model).zip(span) {
        let (entry, (first, last)) = (width.entry, width.entries(span));
        tighter = [first > lower[entry] * (1.0 + 1e-9), last < upper[entry] * (1.0 - 1e-9)];
        if tighter[0] {
            lower[entry] = first;
            upper[entry] = upper[entry].max(first);
        }
        if tighter[1] {
            upper[entry] = last;
            lower[entry] = lower[entry].min(last);
        }
    }
    Ok((Bounds::new(lower, upper, bounds.scales().to_vec())?, tighter))
}

/// Largest distance of two parameter vectors in a parameter, as a share of its range (for widths, of the logarithmic range).
pub(crate) fn scaled_distance(model: &dyn Model, a: &[f64], b: &[f64]) -> Result<f64, SearchError> {
    Ok(search_bounds(model, &Ranges::default(), SearchKind::LeastSquares)?.scaled_distance(a, b))
}

/// The bounds of a model's parameters in a fit and the scale in which a search steps. Least squares steps in the logarithm of a width,
/// because the table's widths are evenly spaced in it. For all other parameters, and in pattern search, the model declares the scale.
pub(super) fn search_bounds(model: &dyn Model, ranges: &Ranges, search: SearchKind) -> Result<Bounds, SearchError> {
    let (lower, upper) = ranges.bounds(model);
    let declared = model.parameters().iter().flat_map(|p| std::iter::repeat_n(p.scale, p.channels.count()));
    let scales = declared.zip(flat_roles(model)).map(|(scale, role)| match (search, role, scale) {
        (SearchKind::LeastSquares, Role::Width, _) | (_, _, brdf::Scale::Logarithmic) => search::Scale::Logarithmic,
        _ => search::Scale::Linear,
    });
    let scales: Vec<search::Scale> = scales.collect();
    debug_assert_eq!(scales.len(), flat_len(model.parameters()));
    Bounds::new(lower, upper, scales)
}
