//! The baseline that the method is measured against (\[BP20b\] section 1): minimise CSSIM itself, at full resolution, by pattern
//! search with MATLAB's defaults from a generic start.

use super::{method::SearchKind, ranges::Ranges, stage_one::search_bounds};
use crate::{
    brdf::Model,
    search::{
        Progress, SearchError,
        pattern::{self, Minimum, PatternOptions},
    },
};
use std::ops::ControlFlow;

/// Minimises a score over the model's whole box from `start`, with at most `limit` evaluations (by default MATLAB's 2000 per parameter).
/// `observe` is called at every evaluation and may end the search. A point whose value is not finite is rejected.
///
/// # Errors
/// When the start lies outside the box, or its score is not finite.
pub fn brute_force(
    model: &dyn Model,
    score: impl FnMut(&[f64]) -> f64,
    start: &[f64],
    limit: Option<usize>,
    observe: &mut dyn FnMut(&Progress<'_>) -> ControlFlow<()>,
) -> Result<Minimum, SearchError> {
    let bounds = search_bounds(model, &Ranges::default(), SearchKind::Pattern)?;
    let mut options = PatternOptions::matlab(bounds.dimension());
    options.max_evaluations = limit.unwrap_or(options.max_evaluations);
    pattern::minimise_observed(score, start, &bounds, &options, observe)
}
