//! The baseline that the method is measured against (\[BP20b\] section 1): minimise CSSIM itself, at full resolution, by pattern
//! search with MATLAB's defaults from a generic start.
//!
//! It renders from the full-resolution table over the model's whole range of widths, so that what took a rendering and a score per
//! evaluation takes milliseconds; whoever states its cost charges every evaluation a rendering by the direct integrator.

use super::{
    method::{JudgedBy, SearchKind},
    stage_one::search_bounds,
    stage_two::FullView,
};
use crate::{
    metric::Judge,
    search::{
        Progress, SearchError,
        pattern::{self, Minimum, PatternOptions},
    },
};
use std::ops::ControlFlow;

/// Minimises the score over the model's whole box from `start`; `observe` sees every evaluation and may end the search.
///
/// # Errors
/// When the start lies outside the box, or its rendering cannot be scored.
pub fn brute_force(
    view: &FullView<'_>,
    judge: &Judge,
    by: JudgedBy,
    start: &[f64],
    observe: &mut dyn FnMut(&Progress<'_>) -> ControlFlow<()>,
) -> Result<Minimum, SearchError> {
    let bounds = search_bounds(view.model, SearchKind::Pattern)?;
    let options = PatternOptions::matlab(bounds.dimension());
    // A rendering that cannot be scored is a rejected point.
    let objective =
        |point: &[f64]| judge.score(&view.render(point)).map_or(f64::NAN, |s| by.pick(s.cssim, s.cssim_object));
    pattern::minimise_observed(objective, start, &bounds, &options, observe)
}
