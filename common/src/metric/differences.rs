//! The features of every window from the *difference* of an image and a reference.
//!
//! With D the difference of the lightnesses, variance and covariance of the image follow from those of the reference and of D. The deficits
//! of contrast and structure become sums of small terms instead of differences of large ones:
//!
//! (s1 - s2)^2 = (v2 - v1)^2 / (s1 + s2)^2 with v2 - v1 = 2 cov(L1, D) + var D, and s1 s2 - s12 = (var D - (s1 - s2)^2) / 2.
//!
//! So single precision suffices for a search, and equal images have deficits of exactly 0. [`super::features`] has the features, and the
//! same deficits from the statistics of two images.

use super::colour::{CHROMA, LIGHTNESS};
use super::dispatch::Lanes;
use super::features::{
    CHROMA_WEIGHT, CONTRAST_CONSTANT, FEATURES, HUE_WEIGHT, LIGHTNESS_WEIGHT, STRUCTURE_CONSTANT, mean_deficit,
};
use super::planes::{Planes, ROWS_PER_TASK};
use super::spans::Spans;
use super::window::{RADIUS, Window, centre_squares, column_sums, hue_difference_row, window_rows};
use crate::math::real::Real;
use std::ops::Range;

/// Lightness is L00 minus this, half its range: variances of smaller numbers are more accurate.
const PIVOT: f64 = 37.5;

/// Differences of the pixels of an image from those of the reference: of lightness, of chroma, and of hue, sqrt(da^2 + db^2 - dC^2).
pub(super) type Differences<R> = Planes<R, 3>;

/// A reference in the working space, with mean and variance of the lightness in each window.
#[derive(Debug, Clone)]
pub(super) struct Reference<R> {
    working: Planes<R, 4>,
    lightness: Planes<R, 2>,
    window: Window<R>,
    lanes: Lanes,
}

impl<R: Real> Reference<R> {
    pub(super) fn new(mut working: Planes<R, 4>, window: Window<R>, lanes: Lanes) -> Self {
        working.fill_rows(|| (), |(), _, rows| rows[LIGHTNESS].iter_mut().for_each(|l| *l -= R::of(PIVOT)));
        let mut lightness = Planes::new(working.width() - 2 * RADIUS, working.height() - 2 * RADIUS);
        lightness.fill_rows(
            || column_sums(working.stride()),
            |column_sums, y, [mean, variance]| {
                lanes.run(
                    #[inline(always)]
                    || {
                        let rows = &window_rows(&working, LIGHTNESS, y);
                        let span = &(0..mean.len());
                        window.mean_row::<false>(rows, rows, span, column_sums, mean);
                        window.mean_row::<true>(rows, rows, span, column_sums, variance);
                        centre_squares(mean, variance);
                    },
                );
            },
        );
        Self { working, lightness, window, lanes }
    }

    /// Fills a span of row `y` of the differences from the same span of the image in the working space.
    #[inline(always)]
    pub(super) fn difference_row(&self, y: usize, span: Range<usize>, image: [&[R]; 4], out: [&mut [R]; 3]) {
        let reference = self.working.row(y).map(|row| &row[span.clone()]);
        let [lightness, chroma, hue] = out;
        let n = lightness.len();
        let (l1, l2) = (&reference[LIGHTNESS][..n], &image[LIGHTNESS][..n]);
        let (c1, c2) = (&reference[CHROMA][..n], &image[CHROMA][..n]);
        let chroma = &mut chroma[..n];
        for i in 0..n {
            lightness[i] = (l2[i] - R::of(PIVOT)) - l1[i];
            chroma[i] = c2[i] - c1[i];
        }
        hue_difference_row(reference, image, hue);
    }

