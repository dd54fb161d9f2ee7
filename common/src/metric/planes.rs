//! Working buffers of the metric: `N` planes of numbers, interleaved by row.

use crate::math::real::Real;

/// Values that the row loops process together. Row lengths are padded to a multiple of it.
pub(super) const LANES: usize = 32;

/// `N` planes of `height x width` values. Rows with the same index are adjacent in memory, so that a parallel task can
/// write to this row of all planes. Each row is padded to a multiple of [`LANES`].
#[derive(Debug, Clone)]
pub(super) struct Planes<R, const N: usize> {
    width: usize,
    height: usize,
    stride: usize,
    values: Vec<R>,
}

impl<R: Real, const N: usize> Planes<R, N> {
    /// Planes of zeros.
    pub(super) fn new(width: usize, height: usize) -> Self {
        let stride = width.next_multiple_of(LANES);
        Self { width, height, stride, values: vec![R::ZERO; N * stride * height] }
    }

    pub(super) fn width(&self) -> usize {
        self.width
    }

    pub(super) fn height(&self) -> usize {
        self.height
    }

    /// Length of a row with its padding.
    pub(super) fn stride(&self) -> usize {
        self.stride
    }

    /// Row `y` of each plane, with its padding.
    pub(super) fn row(&self, y: usize) -> [&[R]; N] {
        let row = &self.values[y * N * self.stride..(y + 1) * N * self.stride];
        std::array::from_fn(|plane| &row[plane * self.stride..(plane + 1) * self.stride])
    }

    /// Row `y` of one plane, with its padding.
    pub(super) fn row_of(&self, plane: usize, y: usize) -> &[R] {
        &self.values[(y * N + plane) * self.stride..(y * N + plane + 1) * self.stride]
    }

    /// Runs `fill` for every row, in parallel. `scratch` makes buffers once per task.
    pub(super) fn fill_rows<S: Send>(
        &mut self,
        scratch: impl Fn() -> S + Sync + Send,
        fill: impl Fn(&mut S, usize, [&mut [R]; N]) + Sync + Send,
    ) {
        use rayon::prelude::*;
        let stride = self.stride;
        self.values
            .par_chunks_exact_mut(N * stride)
            .enumerate()
            .with_min_len(ROWS_PER_TASK)
            .for_each_init(scratch, |scratch, (y, row)| fill(scratch, y, split(row, stride)));
    }
}

/// The least number of rows per parallel task, so that the cost of its scratch buffers is small.
pub(super) const ROWS_PER_TASK: usize = 8;

/// The `N` rows of length `stride` in a row of planes.
fn split<R, const N: usize>(row: &mut [R], stride: usize) -> [&mut [R]; N] {
    let mut rows = row.chunks_exact_mut(stride);
    std::array::from_fn(|_| rows.next().unwrap_or_default())
}
