//! A pyramid of the environment light: per node the energy, its centroid direction and its covariance.
//!
//! Level 0 has one node per texel of the lat-long map; each coarser level joins 2 x 2 nodes. The energy of a texel is the integral of
//! the *bilinear* radiance over the texel's area. The mean of a bilinear function over a rectangle within one patch is its value at the
//! centre, so four quadrants suffice. The covariance of radiance and sin(theta) over a quadrant is neglected in the energy, but not in
//! the centroid. Where a texel is too coarse for a lobe, cells finer than texels are computed on demand.

mod levels;
mod quadrants;

use self::{levels::Level, quadrants::Quadrants};
use super::moments::Quad;
use crate::light::Environment;
use std::f64::consts::PI;

/// A rectangle of the map: level (0 is a texel, negative is finer), row and column at that level. Stored are the parts of cells above level 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Cell {
    level: i8,
    row: u32,
    column: u32,
}

impl Cell {
    /// Whether it has parts: the finest cells have none.
    #[inline]
    pub(super) fn splits(self) -> bool {
        self.level > DEEPEST
    }

    /// The four cells into which it splits, in the order of the nodes of a [`Quad`].
    #[inline]
    pub(super) fn parts(self) -> [Self; 4] {
        let (level, row, column) = (self.level - 1, 2 * self.row, 2 * self.column);
        [(row, column), (row, column + 1), (row + 1, column), (row + 1, column + 1)].map(|(row, column)| Self {
            level,
            row,
            column,
        })
    }

    /// Its place in a list of `count` recent cells.
    #[inline]
    pub(super) fn slot(self, count: usize) -> usize {
        let place = (self.row as usize).wrapping_mul(61) + self.column as usize;
        (place + 977 * usize::from(self.level.unsigned_abs())) % count
    }
}

/// The pyramid.
#[derive(Debug)]
pub struct LightPyramid {
    environment: Environment,
    levels: Vec<Level>,
    mean_radiance: f64,
}

/// Finest level: cells are at most this many halvings of a texel.
const DEEPEST: i8 = -6;

/// Coarsening stops at this many rows.
const TOP_ROWS: u32 = 4;

impl LightPyramid {
    /// Builds the pyramid of a map.
    #[must_use]
    pub fn new(environment: Environment) -> Self {
        let mut levels = vec![Level::of_texels(&environment)];
        while let Some(finest) = levels.last().filter(|l| l.rows > TOP_ROWS) {
            levels.push(finest.coarsened());
        }
        let nodes = levels[0].quads.iter().flat_map(|quad| (0..4).map(|k| quad.numbers(k)));
        let energy: f64 = nodes.map(|[red, green, blue, ..]| f64::from(red.max(green).max(blue))).sum();
        Self { environment, levels, mean_radiance: energy / (4.0 * PI) }
    }

    /// The map.
    #[must_use]
    pub fn environment(&self) -> &Environment {
        &self.environment
    }

    /// Mean over the sphere of the strongest channel's radiance: the scale of error tolerances.
    #[must_use]
    pub fn mean_radiance(&self) -> f64 {
        self.mean_radiance
    }