    /// Calls `measure` with the deficits of the features in the span of each row of windows, in parallel, and returns the results in the
    /// order of the rows. A span may end in the padding of a row.
    pub(super) fn compare<T: Send>(
        &self,
        differences: &Differences<R>,
        spans: &Spans,
        measure: impl Fn(usize, Range<usize>, [&[R]; FEATURES]) -> T + Sync + Send,
    ) -> Vec<T> {
        use rayon::prelude::*;
        let stride = self.lightness.stride();
        let row = || vec![R::ZERO; stride];
        let buffers =
            || (column_sums(differences.stride()), std::array::from_fn(|_| row()), std::array::from_fn(|_| row()));
        (0..self.lightness.height())
            .into_par_iter()
            .with_min_len(ROWS_PER_TASK)
            .map_init(buffers, |(column_sums, means, deficits), y| {
                self.lanes.run(
                    #[inline(always)]
                    || {
                        let span = spans.windows(y);
                        self.mean_rows(differences, y, &span, column_sums, means);
                        self.deficit_rows(y, &span, means, deficits);
                        measure(y, span.clone(), deficits.each_ref().map(|row| &row[span.clone()]))
                    },
                )
            })
            .collect()
    }

    /// Means over the windows of row `y`: of D, D^2, D times the reference's lightness, and the differences of chroma and hue.
    #[inline(always)]
    fn mean_rows(
        &self,
        differences: &Differences<R>,
        y: usize,
        span: &Range<usize>,
        column_sums: &mut [R],
        means: &mut [Vec<R>; 5],
    ) {
        let [lightness, square, product, chroma, hue] = means;
        let first = &window_rows(&self.working, LIGHTNESS, y);
        let [d, dc, dh] = &[0, 1, 2].map(|plane| window_rows(differences, plane, y));
        self.window.mean_row::<false>(d, d, span, column_sums, lightness);
        self.window.mean_row::<true>(d, d, span, column_sums, square);
        self.window.mean_row::<true>(first, d, span, column_sums, product);
        self.window.mean_row::<false>(dc, dc, span, column_sums, chroma);
        self.window.mean_row::<false>(dh, dh, span, column_sums, hue);
    }

    /// The deficits of l_L, c_L, s_L, l_C and l_H from the means.
    #[inline(always)]
    fn deficit_rows(&self, y: usize, span: &Range<usize>, means: &[Vec<R>; 5], deficits: &mut [Vec<R>; FEATURES]) {
        let [mean, variance] = self.lightness.row(y).map(|row| &row[span.clone()]);
        let n = mean.len();
        let variance = &variance[..n];
        let [d, square, product, dc, dh] = means.each_ref().map(|row| &row[span.clone()][..n]);
        let [l_l, c_l, s_l, l_c, l_h] = deficits.each_mut().map(|row| &mut row[span.clone()][..n]);
        for x in 0..n {
            l_l[x] = mean_deficit(LIGHTNESS_WEIGHT, d[x]);
            l_c[x] = mean_deficit(CHROMA_WEIGHT, dc[x]);
            l_h[x] = mean_deficit(HUE_WEIGHT, dh[x]);
            let of_difference = (square[x] - d[x] * d[x]).max(R::ZERO);
            let covariance = product[x] - mean[x] * d[x];
            (c_l[x], s_l[x]) = contrast_and_structure(variance[x], covariance, of_difference);
        }
    }
}

/// The deficits of contrast and structure, from the variance of the reference, its covariance with the difference, and the variance of the
/// difference.
#[inline(always)]
fn contrast_and_structure<R: Real>(variance: R, covariance: R, of_difference: R) -> (R, R) {
    let half = R::of(0.5);
    let change = covariance + covariance + of_difference;
    let other = (variance + change).max(R::ZERO);
    let (sum, product) = (variance + other, (variance * other).sqrt());
    let total = (sum + product + product).max(R::of(f64::from(f32::MIN_POSITIVE)));
    // The difference of two standard deviations is at most the standard deviation of the difference; rounding may say otherwise.
    let squared = (change * change / total).min(of_difference);
    let contrast = squared / (R::of(CONTRAST_CONSTANT) + sum);
    let structure = half * (of_difference - squared) / (R::of(STRUCTURE_CONSTANT) + product);
    (contrast, structure)
}
