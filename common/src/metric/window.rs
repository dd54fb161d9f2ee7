//! Window statistics: Gaussian means, variances and covariances over 11 x 11 pixels.
//!
//! Only windows that lie inside the region count. CID uses sigma 1.5, iCID 2.0 (`fspecial('gaussian', 11, sigma)`).

use super::colour::{A, B, CHROMA, LIGHTNESS};
use super::dispatch::Lanes;
use super::planes::{LANES, Planes, ROWS_PER_TASK};

/// Pixels along a side of a window.
pub(super) const SIZE: usize = 11;
/// Pixels between a window's centre and its border.
pub(super) const RADIUS: usize = SIZE / 2;

/// The weights along one axis, from the centre outwards.
#[derive(Debug, Clone)]
pub(super) struct Window {
    taps: [f64; RADIUS + 1],
}

/// Statistics of one image for every window: see the constants for the planes.
pub(super) type Moments = Planes<4>;
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
    pub(super) working: Planes<4>,
    pub(super) moments: Moments,
}

/// The statistics of a reference and an image along a row of windows. Rows are padded to a multiple of the lanes.
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

/// How statistics are taken.
#[derive(Debug, Clone)]
pub(super) struct Statistics {
    pub(super) window: Window,
    /// Whether variance and covariance of chroma are needed.
    pub(super) chroma: bool,
    pub(super) lanes: Lanes,
}

impl Window {
    /// Gaussian weights of standard deviation `sigma` pixels that sum to 1.
    pub(super) fn new(sigma: f64) -> Self {
        let mut taps: [f64; RADIUS + 1] = std::array::from_fn(|i| {
            let x = i as f64;
            crate::math::elementary::exp(-x * x / (2.0 * sigma * sigma))
        });
        let sum = taps[0] + 2.0 * taps[1..].iter().sum::<f64>();
        taps.iter_mut().for_each(|tap| *tap /= sum);
        Self { taps }
    }

    /// Weighted means along a row of windows of a quantity given by (row of the window, chunk of columns).
    #[inline(always)]
    fn mean_row(&self, quantity: impl Fn(usize, usize) -> [f64; LANES], column_sums: &mut [f64], out: &mut [f64]) {
        for (j, sum) in column_sums.as_chunks_mut::<LANES>().0.iter_mut().enumerate() {
            let centre = quantity(RADIUS, j);
            let mut total: [f64; LANES] = std::array::from_fn(|i| self.taps[0] * centre[i]);
            for k in 1..=RADIUS {
                let (above, below) = (quantity(RADIUS - k, j), quantity(RADIUS + k, j));
                (0..LANES).for_each(|i| total[i] += self.taps[k] * (above[i] + below[i]));
            }
            *sum = total;
        }
        let columns = column_sums.len() - 2 * RADIUS;
        let out = &mut out[..columns];
        let at = |k: usize| &column_sums[k..k + columns];
        let (centre, rest): (_, [_; RADIUS]) = (at(RADIUS), std::array::from_fn(|k| (at(RADIUS - k - 1), at(RADIUS + k + 1))));
        for x in 0..columns {
            let mut total = self.taps[0] * centre[x];
            for (k, (left, right)) in rest.iter().enumerate() {
                total += self.taps[k + 1] * (left[x] + right[x]);
            }
            out[x] = total;
        }
    }
}

impl Statistics {
    /// Takes the statistics of an image in the working space.
    pub(super) fn prepare(&self, working: Planes<4>) -> Prepared {
        let mut moments = Moments::new(working.width() - 2 * RADIUS, working.height() - 2 * RADIUS);
        let stride = working.stride();
        moments.fill_rows(
            || (vec![0.0; stride], std::array::from_fn(|_| vec![0.0; stride])),
            |(column_sums, buffers), y, rows| {
                self.lanes.run(
                    #[inline(always)]
                    || self.moments_row(&working, y, column_sums, buffers),
                );
                rows.into_iter().zip(buffers).for_each(|(row, buffer)| {
                    let n = row.len();
                    row.copy_from_slice(&buffer[..n]);
                });
            },
        );
        Prepared { working, moments }
    }

