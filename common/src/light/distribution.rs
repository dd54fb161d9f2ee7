//! The density from which light directions are drawn. It follows the bilinear map (design section 5).
//!
//! A *cell* lies between four neighbouring texel centres. Over the unit square of (u, v) the density is bilinear in
//! each cell; its value at a texel centre (a *node*) is `max(r, g, b) sin(theta_i)`. The ratio radiance / pdf is
//! therefore bounded over the sphere, even beside a one-texel sun. (With a piecewise-constant density it is not, which
//! makes fireflies.) In the half cells between a pole and the row next to it the density falls linearly to 0 at the
//! pole, as sin(theta) does. Their node is the larger of two opposite texels, because the radiance there mixes both.
//! Per solid angle, `pdf = density(u, v) / (2 pi^2 sin(theta))`, which stays finite at the poles.
//!
//! A sample chooses the row of cells by the integrals of the rows, then the cell by the integrals of the cells. Inside
//! the cell it inverts the bilinear density exactly: first down (the marginal is linear), then across (the conditional
//! is linear). Inside a row the result is monotone in each coordinate, so low-discrepancy points stay well spread.
//!
//! The density has no lower bound: no direction is drawn where the map is black.

use super::Environment;
use super::environment::Place;
use crate::math::elementary::sin_cos;
use crate::math::{Rgb, Vec3, cell};
use std::f64::consts::PI;
use std::sync::Arc;

/// Draws directions in proportion to the light of an [`Environment`].
#[derive(Debug, Clone)]
pub struct LightDistribution {
    environment: Arc<Environment>,
    /// Running sum of the integrals of the height + 1 rows of cells.
    row_sums: Vec<f64>,
    /// For each row of cells, the running sum of the integrals of its width cells.
    cell_sums: Vec<f64>,
    /// For each row of cells, one entry per [`GUIDE_STEP`] cells: the index at which the search for a cell starts.
    guide: Vec<u32>,
    guide_length: usize,
    /// Factor from a node value to the density per solid angle times sin(theta).
    scale: f64,
}

/// A direction drawn from a [`LightDistribution`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightSample {
    /// Unit vector towards the light, world.
    pub direction: Vec3,
    /// Radiance from this direction.
    pub radiance: Rgb,
    /// Density per steradian, positive and finite.
    pub pdf: f64,
}

impl LightDistribution {
    /// The distribution of a map.
    #[must_use]
    pub fn new(environment: Arc<Environment>) -> Self {
        let (width, height) = (environment.width(), environment.height());
        let mut row_sums = Vec::with_capacity(height + 1);
        let mut cell_sums = Vec::with_capacity((height + 1) * width);
        let mut total = 0.0;
        for row in 0..=height {
            let mut sum = 0.0;
            for column in 0..width {
                sum += Cell::of(&environment, row, column).integral();
                cell_sums.push(sum);
            }
            total += sum;
            row_sums.push(total);
        }
        let scale = (width * height) as f64 / (total * 2.0 * PI * PI);
        let guide_length = width.div_ceil(GUIDE_STEP);
        let guide = cell_sums.chunks_exact(width).flat_map(|sums| guide_of(sums, guide_length)).collect();
        Self { environment, row_sums, cell_sums, guide, guide_length, scale }
    }

    /// The map of this distribution.
    #[must_use]
    pub fn environment(&self) -> &Arc<Environment> {
        &self.environment
    }

    /// Maps a point of the unit square to a direction, with its radiance and density.
    #[must_use]
    pub fn sample(&self, u: [f64; 2]) -> LightSample {
        let (row, across_rows) = draw(&self.row_sums, 0, u[1]);
        let (column, across_cells) = self.draw_cell(row, u[0]);
        let cell = Cell::of(&self.environment, row, column);
        let t = cell.invert_down(across_rows);
        let s = cell.invert_across(t, across_cells);
        let (width, height) = (self.environment.width() as f64, self.environment.height() as f64);
        let map_u = (column as f64 + 0.5 + s) / width;
        let map_v = ((row as f64 - 0.5 + t) / height).clamp(POLE, 1.0 - POLE);
        let (sin_theta, cos_theta) = sin_cos(PI * map_v);
        let direction = self.environment.direction_at(map_u, sin_theta, cos_theta);
        let t = map_v * height + 0.5 - row as f64;
        let [r, g, b, node] = self.environment.bilinear(Place { node: cell.node, s, t });
        LightSample { direction, radiance: Rgb::new(r, g, b), pdf: self.pdf_of(node, sin_theta) }
    }

    /// Density per steradian of drawing a direction (unit); 0 where the map is black.
    #[must_use]
    #[inline]
    pub fn pdf(&self, direction: Vec3) -> f64 {
        self.radiance_and_pdf(direction).1
    }

    /// Radiance and density per steradian in a direction (unit), from one look-up.
    #[must_use]
    #[inline]
    pub fn radiance_and_pdf(&self, direction: Vec3) -> (Rgb, f64) {
        let sin_theta = (direction.x * direction.x + direction.z * direction.z).sqrt();
        let [u, v] = self.environment.uv_at(direction, sin_theta);
        let place = self.environment.place([u, v.clamp(POLE, 1.0 - POLE)]);
        let [r, g, b, node] = self.environment.bilinear(place);
        (Rgb::new(r, g, b), self.pdf_of(node, sin_theta))
    }

