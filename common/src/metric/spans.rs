//! The columns of each row of a region that a score needs.
//!
//! Around a round object most rows of its bounding box begin and end with pixels in which both images are equal, so their differences are 0
//! and stay 0. All ranges begin and end at multiples of [`LANES`], so that leaving the rest out does not change a sum's bits.

use super::planes::LANES;
use super::region::Region;
use super::window::{RADIUS, SIZE};
use std::ops::Range;

/// Ranges of columns by row.
#[derive(Debug, Clone)]
pub(super) struct Spans {
    /// Of covered pixels.
    object: Vec<Range<usize>>,
    /// Of columns with covered pixels within the filter's reach above or below.
    vertical: Vec<Range<usize>>,
    /// Of pixels that the filter's reach connects with a covered pixel.
    filtered: Vec<Range<usize>>,
    /// Of windows that contain such a pixel.
    windows: Vec<Range<usize>>,
}

impl Spans {
    /// Whole rows.
    pub(super) fn whole(region: &Region) -> Self {
        let (columns, rows) = region.windows();
        let whole = vec![0..region.width.next_multiple_of(LANES); region.height];
        let windows = vec![0..columns.next_multiple_of(LANES); rows];
        Self { object: whole.clone(), vertical: whole.clone(), filtered: whole, windows }
    }

    /// The spans of the covered pixels of a region, for a filter that reaches `reach` pixels.
    pub(super) fn around(coverage: &[f32], region: &Region, reach: usize) -> Self {
        let object: Vec<Range<usize>> = (0..region.height)
            .map(|y| {
                let start = (region.y0 + y) * region.image_width + region.x0;
                let row = &coverage[start..start + region.width];
                let first = row.iter().position(|&c| c > 0.0).unwrap_or(0);
                first..row.iter().rposition(|&c| c > 0.0).map_or(0, |last| last + 1)
            })
            .collect();
        // Reflected rows need no span of their own: a reflected row is farther away than its original.
        let within = |y: usize| union(&object[y.saturating_sub(reach)..(y + reach + 1).min(region.height)]);
        let vertical: Vec<Range<usize>> = (0..region.height).map(within).collect();
        let widened = |span: &Range<usize>| widen(span, reach, reach, region.width);
        let filtered: Vec<Range<usize>> = vertical.iter().map(widened).collect();
        let (columns, rows) = region.windows();
        let around = |y: usize| widen(&union(&filtered[y..y + SIZE]), 2 * RADIUS, 0, columns);
        let windows = (0..rows).map(|y| aligned(&around(y))).collect();
        let all = |spans: &[Range<usize>]| spans.iter().map(aligned).collect();
        Self { object: all(&object), vertical: all(&vertical), filtered: all(&filtered), windows }
    }

    /// Columns with covered pixels in row `y`.
    pub(super) fn object(&self, y: usize) -> Range<usize> {
        self.object[y].clone()
    }

    /// Columns in which the filter's sums along y at row `y` may differ from 0.
    pub(super) fn vertical(&self, y: usize) -> Range<usize> {
        self.vertical[y].clone()
    }

    /// Columns in which filtered pixels of row `y` may differ from those without the object.
    pub(super) fn filtered(&self, y: usize) -> Range<usize> {
        self.filtered[y].clone()
    }

    /// Windows of row `y` that may differ; a window is at the column of its left edge.
    pub(super) fn windows(&self, y: usize) -> Range<usize> {
        self.windows[y].clone()
    }
}

/// The smallest range that holds all; 0..0 if all are empty.
fn union(spans: &[Range<usize>]) -> Range<usize> {
    let full = || spans.iter().filter(|span| !span.is_empty());
    let first = full().map(|span| span.start).min().unwrap_or(0);
    first..full().map(|span| span.end).max().unwrap_or(0)
}

/// A range with `before` and `after` more columns, inside `0..width`; an empty one stays empty.
fn widen(span: &Range<usize>, before: usize, after: usize, width: usize) -> Range<usize> {
    if span.is_empty() { 0..0 } else { span.start.saturating_sub(before)..(span.end + after).min(width) }
}

fn aligned(span: &Range<usize>) -> Range<usize> {
    span.start / LANES * LANES..span.end.next_multiple_of(LANES)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spans_grow_by_the_reach_and_by_the_windows() {
        let region = Region::whole(400, 200);
        let mut coverage = vec![0.0; 400 * 200];
        coverage[100 * 400 + 200] = 1.0;
        let spans = Spans::around(&coverage, &region, 19);
        assert_eq!((spans.object(100), spans.object(99)), (192..224, 0..0));
        assert_eq!((spans.vertical(81), spans.vertical(80), spans.vertical(119)), (192..224, 0..0, 192..224));
        // 181 to 219 with the reach, and 171 with the windows.
        assert_eq!((spans.filtered(119), spans.filtered(120)), (160..224, 0..0));
        assert_eq!((spans.windows(71), spans.windows(70), spans.windows(119)), (160..224, 0..0, 160..224));
        assert_eq!(Spans::whole(&region).windows(0), 0..416);
    }
}
