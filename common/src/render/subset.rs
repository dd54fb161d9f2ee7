//! The pixel subset of stage one (\[BP20b\] section 3; design section 1).
//!
//! N pixels are drawn independently, with replacement, with probability proportional to their intensity in the photo;
//! duplicates merge into counts, and `w_p = count / (N pdf_p)` makes the weighted sum an unbiased estimate of the sum
//! over all pixels.

use super::transport::{Pixel, tile_order};
use crate::{
    choice::choice,
    math::sampling::{key, uniform},
};
use std::{fmt, str::FromStr};
use thiserror::Error;

/// How many pixels stage one uses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SampleCount {
    /// This many draws.
    Draws(u32),
    /// Every usable pixel, each with weight 1.
    Full,
}

impl Default for SampleCount {
    /// 256, as in the paper.
    fn default() -> Self {
        Self::Draws(256)
    }
}

/// A text that is no [`SampleCount`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("expected a whole number above 0, or full; at most {} can be drawn", u32::MAX)]
pub struct UnknownSampleCount;

impl FromStr for SampleCount {
    type Err = UnknownSampleCount;

    /// A whole number above 0, or `full`.
    fn from_str(text: &str) -> Result<Self, UnknownSampleCount> {
        match text.parse() {
            Ok(count @ 1..) => Ok(Self::Draws(count)),
            Err(_) if text == "full" => Ok(Self::Full),
            _ => Err(UnknownSampleCount),
        }
    }
}

impl fmt::Display for SampleCount {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Draws(count) => write!(f, "{count}"),
            Self::Full => write!(f, "full"),
        }
    }
}

/// How pixels are drawn.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Sampling {
    /// Probability proportional to intensity (the paper's).
    #[default]
    Importance,
    /// One draw from each of N equal parts of the pixels, in Morton order; density uniform.
    Stratified,
    /// Equal probability for every pixel.
    Uniform,
}

choice! { Sampling:
    Importance = "importance", "In proportion to the photo's luminance, as in the paper";
    Stratified = "stratified", "All usable pixels alike, one draw from each of N equal parts of the image";
    Uniform = "uniform", "All usable pixels alike, drawn independently";
}

/// A pixel that stage one may use.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Candidate {
    /// Column and row.
    pub pixel: Pixel,
    /// Rec. 709 luminance of the photo, at least 0.
    pub intensity: f64,
}

/// The chosen pixels, each once, in [`tile_order`], so that neighbours share cuts of the light pyramid.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PixelSubset {
    /// Column and row.
    pub pixels: Vec<Pixel>,
    /// `count / (N pdf)`; 1 for the full set.
    pub weights: Vec<f64>,
}

/// Part of the key of the random numbers, so that they differ from those of other modules.
const STAGE: u64 = 1;

impl PixelSubset {
    /// Draws a subset; a pure function of its arguments. `index` is the number of the subset in its run.
    ///
    /// Returns `None` if there is no candidate, or if all intensities are 0 with importance sampling.
    #[must_use]
    pub fn draw(
        candidates: &[Candidate],
        count: SampleCount,
        sampling: Sampling,
        seed: u64,
        index: u32,
    ) -> Option<Self> {
        if candidates.is_empty() {
            return None;
        }
        let mut ordered = candidates.to_vec();
        ordered.sort_by_key(|c| (c.pixel[1], c.pixel[0]));
        let SampleCount::Draws(draws) = count else {
            return Some(Self::in_tile_order(ordered.iter().map(|c| (c.pixel, 1.0)).collect()));
        };
        let random = |draw: u32| uniform(key(&[seed, STAGE, u64::from(index), u64::from(draw)]));
        let mut counts = vec![0u32; ordered.len()];
        let mut pdf = vec![1.0 / ordered.len() as f64; ordered.len()];
        match sampling {
            Sampling::Uniform => {
                (0..draws).for_each(|d| counts[crate::math::cell(random(d) * ordered.len() as f64, ordered.len())] += 1)
            }
            Sampling::Stratified => {
                let mut order: Vec<usize> = (0..ordered.len()).collect();
                order.sort_by_key(|&i| morton(ordered[i].pixel));
                for d in 0..draws {
                    let position = (f64::from(d) + random(d)) / f64::from(draws) * ordered.len() as f64;
                    counts[order[crate::math::cell(position, ordered.len())]] += 1;
                }
            }
            Sampling::Importance => {
                let total: f64 = ordered.iter().map(|c| c.intensity).sum();
                if total.is_nan() || total <= 0.0 {
                    return None;
                }
                pdf.iter_mut().zip(&ordered).for_each(|(p, c)| *p = c.intensity / total);
                let mut running = 0.0;
                let cumulative: Vec<f64> = ordered
                    .iter()
                    .map(|c| {
                        running += c.intensity;
                        running
                    })
                    .collect();
                for d in 0..draws {
                    let target = random(d) * running;
                    // The first pixel whose cumulative intensity exceeds the target; it has intensity > 0.
                    let chosen = cumulative.partition_point(|&c| c <= target).min(ordered.len() - 1);
                    counts[chosen] += 1;
                }
            }
        }
        let drawn = ordered.iter().zip(&counts).zip(&pdf).filter(|((_, count), _)| **count > 0);
        let weighted = drawn.map(|((c, &count), pdf)| (c.pixel, f64::from(count) / (f64::from(draws) * pdf)));
        Some(Self::in_tile_order(weighted.collect()))
    }

