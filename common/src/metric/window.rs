//! Window statistics: Gaussian means, variances and covariances over 11 x 11 pixels.
//!
//! Only windows inside the region are used. CID uses sigma 1.5, iCID 2.0 (`fspecial('gaussian', 11, sigma)`).

#![allow(
    clippy::needless_range_loop,
    reason = "indexed loops over chunks become vector code; the closures of iterator adaptors are not always inlined"
)]

use super::colour::{A, B, CHROMA, LIGHTNESS};
use super::dispatch::Lanes;
use super::planes::{LANES, Planes, ROWS_PER_TASK};
use crate::math::real::Real;
use std::ops::Range;

/// Pixels along a side of a window.
pub(super) const SIZE: usize = 11;
/// Pixels between a window's centre and its border.
pub(super) const RADIUS: usize = SIZE / 2;

/// The weights along one axis, from the centre outwards.
#[derive(Debug, Clone)]
pub(super) struct Window<R> {
    taps: [R; RADIUS + 1],
}

/// Statistics of one image for every window. The constants below name the planes.
pub(super) type Moments = Planes<f64, 4>;
/// Planes of [`Moments`].
pub(super) const MEAN_LIGHTNESS: usize = 0;
/// Variance of lightness, not below 0.
pub(super) const VARIANCE_LIGHTNESS: usize = 1;
/// Mean chroma.
pub(super) const MEAN_CHROMA: usize = 2;
/// Variance of chroma, not below 0; filled on request.
pub(super) const VARIANCE_CHROMA: usize = 3;

/// An image in the working space with its statistics.
#[derive(Debug, Clone)]
pub(super) struct Prepared {
    pub(super) working: Planes<f64, 4>,
    pub(super) moments: Moments,
}

/// The statistics of a reference and an image for a row of windows. Rows are padded to a multiple of the lanes.
#[derive(Debug)]
pub(super) struct RowStatistics<'a> {
    /// Moments of the reference.
    pub(super) reference: [&'a [f64]; 4],
    /// Moments of the image.
    pub(super) image: [&'a [f64]; 4],
    /// Covariance of the lightnesses.
    pub(super) covariance_lightness: &'a [f64],
    /// Mean of the per-pixel hue difference.
    pub(super) hue_difference: &'a [f64],
    /// Covariance of the chromas, if chroma is compared.
    pub(super) covariance_chroma: &'a [f64],
}

/// Settings and methods of the window statistics.
#[derive(Debug, Clone)]
pub(super) struct Statistics {
    pub(super) window: Window<f64>,
    /// Whether variance and covariance of chroma are needed.
    pub(super) chroma: bool,
    pub(super) lanes: Lanes,
}

impl<R: Real> Window<R> {
    /// Gaussian weights of standard deviation `sigma` pixels that sum to 1.
    pub(super) fn new(sigma: f64) -> Self {
        let mut taps: [f64; RADIUS + 1] = std::array::from_fn(|i| {
            let x = i as f64;
            crate::math::elementary::exp(-x * x / (2.0 * sigma * sigma))
        });
        let sum = taps[0] + 2.0 * taps[1..].iter().sum::<f64>();
        taps.iter_mut().for_each(|tap| *tap /= sum);
        Self { taps: taps.map(R::of) }
    }

    /// Weighted means along a span of a row of windows: of the values of `first` or, with `PRODUCT`, of their products with
    /// `second`.
    #[inline(always)]
    pub(super) fn mean_row<const PRODUCT: bool>(
        &self,
        first: &WindowRows<'_, R>,
        second: &WindowRows<'_, R>,
        span: &Range<usize>,
        column_sums: &mut [R],
        out: &mut [R],
    ) {
        let (sums, _) = column_sums.as_chunks_mut::<LANES>();
        let (begin, end) = (span.start / LANES, span.end / LANES);
        for j in begin..(end + 1).min(first[0].len()) {
            let mut total = [R::ZERO; LANES];
            for i in 0..LANES {
                total[i] = self.taps[0] * value::<R, PRODUCT>(first[RADIUS][j][i], second[RADIUS][j][i]);
            }
            for k in 1..=RADIUS {
                let above = (&first[RADIUS - k][j], &second[RADIUS - k][j]);
                let below = (&first[RADIUS + k][j], &second[RADIUS + k][j]);
                for i in 0..LANES {
                    let pair =
                        value::<R, PRODUCT>(above.0[i], above.1[i]) + value::<R, PRODUCT>(below.0[i], below.1[i]);
                    total[i] += self.taps[k] * pair;
                }
            }
            sums[j] = total;
        }
        let (chunks, _) = out.as_chunks_mut::<LANES>();
        for j in begin..end {
            let around = &column_sums[j * LANES..(j + 1) * LANES + 2 * RADIUS];
            let mut total = [R::ZERO; LANES];
            for i in 0..LANES {
                total[i] = self.taps[0] * around[i + RADIUS];
            }
            for k in 1..=RADIUS {
                let (left, right) = (&around[RADIUS - k..][..LANES], &around[RADIUS + k..][..LANES]);
                for i in 0..LANES {
                    total[i] += self.taps[k] * (left[i] + right[i]);
                }
            }
            chunks[j] = total;
        }
    }
}

/// The rows of one plane under a row of windows.
pub(super) type WindowRows<'a, R> = [&'a [[R; LANES]]; SIZE];