    /// Cells one level coarser than the coarsest nodes; their parts cover the sphere.
    pub(super) fn roots(&self) -> impl Iterator<Item = Cell> + '_ {
        let level = self.levels.len();
        let [rows, columns] = [self.levels[level - 1].rows, self.levels[level - 1].columns].map(|n| n.div_ceil(2));
        let level = i8::try_from(level).unwrap_or(i8::MAX);
        (0..rows).flat_map(move |row| (0..columns).map(move |column| Cell { level, row, column }))
    }

    /// The light of the four parts of a cell coarser than a texel.
    #[inline]
    pub(super) fn stored(&self, cell: Cell) -> Option<&Quad> {
        let level = &self.levels[usize::try_from(cell.level - 1).ok()?];
        Some(&level.quads[cell.row as usize * level.columns.div_ceil(2) as usize + cell.column as usize])
    }

    /// The light of the four parts of a cell no coarser than a texel, which [splits](Cell::splits).
    pub(super) fn sub_texels(&self, cell: Cell) -> Quad {
        let [Cell { level, row, column }, ..] = cell.parts();
        let quadrants = Quadrants::new(&self.environment, f64::from(1u32 << level.unsigned_abs()));
        quadrants.quad(&self.environment, row, column)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        image::Image,
        math::{Rgb, elementary::sin_cos, widen},
    };

    use std::f64::consts::TAU;

    /// The sum over the coarsest cells.
    fn root_energy(pyramid: &LightPyramid) -> Rgb {
        pyramid.roots().fold(Rgb::ZERO, |sum, cell| sum + energy(pyramid.stored(cell).unwrap()))
    }

    #[test]
    fn the_roots_hold_all_the_light_of_the_map() {
        // Dim, textured walls, a window and a sun of one texel; sides that are not powers of two.
        let texel = |k: usize| match (k / 44, k % 44) {
            (6..=9, 5..=9) => [4.0, 5.0, 7.0],
            (7, 31) => [900.0, 800.0, 700.0],
            (row, column) => [0.1, 0.08, 0.06].map(|wall: f32| wall * (1.0 + 0.1 * ((3 * row + column) % 7) as f32)),
        };
        let map = Environment::new(Image::from_pixels(44, 22, (0..44 * 22).map(texel).collect())).unwrap();
        let total = map.total();
        let integral = bilinear_integral(&map);
        let pyramid = LightPyramid::new(map);
        let energy = root_energy(&pyramid);
        // The pyramid integrates the bilinear function; only sin(theta) within a quarter texel is neglected.
        assert!((energy / integral - Rgb::ONE).abs().max_element() < 1e-3, "{energy} {integral}");
        // The sum over texels has the sun in one row, not spread over three, whose solid angles differ by 1 %.
        assert!((energy / total - Rgb::ONE).abs().max_element() < 0.01, "{energy} {total}");
    }

    #[test]
    fn children_hold_the_light_of_their_parent() {
        let texel = |k: usize| [0.2 + (k % 5) as f32, 1.0, 0.5 + (k % 3) as f32];
        let map = Environment::new(Image::from_pixels(32, 16, (0..512).map(texel).collect())).unwrap();
        let pyramid = LightPyramid::new(map);
        for root in pyramid.roots() {
            let parts = pyramid.stored(root).unwrap();
            for (k, part) in root.parts().into_iter().enumerate() {
                let sum = energy(pyramid.stored(part).unwrap());
                let [red, green, blue, ..] = parts.numbers(k);
                let expected = widen([red, green, blue]);
                // Single precision.
                assert!((sum / expected - Rgb::ONE).abs().max_element() < 1e-5, "{part:?}");
            }
        }
    }

    /// Maps of one texel in height, of odd height, and of a side that is odd at some level; one without light but for a texel.
    #[test]
    fn the_roots_of_small_and_odd_maps_hold_their_light() {
        for (width, height) in [(2, 1), (4, 2), (6, 3), (10, 5), (36, 18), (38, 19)] {
            for only in [None, Some(height / 2 * width + 1)] {
                let is_lit = |k: usize| only.is_none_or(|only| only == k);
                let texel = |k: usize| if is_lit(k) { [0.3 + (k % 3) as f32, 1.0, 2.0] } else { [0.0; 3] };
                let map = Image::from_pixels(width, height, (0..width * height).map(texel).collect());
                let map = Environment::new(map).unwrap();
                let integral = bilinear_integral(&map);
                let pyramid = LightPyramid::new(map);
                let error = (root_energy(&pyramid) / integral - Rgb::ONE).abs().max_element();
                // Only sin(theta) over a quadrant is neglected.
                assert!(error < 0.5 / (height * height) as f64, "{width} x {height}, lit {only:?}: {error}");
                for quad in pyramid.levels.iter().flat_map(|level| &level.quads) {
                    assert!((0..4).flat_map(|k| quad.numbers(k)).all(f32::is_finite), "{width} x {height}: {quad:?}");
                }
            }
        }
    }

    fn energy(quad: &Quad) -> Rgb {
        (0..4).map(|k| quad.numbers(k)).map(|[red, green, blue, ..]| widen([red, green, blue])).sum()
    }

    /// Radiance over the sphere by the midpoint rule with 8 x 8 points per texel.
    fn bilinear_integral(map: &Environment) -> Rgb {
        let (rows, columns) = (8 * map.height(), 8 * map.width());
        let mut sum = Rgb::ZERO;
        for i in 0..rows {
            let v = (i as f64 + 0.5) / rows as f64;
            let row =
                (0..columns).fold(Rgb::ZERO, |row, j| row + map.radiance_at((j as f64 + 0.5) / columns as f64, v));
            sum += row * sin_cos(PI * v).0;
        }
        sum * (PI / rows as f64) * (TAU / columns as f64)
    }
}
