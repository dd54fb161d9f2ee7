//! The S-CIELAB spatial filter, which removes detail that a viewer at a given distance cannot resolve.
//!
//! Zhang & Wandell, *A Spatial Extension of CIELAB for Digital Color Image Reproduction* (SID 1996), with the constants
//! and the discretisation of the authors' CID program (`separableFilters.m`, `gauss.m`). In Poirson & Wandell's
//! opponent space, each channel is a weighted sum of separable Gaussians. The weight w is applied as sqrt|w| along each
//! axis, with its sign along x only. The gains for constant colours are 1.0048, 0.9920 and 0.9944; they are not
//! normalised to 1.
//!
//! Each output row is filtered along y first (the sum of two mirrored rows is used for all Gaussians of a channel),
//! then along x from buffers that stay in the first-level cache. The authors filter along x first; the results differ
//! by rounding.

#![allow(
    clippy::needless_range_loop,
    reason = "indexed loops over chunks become vector code; the closures of iterator adaptors are not always inlined"
)]

use super::colour::Matrix;
use super::planes::{LANES, Planes};
use super::region::Region;
use super::spans::Spans;
use crate::math::{
    elementary::{exp, ln},
    real::Real,
};
use std::ops::Range;

/// XYZ to opponent colours: achromatic, red-green, blue-yellow (`cmatrix('xyz2opp')`, CIE 1931).
pub(super) const XYZ_TO_OPPONENT: Matrix = [
    [278.7336e-3, 721.8031e-3, -106.5520e-3],
    [-448.7736e-3, 289.8056e-3, 77.1569e-3],
    [85.9513e-3, -589.9859e-3, 501.1089e-3],
];

/// (half-width in degrees, weight) of each channel's Gaussians, narrowest first.
const ACHROMATIC: [(f64, f64); 3] = [(0.05, 1.003_27), (0.225, 0.114_416), (7.0, -0.117_686)];
const RED_GREEN: [(f64, f64); 2] = [(0.0685, 0.616_725), (0.826, 0.383_275)];
const BLUE_YELLOW: [(f64, f64); 2] = [(0.092, 0.567_885), (0.6451, 0.432_115)];

/// The kernels are built with at least this many samples per degree and then resampled.
const MINIMUM_SAMPLES_PER_DEGREE: f64 = 224.0;

/// Taps below this fraction of the centre tap, in units of the precision, are omitted: their sum is below the rounding error of the
/// result.
const NEGLIGIBLE_TAP: f64 = 5e-4;

/// The filter for one viewing distance.
#[derive(Debug, Clone)]
pub(super) struct Scielab<R> {
    achromatic: Channel<R, 2>,
    red_green: Channel<R, 1>,
    blue_yellow: Channel<R, 1>,
    reach: usize,
}

/// One channel: a narrow Gaussian and `W` wide ones. Each kernel is stored as the half from its centre, along y; along
/// x it is multiplied by the sign of its weight.
#[derive(Debug, Clone)]
struct Channel<R, const W: usize> {
    narrow: Vec<R>,
    /// Tap k of all wide kernels, which are used together.
    wide: Vec<[R; W]>,
    sign: [R; W],
}

impl<R: Real> Scielab<R> {
    /// The filter for `samples_per_degree` pixels per degree of visual angle.
    pub(super) fn new(samples_per_degree: f64) -> Self {
        let achromatic = Channel::new(ACHROMATIC[0], [ACHROMATIC[1], ACHROMATIC[2]], samples_per_degree);
        let red_green = Channel::new(RED_GREEN[0], [RED_GREEN[1]], samples_per_degree);
        let blue_yellow = Channel::new(BLUE_YELLOW[0], [BLUE_YELLOW[1]], samples_per_degree);
        let reach = achromatic.wide.len() - 1;
        Self { achromatic, red_green, blue_yellow, reach }
    }

    /// Pixels between the centre and the last tap.
    pub(super) fn reach(&self) -> usize {
        self.reach
    }

    /// Buffers for [`Scielab::filter_row`].
    pub(super) fn scratch(&self, region: &Region) -> Scratch<R> {
        let stride = region.width.next_multiple_of(LANES);
        Scratch {
            rows: region.rows(self.reach),
            columns: region.columns(self.reach),
            zeros: vec![R::ZERO; stride],
            smoothed: std::array::from_fn(|_| vec![R::ZERO; stride + 2 * self.reach]),
        }
    }

