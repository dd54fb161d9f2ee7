//! Transport tables of a fit: the size of their shards, and the widths that they span.

use crate::{
    brdf::Model,
    fit::Method,
    render::knots::{Knots, PER_OCTAVE},
};

/// Smallest and largest width of a table.
pub(super) type Span = Option<(f64, f64)>;

/// Pixels per shard of a subset's table: small enough to spread over several workers.
pub(super) const SUBSET_SHARD: usize = 32;

/// Above this number of pixels, a subset's table has shards of [`LARGE_SHARD`].
pub(super) const LARGE_SUBSET: usize = 4096;

/// Pixels per shard of a large subset's table.
pub(super) const LARGE_SHARD: usize = 2048;

/// Pixels per shard of the full-resolution table: large enough that few nodes of a grid of normals serve the pixels of two shards.
pub(super) const FULL_SHARD: usize = 4096;

/// Pixels per shard of the coarse picture's table: small enough to spread over several workers.
pub(super) const COARSE_SHARD: usize = 2048;

/// Knots per factor of two of width in full-resolution tables (design section 7: at least 5).
pub(super) const FULL_PER_OCTAVE: f64 = 5.0;

/// The grid of widths of stage one: the model's whole range.
pub(super) fn stage_one_knots(method: &Method) -> Knots {
    let (low, high) = whole_span(method.model).unwrap_or((0.5, 1.0));
    Knots::covering(low, high, PER_OCTAVE)
}

/// The model's whole range of widths; `None` for a model without widths.
pub(super) fn whole_span(model: &dyn Model) -> Span {
    let width = model.lobes().iter().find_map(|b| b.width)?;
    Some(width.span(model.parameters()))
}