#[inline(always)]
fn value<R: Real, const PRODUCT: bool>(first: R, second: R) -> R {
    if PRODUCT { first * second } else { first }
}

impl Statistics {
    /// Computes the statistics of an image in the working space.
    pub(super) fn prepare(&self, working: Planes<f64, 4>) -> Prepared {
        let mut moments = Moments::new(working.width() - 2 * RADIUS, working.height() - 2 * RADIUS);
        moments.fill_rows(
            || column_sums(working.stride()),
            |column_sums, y, rows| {
                self.lanes.run(
                    #[inline(always)]
                    || self.moments_row(&working, y, column_sums, rows),
                );
            },
        );
        Prepared { working, moments }
    }

    /// Compares an image in the working space with a reference. It calls `measure` with the statistics of each row of
    /// windows, in parallel, and returns the results in the order of the rows.
    pub(super) fn compare<T: Send>(
        &self,
        reference: &Prepared,
        image: &Planes<f64, 4>,
        measure: impl Fn(usize, &RowStatistics<'_>) -> T + Sync + Send,
    ) -> Vec<T> {
        use rayon::prelude::*;
        let hue = self.hue_differences(&reference.working, image);
        let buffers = || Buffers::new(image.stride(), reference.moments.stride());
        (0..image.height() - 2 * RADIUS)
            .into_par_iter()
            .with_min_len(ROWS_PER_TASK)
            .map_init(buffers, |buffers, y| {
                self.lanes.run(
                    #[inline(always)]
                    || {
                        let moments = buffers.moments.each_mut().map(|row| &mut row[..]);
                        self.moments_row(image, y, &mut buffers.column_sums, moments);
                        self.joint_row(reference, image, &hue, y, buffers);
                    },
                );
                measure(y, &buffers.statistics(reference.moments.row(y)))
            })
            .collect()
    }

    #[inline(always)]
    fn moments_row(&self, working: &Planes<f64, 4>, y: usize, column_sums: &mut [f64], moments: [&mut [f64]; 4]) {
        let lightness = &window_rows(working, LIGHTNESS, y);
        let chroma = &window_rows(working, CHROMA, y);
        let [mean_l, variance_l, mean_c, variance_c] = moments;
        let span = &(0..mean_l.len());
        self.window.mean_row::<false>(lightness, lightness, span, column_sums, mean_l);
        self.window.mean_row::<true>(lightness, lightness, span, column_sums, variance_l);
        self.window.mean_row::<false>(chroma, chroma, span, column_sums, mean_c);
        centre_squares(mean_l, variance_l);
        if self.chroma {
            self.window.mean_row::<true>(chroma, chroma, span, column_sums, variance_c);
            centre_squares(mean_c, variance_c);
        }
    }

    #[inline(always)]
    fn joint_row(
        &self,
        reference: &Prepared,
        image: &Planes<f64, 4>,
        hue: &Planes<f64, 1>,
        y: usize,
        buffers: &mut Buffers,
    ) {
        let Buffers { column_sums, moments, covariance_lightness, hue_difference, covariance_chroma } = buffers;
        let hue = &window_rows(hue, 0, y);
        let span = &(0..hue_difference.len());
        self.window.mean_row::<false>(hue, hue, span, column_sums, hue_difference);
        let first = window_rows(&reference.working, LIGHTNESS, y);
        let second = window_rows(image, LIGHTNESS, y);
        self.window.mean_row::<true>(&first, &second, span, column_sums, covariance_lightness);
        centre_products(reference.moments.row_of(MEAN_LIGHTNESS, y), &moments[MEAN_LIGHTNESS], covariance_lightness);
        if self.chroma {
            let first = window_rows(&reference.working, CHROMA, y);
            let second = window_rows(image, CHROMA, y);
            self.window.mean_row::<true>(&first, &second, span, column_sums, covariance_chroma);
            centre_products(reference.moments.row_of(MEAN_CHROMA, y), &moments[MEAN_CHROMA], covariance_chroma);
        }
    }

    /// Per pixel, sqrt(da^2 + db^2 - dC^2). A radicand that rounding makes negative counts as 0.
    fn hue_differences(&self, reference: &Planes<f64, 4>, image: &Planes<f64, 4>) -> Planes<f64, 1> {
        let mut differences = Planes::new(image.width(), image.height());
        differences.fill_rows(
            || (),
            |(), y, [out]| {
                let (first, second) = (reference.row(y), image.row(y));
                self.lanes.run(
                    #[inline(always)]
                    || hue_difference_row(first, second, out),
                );
            },
        );
        differences
    }
}

#[inline(always)]
pub(super) fn hue_difference_row<R: Real>(first: [&[R]; 4], second: [&[R]; 4], out: &mut [R]) {
    let n = out.len();
    let (a1, b1, c1) = (&first[A][..n], &first[B][..n], &first[CHROMA][..n]);
    let (a2, b2, c2) = (&second[A][..n], &second[B][..n], &second[CHROMA][..n]);
    for i in 0..n {
        let (da, db, dc) = (a1[i] - a2[i], b1[i] - b2[i], c1[i] - c2[i]);
        out[i] = (da * da + db * db - dc * dc).max(R::ZERO).sqrt();
    }
}

/// Turns means of squares into variances.
#[inline(always)]
pub(super) fn centre_squares<R: Real>(means: &[R], squares: &mut [R]) {
    let means = &means[..squares.len()];
    for i in 0..means.len() {
        squares[i] = (squares[i] - means[i] * means[i]).max(R::ZERO);
    }
}

/// Turns means of products into covariances.
#[inline(always)]
fn centre_products(first: &[f64], second: &[f64], products: &mut [f64]) {
    let n = first.len();
    let (second, products) = (&second[..n], &mut products[..n]);
    for i in 0..n {
        products[i] -= first[i] * second[i];
    }
}

pub(super) fn window_rows<R: Real, const N: usize>(planes: &Planes<R, N>, plane: usize, y: usize) -> WindowRows<'_, R> {
    std::array::from_fn(|k| planes.row_of(plane, y + k).as_chunks().0)
}

/// A buffer for the vertical sums over a row of pixels, with room for the values that the last chunk of windows reads.
pub(super) fn column_sums<R: Real>(stride: usize) -> Vec<R> {
    vec![R::ZERO; stride + 2 * RADIUS]
}

/// The row buffers that a task reuses.
struct Buffers {
    column_sums: Vec<f64>,
    moments: [Vec<f64>; 4],
    covariance_lightness: Vec<f64>,
    hue_difference: Vec<f64>,
    covariance_chroma: Vec<f64>,
}

impl Buffers {
    fn new(stride: usize, windows_stride: usize) -> Self {
        let row = || vec![0.0; windows_stride];
        Self {
            column_sums: column_sums(stride),
            moments: [row(), row(), row(), row()],
            covariance_lightness: row(),
            hue_difference: row(),
            covariance_chroma: row(),
        }
    }

    fn statistics<'a>(&'a self, reference: [&'a [f64]; 4]) -> RowStatistics<'a> {
        RowStatistics {
            reference,
            image: self.moments.each_ref().map(|row| &row[..]),
            covariance_lightness: &self.covariance_lightness,
            hue_difference: &self.hue_difference,
            covariance_chroma: &self.covariance_chroma,
        }
    }
}
