//! CSSIM without a part of the image, for the standard error of the difference between two matches.

use super::{features::FEATURES, maps::Maps, window::RADIUS};
use std::ops::Range;

/// Blocks along each side of the object's surroundings.
const BLOCKS: usize = 8;

/// The windows of an image in 8 x 8 blocks around the object: for every block their number and the sums of 1 minus each feature; then
/// the same for all windows that are in no block.
#[derive(Debug, Clone, PartialEq)]
pub struct Blocks(Vec<Block>);

/// The number of windows, and the sums of 1 minus each of the features l_L, c_L, s_L, l_C, l_H.
pub type Block = (f64, [f64; FEATURES]);

impl Blocks {
    /// Splits the windows whose columns and rows (of the image's pixels at their upper left corner) are in these ranges. Only windows
    /// for which `counts` count.
    pub(super) fn new(
        maps: &Maps,
        columns: Range<usize>,
        rows: Range<usize>,
        counts: impl Fn(usize, usize) -> bool,
    ) -> Self {
        let (width, height) = (maps.width - 2 * RADIUS, maps.height - 2 * RADIUS);
        let mut blocks = vec![(0.0, [0.0; FEATURES]); BLOCKS * BLOCKS + 1];
        let place =
            |x: usize, range: &Range<usize>| range.contains(&x).then(|| (x - range.start) * BLOCKS / range.len());
        for y in 0..height {
            for x in (0..width).filter(|x| counts(*x, y)) {
                let block = place(x, &columns).zip(place(y, &rows)).map_or(BLOCKS * BLOCKS, |(x, y)| y * BLOCKS + x);
                blocks[block].0 += 1.0;
                for (sum, feature) in blocks[block].1.iter_mut().zip(&maps.features) {
                    *sum += 1.0 - feature[y * width + x];
                }
            }
        }
        Self(blocks)
    }

    /// The numbers behind it.
    #[must_use]
    pub fn to_parts(&self) -> &[Block] {
        &self.0
    }

    /// The blocks from [`Self::to_parts`]; `None` if these cannot be blocks.
    #[must_use]
    pub fn from_parts(blocks: Vec<Block>) -> Option<Self> {
        // A feature is from -1 to 1; rounding may exceed that a little.
        let is_valid = |(windows, sums): &Block| {
            let range = -1e-6 * windows..=(2.0 + 1e-6) * windows;
            *windows >= 0.0 && windows.is_finite() && sums.iter().all(|sum| range.contains(sum))
        };
        (blocks.len() == BLOCKS * BLOCKS + 1 && blocks.iter().all(is_valid)).then_some(Self(blocks))
    }

    /// CSSIM of all windows.
    #[must_use]
    pub fn cssim(&self) -> f64 {
        self.without(None)
    }

    /// CSSIM of the windows outside a block.
    fn without(&self, left_out: Option<usize>) -> f64 {
        let (mut windows, mut sums) = (0.0, [0.0; FEATURES]);
        for (_, block) in self.0.iter().enumerate().filter(|(b, _)| Some(*b) != left_out) {
            windows += block.0;
            sums.iter_mut().zip(&block.1).for_each(|(sum, of_block)| *sum += of_block);
        }
        if windows == 0.0 { 0.0 } else { 1.0 - sums.iter().map(|sum| 1.0 - sum / windows).product::<f64>() }
    }

    /// CSSIM of this image minus that of another image compared with the same reference, and the standard error of this difference: the
    /// jackknife (Efron & Stein 1981) over the blocks that have windows, which treats blocks as independent.
    #[must_use]
    pub fn difference(&self, other: &Self) -> (f64, f64) {
        let filled: Vec<usize> = (0..BLOCKS * BLOCKS).filter(|&b| self.0[b].0 > 0.0 || other.0[b].0 > 0.0).collect();
        let without: Vec<f64> = filled.iter().map(|&b| self.without(Some(b)) - other.without(Some(b))).collect();
        let count = without.len().max(1) as f64;
        let mean = without.iter().sum::<f64>() / count;
        let variance = without.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() * (count - 1.0) / count;
        (self.cssim() - other.cssim(), variance.sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Maps of one feature that differs from 1 by `deficit` at each window.
    fn maps(deficit: impl Fn(usize, usize) -> f64) -> Maps {
        let mut maps = Maps::equal(90, 50);
        for y in 0..40 {
            for x in 0..80 {
                maps.features[2][y * 80 + x] = 1.0 - deficit(x, y);
            }
        }
        maps
    }

    #[test]
    fn the_score_is_that_of_the_maps_wherever_the_blocks_are() {
        let maps = maps(|x, y| 1e-3 * (x + y) as f64);
        let mean = maps.features[2].iter().sum::<f64>() / 3200.0;
        for columns in [0..80, 13..71] {
            let blocks = Blocks::new(&maps, columns, 3..40, |_, _| true);
            assert!((blocks.cssim() - (1.0 - mean)).abs() < 1e-12);
            assert_eq!(Blocks::from_parts(blocks.to_parts().to_vec()), Some(blocks));
        }
        assert_eq!(Blocks::from_parts(vec![(1.0, [0.0; 5]); 3]), None);
        assert_eq!(Blocks::from_parts(vec![(1.0, [1e300; 5]); 65]), None);
    }

    /// Of a mean, the jackknife is the standard error of the mean: here of 64 equal blocks.
    #[test]
    fn standard_error_of_a_mean_is_the_textbook_one() {
        let of_block = |x: usize, y: usize| f64::from(u8::try_from((x / 10 * 7 + y / 5 * 3) % 11).unwrap());
        let a = Blocks::new(&maps(|x, y| 0.02 + 0.01 * of_block(x, y)), 0..80, 0..40, |_, _| true);
        let b = Blocks::new(&maps(|_, _| 0.02), 0..80, 0..40, |_, _| true);
        let values: Vec<f64> = (0..64).map(|i| 0.01 * of_block(i % 8 * 10, i / 8 * 5)).collect();
        let mean = values.iter().sum::<f64>() / 64.0;
        let variance = values.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / 63.0;
        let (difference, error) = a.difference(&b);
        assert!((difference - mean).abs() < 1e-12, "{difference} {mean}");
        assert!((error / (variance / 64.0).sqrt() - 1.0).abs() < 1e-9, "{error}");
        assert_eq!(a.difference(&a), (0.0, 0.0));
    }
}