    /// Compares an image in the working space with a reference: calls `measure` with the statistics of every row of
    /// windows, in parallel, and returns its results in the order of the rows.
    pub(super) fn compare<T: Send>(
        &self,
        reference: &Prepared,
        image: &Planes<4>,
        measure: impl Fn(usize, &RowStatistics<'_>) -> T + Sync + Send,
    ) -> Vec<T> {
        use rayon::prelude::*;
        let hue = self.hue_differences(&reference.working, image);
        let buffers = || Buffers::new(image.stride());
        (0..image.height() - 2 * RADIUS)
            .into_par_iter()
            .with_min_len(ROWS_PER_TASK)
            .map_init(buffers, |buffers, y| {
                self.lanes.run(
                    #[inline(always)]
                    || {
                        self.moments_row(image, y, &mut buffers.column_sums, &mut buffers.moments);
                        self.joint_row(reference, image, &hue, y, buffers);
                    },
                );
                measure(y, &buffers.statistics(reference.moments.row(y)))
            })
            .collect()
    }

    #[inline(always)]
    fn moments_row(&self, working: &Planes<4>, y: usize, column_sums: &mut [f64], moments: &mut [Vec<f64>; 4]) {
        let lightness = window_rows(working, LIGHTNESS, y);
        let chroma = window_rows(working, CHROMA, y);
        let [mean_l, variance_l, mean_c, variance_c] = moments;
        self.window.mean_row(|k, j| lightness[k][j], column_sums, mean_l);
        self.window.mean_row(|k, j| lightness[k][j].map(|x| x * x), column_sums, variance_l);
        self.window.mean_row(|k, j| chroma[k][j], column_sums, mean_c);
        centre_squares(mean_l, variance_l);
        if self.chroma {
            self.window.mean_row(|k, j| chroma[k][j].map(|x| x * x), column_sums, variance_c);
            centre_squares(mean_c, variance_c);
        }
    }

    #[inline(always)]
    fn joint_row(&self, reference: &Prepared, image: &Planes<4>, hue: &Planes<1>, y: usize, buffers: &mut Buffers) {
        let Buffers { column_sums, moments, covariance_lightness, hue_difference, covariance_chroma } = buffers;
        let hue: [_; SIZE] = std::array::from_fn(|k| hue.row_of(0, y + k).as_chunks().0);
        self.window.mean_row(|k, j| hue[k][j], column_sums, hue_difference);
        let mut covariance = |channel: usize, mean: usize, out: &mut Vec<f64>| {
            let first = window_rows(&reference.working, channel, y);
            let second = window_rows(image, channel, y);
            let products = |k: usize, j: usize| {
                let (a, b) = (&first[k][j], &second[k][j]);
                std::array::from_fn(|i| a[i] * b[i])
            };
            self.window.mean_row(products, column_sums, out);
            let means = reference.moments.row_of(mean, y).iter().zip(&moments[mean]);
            out.iter_mut().zip(means).for_each(|(x, (a, b))| *x -= a * b);
        };
        covariance(LIGHTNESS, MEAN_LIGHTNESS, covariance_lightness);
        if self.chroma {
            covariance(CHROMA, MEAN_CHROMA, covariance_chroma);
        }
    }

    /// Per pixel, sqrt(da^2 + db^2 - dC^2); rounding can make the radicand negative, which counts as 0.
    fn hue_differences(&self, reference: &Planes<4>, image: &Planes<4>) -> Planes<1> {
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
fn hue_difference_row(first: [&[f64]; 4], second: [&[f64]; 4], out: &mut [f64]) {
    let n = out.len();
    let (first, second) = (first.map(|row| &row[..n]), second.map(|row| &row[..n]));
    for i in 0..n {
        let square = |channel: usize| {
            let d = first[channel][i] - second[channel][i];
            d * d
        };
        out[i] = (square(A) + square(B) - square(CHROMA)).max(0.0).sqrt();
    }
}

/// Turns means of squares into variances.
#[inline(always)]
fn centre_squares(means: &[f64], squares: &mut [f64]) {
    squares.iter_mut().zip(means).for_each(|(square, mean)| *square = (*square - mean * mean).max(0.0));
}

#[inline(always)]
fn window_rows(planes: &Planes<4>, channel: usize, y: usize) -> [&[[f64; LANES]]; SIZE] {
    std::array::from_fn(|k| planes.row_of(channel, y + k).as_chunks().0)
}

/// Rows that one task fills again and again.
struct Buffers {
    column_sums: Vec<f64>,
    moments: [Vec<f64>; 4],
    covariance_lightness: Vec<f64>,
    hue_difference: Vec<f64>,
    covariance_chroma: Vec<f64>,
}

impl Buffers {
    fn new(stride: usize) -> Self {
        let row = || vec![0.0; stride];
        Self {
            column_sums: row(),
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