    /// Filters row `y` of three opponent planes into `out`, rows of the planes' stride, where it may differ from 0.
    #[inline(always)]
    pub(super) fn filter_row(
        &self,
        opponent: &Planes<R, 3>,
        y: usize,
        spans: &Spans,
        scratch: &mut Scratch<R>,
        out: [&mut [R]; 3],
    ) {
        let Scratch { rows, columns, zeros, smoothed } = scratch;
        let (sources, zeros) = (&rows[y..y + 2 * self.reach + 1], &zeros[..]);
        let source =
            |channel: usize| sources.iter().map(move |row| row.map_or(zeros, move |row| opponent.row_of(channel, row)));
        let [narrow, wide_a, wide_b] = smoothed;
        let [achromatic, red_green, blue_yellow] = out;
        let (vertical, filtered) = (spans.vertical(y), spans.filtered(y));
        let layout = Layout { reach: self.reach, width: opponent.width(), columns, vertical, filtered };
        self.achromatic.filter_row(source(0), &layout, narrow, [&mut *wide_a, wide_b], achromatic);
        self.red_green.filter_row(source(1), &layout, narrow, [&mut *wide_a], red_green);
        self.blue_yellow.filter_row(source(2), &layout, narrow, [wide_a], blue_yellow);
    }
}

/// The buffers of one task that filters rows.
#[derive(Debug)]
pub(super) struct Scratch<R> {
    rows: Vec<Option<usize>>,
    columns: Vec<Option<usize>>,
    zeros: Vec<R>,
    smoothed: [Vec<R>; 3],
}

struct Layout<'a> {
    reach: usize,
    width: usize,
    columns: &'a [Option<usize>],
    /// Columns of the sums along y and of the result.
    vertical: Range<usize>,
    filtered: Range<usize>,
}

impl<R: Real, const W: usize> Channel<R, W> {
    fn new(narrow: (f64, f64), wide: [(f64, f64); W], samples_per_degree: f64) -> Self {
        let kernels = wide.map(|gaussian| half_kernel(gaussian, samples_per_degree));
        let mut narrow = half_kernel(narrow, samples_per_degree);
        let negligible = NEGLIGIBLE_TAP * R::EPSILON.widen() * narrow[0];
        let significant = narrow.iter().take_while(|&&tap| tap > negligible).count();
        narrow.truncate(significant);
        let wide_taps = (0..kernels[0].len()).map(|k| std::array::from_fn(|g| R::of(kernels[g][k]))).collect();
        let narrow = narrow.into_iter().map(R::of).collect();
        Self { narrow, wide: wide_taps, sign: wide.map(|(_, weight)| R::of(weight.signum())) }
    }

    #[inline(always)]
    fn filter_row<'a>(
        &self,
        source: impl Iterator<Item = &'a [R]>,
        layout: &Layout<'_>,
        narrow: &mut [R],
        mut wide: [&mut Vec<R>; W],
        out: &mut [R],
    ) where
        R: 'a,
    {
        begin_row(narrow, layout);
        wide.iter_mut().for_each(|row| begin_row(row, layout));
        self.along_y(source, layout, narrow, wide.each_mut().map(|row| &mut row[..]));
        continue_row(narrow, layout);
        wide.iter_mut().for_each(|row| continue_row(row, layout));
        self.along_x(layout, narrow, wide.map(|row| &row[..]), out);
    }

    /// Sums the rows around the current one, into rows that begin `reach` columns before column 0.
    #[inline(always)]
    fn along_y<'a>(
        &self,
        source: impl Iterator<Item = &'a [R]>,
        layout: &Layout<'_>,
        narrow: &mut [R],
        wide: [&mut [R]; W],
    ) where
        R: 'a,
    {
        let rows: Vec<&[[R; LANES]]> = source.map(|row| row.as_chunks().0).collect();
        let reach = layout.reach;
        let (centre, pairs) = (rows[reach], self.narrow.len());
        for j in layout.vertical.start / LANES..layout.vertical.end / LANES {
            let (mut narrow_sum, mut wide_sum) = (zero(), [zero(); W]);
            add_scaled(&mut narrow_sum, self.narrow[0], &centre[j]);
            for g in 0..W {
                add_scaled(&mut wide_sum[g], self.wide[0][g], &centre[j]);
            }
            for k in 1..pairs {
                let pair = sum_of(&rows[reach - k][j], &rows[reach + k][j]);
                add_scaled(&mut narrow_sum, self.narrow[k], &pair);
                for g in 0..W {
                    add_scaled(&mut wide_sum[g], self.wide[k][g], &pair);
                }
            }
            for k in pairs..=reach {
                let pair = sum_of(&rows[reach - k][j], &rows[reach + k][j]);
                for g in 0..W {
                    add_scaled(&mut wide_sum[g], self.wide[k][g], &pair);
                }
            }
            narrow[reach + j * LANES..][..LANES].copy_from_slice(&narrow_sum);
            for g in 0..W {
                wide[g][reach + j * LANES..][..LANES].copy_from_slice(&wide_sum[g]);
            }
        }
    }

    /// Sums along rows that begin `reach` columns before column 0.
    #[inline(always)]
    fn along_x(&self, layout: &Layout<'_>, narrow: &[R], wide: [&[R]; W], out: &mut [R]) {
        let reach = layout.reach;
        let (chunks, _) = out.as_chunks_mut::<LANES>();
        for j in layout.filtered.start / LANES..layout.filtered.end / LANES {
            let span = j * LANES..(j + 1) * LANES + 2 * reach;
            let mut sum = zero();
            let row = &narrow[span.clone()];
            add_scaled(&mut sum, self.narrow[0], lanes(row, reach));
            for k in 1..self.narrow.len() {
                add_scaled(&mut sum, self.narrow[k], &sum_of(lanes(row, reach - k), lanes(row, reach + k)));
            }
            for g in 0..W {
                let row = &wide[g][span.clone()];
                let mut part = zero();
                add_scaled(&mut part, self.wide[0][g], lanes(row, reach));
                for k in 1..=reach {
                    add_scaled(&mut part, self.wide[k][g], &sum_of(lanes(row, reach - k), lanes(row, reach + k)));
                }
                add_scaled(&mut sum, self.sign[g], &part);
            }
            chunks[j] = sum;
        }
    }
}

