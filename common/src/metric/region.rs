//! The part of an image that a score needs: the object's bounding box and a margin.
//!
//! Outside the box both images are 0, because they are multiplied by the coverage. The filter spreads the object by
//! `reach` pixels. A window beyond these has the same constant in both images, so its error is exactly 0. The margin is
//! therefore `reach` pixels of filtered values, 5 pixels for the centres of windows that touch them, and 5 more that
//! these windows read. The score is that of the whole image, bit for bit.

use super::planes::LANES;
use super::window::{RADIUS, SIZE};

/// A rectangle of an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Region {
    /// Columns of the image.
    pub(super) image_width: usize,
    /// Rows of the image.
    pub(super) image_height: usize,
    /// First column, a multiple of [`LANES`], so that sums over lanes are those of the whole image.
    pub(super) x0: usize,
    /// First row.
    pub(super) y0: usize,
    /// Columns.
    pub(super) width: usize,
    /// Rows.
    pub(super) height: usize,
}

impl Region {
    /// The whole image.
    pub(super) fn whole(width: usize, height: usize) -> Self {
        Self { image_width: width, image_height: height, x0: 0, y0: 0, width, height }
    }

    /// The bounding box of the covered pixels and a margin for a filter that reaches `reach` pixels; `None` without
    /// covered pixels.
    pub(super) fn around(coverage: &[f32], width: usize, height: usize, reach: usize) -> Option<Self> {
        let (mut left, mut right, mut top, mut bottom) = (width, 0, height, 0);
        for (y, row) in coverage.chunks_exact(width).enumerate() {
            let Some(first) = row.iter().position(|&c| c > 0.0) else { continue };
            let last = row.iter().rposition(|&c| c > 0.0).unwrap_or(first);
            (left, right) = (left.min(first), right.max(last + 1));
            (top, bottom) = (top.min(y), y + 1);
        }
        if right == 0 {
            return None;
        }
        let margin = reach + SIZE - 1;
        let x0 = left.saturating_sub(margin) / LANES * LANES;
        let y0 = top.saturating_sub(margin);
        let (x1, y1) = ((right + margin).min(width), (bottom + margin).min(height));
        Some(Self { image_width: width, image_height: height, x0, y0, width: x1 - x0, height: y1 - y0 })
    }

    /// Columns and rows of the windows inside the region. The first window is centred 5 pixels inside the region's
    /// corner.
    pub(super) fn windows(&self) -> (usize, usize) {
        (self.width - 2 * RADIUS, self.height - 2 * RADIUS)
    }

    /// The column of the region from which a filter reads, for each of the columns `-reach..width + reach`; `None` for
    /// a 0.
    pub(super) fn columns(&self, reach: usize) -> Vec<Option<usize>> {
        sources(self.image_width, self.x0, self.width, reach)
    }

    /// As [`Region::columns`], for rows.
    pub(super) fn rows(&self, reach: usize) -> Vec<Option<usize>> {
        sources(self.image_height, self.y0, self.height, reach)
    }
}

/// The index in the region, or `None` for a 0, of each of the positions `start - reach..start + length + reach` of an
/// axis of `n` pixels. The axis is continued by half-sample reflection. A filter at least as long as the axis gets `n /
/// 2` reflected values and then zeros (`pad4conv.m` of the authors).
fn sources(n: usize, start: usize, length: usize, reach: usize) -> Vec<Option<usize>> {
    let reflected = if 2 * reach + 1 < n { reach } else { n / 2 };
    (0..length + 2 * reach)
        .map(|i| {
            let position = start + i; // on the axis, plus `reach`
            let inside = if position < reach {
                let outside = reach - position;
                (outside <= reflected).then(|| outside - 1)
            } else if position - reach >= n {
                let outside = position - reach - n;
                (outside < reflected).then(|| n - 1 - outside)
            } else {
                Some(position - reach)
            };
            inside.and_then(|p| p.checked_sub(start)).filter(|&p| p < length)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_short_filter_reads_reflected_values_and_a_long_one_also_zeros() {
        let reflect = sources(6, 0, 6, 2);
        assert_eq!(reflect, [1, 0, 0, 1, 2, 3, 4, 5, 5, 4].map(Some));
        let long = sources(4, 0, 4, 3);
        let expected = [None, Some(1), Some(0), Some(0), Some(1), Some(2), Some(3), Some(3), Some(2), None];
        assert_eq!(long, expected);
    }

    #[test]
    fn a_region_reads_zeros_from_the_rest_of_the_image() {
        assert_eq!(sources(20, 8, 3, 2), [None, None, Some(0), Some(1), Some(2), None, None]);
        assert_eq!(sources(20, 0, 3, 2), [Some(1), Some(0), Some(0), Some(1), Some(2), None, None]);
    }

    #[test]
    fn the_region_is_the_bounding_box_with_its_margin() {
        let (width, height) = (120, 90);
        let mut coverage = vec![0.0; width * height];
        assert_eq!(Region::around(&coverage, width, height, 19), None);
        coverage[50 * width + 75] = 0.25;
        coverage[52 * width + 76] = 1.0;
        let region = Region::around(&coverage, width, height, 19).unwrap();
        assert_eq!((region.x0, region.y0, region.width, region.height), (32, 21, 106 - 32, 82 - 21));
    }
}