    fn in_tile_order(mut chosen: Vec<(Pixel, f64)>) -> Self {
        chosen.sort_by_key(|(pixel, _)| tile_order(*pixel));
        let (pixels, weights) = chosen.into_iter().unzip();
        Self { pixels, weights }
    }
}

/// Interleaves the bits of column and row.
fn morton([column, row]: Pixel) -> u64 {
    let spread = |x: u32| {
        let mut x = u64::from(x);
        for (shift, mask) in [
            (16, 0x0000_FFFF_0000_FFFF),
            (8, 0x00FF_00FF_00FF_00FF),
            (4, 0x0F0F_0F0F_0F0F_0F0F),
            (2, 0x3333_3333_3333_3333),
            (1, 0x5555_5555_5555_5555),
        ] {
            x = (x | (x << shift)) & mask;
        }
        x
    };
    spread(column) | (spread(row) << 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gradient() -> Vec<Candidate> {
        let pixel = |i: u32| [i % 40, i / 40];
        (0..1600).map(|i| Candidate { pixel: pixel(i), intensity: f64::from(i % 40) + 0.5 }).collect()
    }

    #[test]
    fn samples_are_a_count_or_everything() {
        assert_eq!("full".parse(), Ok(SampleCount::Full));
        assert_eq!("256".parse(), Ok(SampleCount::default()));
        assert_eq!("12".parse::<SampleCount>().unwrap().to_string(), "12");
        for text in ["0", "-1", "2.5", "all", "", "4294967296"] {
            assert!(text.parse::<SampleCount>().is_err(), "{text}");
        }
    }

    #[test]
    fn weighted_sums_estimate_sums_over_all_pixels_without_bias() {
        let all = gradient();
        let quantity = |c: &Candidate| c.intensity * (1.0 + 0.3 * f64::from(c.pixel[1] % 7));
        let exact: f64 = all.iter().map(quantity).sum();
        for sampling in [Sampling::Importance, Sampling::Stratified, Sampling::Uniform] {
            let runs: u32 = 200;
            let mut mean = 0.0;
            for run in 0..runs {
                let s = PixelSubset::draw(&all, SampleCount::Draws(256), sampling, 5, run).unwrap();
                let at = |p: &Pixel| all[(p[1] * 40 + p[0]) as usize];
                let estimate: f64 = s.pixels.iter().zip(&s.weights).map(|(p, w)| w * quantity(&at(p))).sum();
                mean += estimate / f64::from(runs);
            }
            // The standard deviation of one draw's estimate is below the value itself: 1/sqrt(256 * 200), five of them.
            assert!((mean / exact - 1.0).abs() < 5.0 / (256.0_f64 * 200.0).sqrt(), "{sampling:?}: {mean} {exact}");
        }
    }

    #[test]
    fn draws_are_counted_and_repeatable() {
        let all = gradient();
        let draw = |seed| PixelSubset::draw(&all, SampleCount::Draws(256), Sampling::Importance, seed, 0).unwrap();
        assert_eq!(draw(1), draw(1));
        assert_ne!(draw(1), draw(2));
        let total: f64 = all.iter().map(|c| c.intensity).sum();
        let s = draw(1);
        let counts: f64 =
            s.pixels.iter().zip(&s.weights).map(|(p, w)| w * 256.0 * (f64::from(p[0]) + 0.5) / total).sum();
        assert!((counts - 256.0).abs() < 1e-9);
    }

    #[test]
    fn black_pixels_are_never_drawn_and_black_photos_give_none() {
        let mut all = gradient();
        all.iter_mut().filter(|c| c.pixel[0] > 3).for_each(|c| c.intensity = 0.0);
        let s = PixelSubset::draw(&all, SampleCount::Draws(256), Sampling::Importance, 0, 0).unwrap();
        assert!(s.pixels.iter().all(|p| p[0] <= 3));
        all.iter_mut().for_each(|c| c.intensity = 0.0);
        assert_eq!(PixelSubset::draw(&all, SampleCount::Draws(256), Sampling::Importance, 0, 0), None);
        assert_eq!(PixelSubset::draw(&[], SampleCount::Full, Sampling::Uniform, 0, 0), None);
    }

    #[test]
    fn the_full_set_has_unit_weights() {
        let s = PixelSubset::draw(&gradient(), SampleCount::Full, Sampling::Importance, 0, 0).unwrap();
        assert_eq!((s.pixels.len(), s.weights.iter().all(|&w| w == 1.0)), (1600, true));
    }

    #[test]
    fn pixels_are_in_tile_order_whatever_the_order_of_the_candidates() {
        let mut reversed = gradient();
        reversed.reverse();
        for count in [SampleCount::Full, SampleCount::Draws(300)] {
            let s = PixelSubset::draw(&gradient(), count, Sampling::Importance, 3, 0).unwrap();
            assert!(s.pixels.is_sorted_by_key(|p| tile_order(*p)), "{count:?}");
            assert_eq!(Some(s), PixelSubset::draw(&reversed, count, Sampling::Importance, 3, 0));
        }
    }
}