    #[inline]
    fn pdf_of(&self, node: f64, sin_theta: f64) -> f64 {
        node.max(0.0) * self.scale / sin_theta.max(SIN_POLE)
    }

    fn draw_cell(&self, row: usize, u: f64) -> (usize, f64) {
        let width = self.environment.width();
        let sums = &self.cell_sums[row * width..(row + 1) * width];
        let guide = &self.guide[row * self.guide_length..(row + 1) * self.guide_length];
        draw(sums, guide[cell(u * self.guide_length as f64, self.guide_length)] as usize, u)
    }
}

/// The density over one cell as four node values. Beside a pole only half of the cell exists.
#[derive(Debug, Clone, Copy)]
struct Cell {
    node: usize,
    upper: [f64; 2],
    lower: [f64; 2],
    /// The part of t in \[0, 1\] that is on the sphere.
    span: [f64; 2],
}

impl Cell {
    /// The cell right of texel column `column` in row `row` of the height + 1 rows of cells.
    fn of(environment: &Environment, row: usize, column: usize) -> Self {
        // The border shifts columns by one: texel `column` is column `column + 1` of the bordered grid.
        let node = row * environment.stride() + column + 1;
        let density = |node: usize| f64::from(environment.nodes()[node][3]);
        let below = node + environment.stride();
        Self {
            node,
            upper: [density(node), density(node + 1)],
            lower: [density(below), density(below + 1)],
            span: [if row == 0 { 0.5 } else { 0.0 }, if row == environment.height() { 0.5 } else { 1.0 }],
        }
    }

    /// Twice the mean of the density across the cell, at the ends of the span; 0 at a pole.
    fn ends(self) -> [f64; 2] {
        self.span.map(|t| {
            let w = 1.0 - t;
            (w * (self.upper[0] + self.upper[1]) + t * (self.lower[0] + self.lower[1])).max(0.0)
        })
    }

    /// Integral over the cell, in units of the area of a whole cell.
    fn integral(self) -> f64 {
        let [first, last] = self.ends();
        0.25 * (first + last) * (self.span[1] - self.span[0])
    }

    fn invert_down(self, x: f64) -> f64 {
        let [first, last] = self.ends();
        self.span[0] + (self.span[1] - self.span[0]) * invert_linear(first, last, x)
    }

    fn invert_across(self, t: f64, x: f64) -> f64 {
        let at = |k: usize| ((1.0 - t) * self.upper[k] + t * self.lower[k]).max(0.0);
        invert_linear(at(0), at(1), x)
    }
}

/// The point of \[0, 1\] that has the fraction `x` of the integral below it, for a density linear from `a` at 0 to `b`
/// at 1.
fn invert_linear(a: f64, b: f64, x: f64) -> f64 {
    let root = (a * a + x * (b * b - a * a)).max(0.0).sqrt();
    if a + root > 0.0 { (x * (a + b) / (a + root)).min(1.0) } else { x }
}

/// The first entry of the running sums that exceeds the fraction `u` of their total, and the position of that fraction
/// within the entry. The position is inside (0, 1), because at an end the density of a cell may be 0. The search starts
/// at entry `start`, which must not lie after the result.
fn draw(sums: &[f64], start: usize, u: f64) -> (usize, f64) {
    let total = sums[sums.len() - 1];
    let target = u * total;
    let mut index = start + gallop(&sums[start..], |&sum| sum <= target);
    if index == sums.len() {
        // u * total was rounded up to the total: take the last entry that is larger than the one before it.
        index = sums.partition_point(|&sum| sum < total);
    }
    let before = if index == 0 { 0.0 } else { sums[index - 1] };
    let width = sums[index] - before;
    let fraction = if width > 0.0 { (target - before) / width } else { 0.5 };
    (index, fraction.clamp(EDGE, 1.0 - EDGE))
}

/// `partition_point` by galloping search, fast if the result is near the start.
fn gallop(sums: &[f64], is_before: impl Fn(&f64) -> bool) -> usize {
    let (mut low, mut step) = (0, 1);
    while low + step <= sums.len() && is_before(&sums[low + step - 1]) {
        low += step;
        step *= 2;
    }
    let high = (low + step).min(sums.len());
    low + sums[low..high].partition_point(is_before)
}

/// For each of `length` equal parts of the total, the first running sum above the part's lower end.
fn guide_of(sums: &[f64], length: usize) -> Vec<u32> {
    let total = sums[sums.len() - 1];
    let mut index = 0;
    (0..length)
        .map(|part| {
            let target = part as f64 / length as f64 * total;
            while index + 1 < sums.len() && sums[index] <= target {
                index += 1;
            }
            u32::try_from(index).unwrap_or(u32::MAX)
        })
        .collect()
}

/// Cells per entry of the guide table.
const GUIDE_STEP: usize = 2;

/// Look-ups of the density keep this distance (in v) from the poles, where density and sin(theta) are both 0. It is
/// 3e-8 radians: far smaller than a texel, and large enough that the ratio of the two keeps eight digits.
const POLE: f64 = 1e-8;
const SIN_POLE: f64 = PI * POLE;

/// Distance from the ends of a cell, below the resolution of the 32-bit points that directions are drawn with.
const EDGE: f64 = 1e-10;

#[cfg(test)]
mod tests;