/// Sets the columns of a row that the sums along x read to 0.
#[inline(always)]
fn begin_row<R: Real>(row: &mut [R], layout: &Layout<'_>) {
    // The row begins `reach` columns before column 0.
    row[layout.filtered.start..layout.filtered.end + 2 * layout.reach].fill(R::ZERO);
}

/// Continues a row, which begins `reach` columns before column 0, beyond both ends of the region.
#[inline(always)]
fn continue_row<R: Real>(row: &mut [R], layout: &Layout<'_>) {
    let (reach, width) = (layout.reach, layout.width);
    for i in (0..reach).chain(reach + width..width + 2 * reach) {
        row[i] = layout.columns[i].map_or(R::ZERO, |column| row[reach + column]);
    }
}

#[inline(always)]
fn zero<R: Real>() -> [R; LANES] {
    [R::ZERO; LANES]
}

/// The chunk that begins at `at`; a row always reaches to its end.
#[inline(always)]
fn lanes<R>(row: &[R], at: usize) -> &[R; LANES] {
    let Some(lanes) = row[at..].first_chunk() else { unreachable!("a row is padded to whole chunks") };
    lanes
}

#[inline(always)]
fn sum_of<R: Real>(a: &[R; LANES], b: &[R; LANES]) -> [R; LANES] {
    let mut sum = zero();
    for i in 0..LANES {
        sum[i] = a[i] + b[i];
    }
    sum
}

#[inline(always)]
fn add_scaled<R: Real>(sum: &mut [R; LANES], tap: R, chunk: &[R; LANES]) {
    for i in 0..LANES {
        sum[i] += tap * chunk[i];
    }
}

/// Half of the kernel of one Gaussian, from its centre, times sqrt|weight|.
///
/// A Gaussian over one degree is sampled `up` times as finely, normalised, convolved with a triangle of base 2 `up`,
/// and read at every `up`-th sample. As in `gauss.m`, the width parameter is 2 sqrt(ln 2) / (half-width - 1) in
/// samples.
fn half_kernel((half_width, weight): (f64, f64), samples_per_degree: f64) -> Vec<f64> {
    let up = (MINIMUM_SAMPLES_PER_DEGREE / samples_per_degree).ceil().max(1.0);
    let samples = samples_per_degree * up;
    let up = crate::math::cell(up, usize::MAX);
    // An odd number of samples, 2 middle + 1, over one degree.
    let middle = crate::math::cell((samples / 2.0).ceil(), usize::MAX) - 1;
    let alpha = 2.0 * ln(2.0).sqrt() / (half_width * samples - 1.0);
    let gaussian = |i: usize| exp(-(alpha * i as f64) * (alpha * i as f64));
    let sum = gaussian(0) + 2.0 * (1..=middle).map(gaussian).sum::<f64>();
    let factor = weight.abs().sqrt() / sum;
    let sample = |i: usize| if i <= middle { factor * gaussian(i) } else { 0.0 };
    (0..=middle / up)
        .map(|k| {
            let centre = k * up;
            let triangle = (1..up).map(|d| {
                let height = (up - d) as f64 / up as f64;
                height * (sample(centre.abs_diff(d)) + sample(centre + d))
            });
            sample(centre) + triangle.sum::<f64>()
        })
        .collect()
}

#[cfg(test)]
mod tests;
