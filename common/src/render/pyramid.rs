//! A pyramid of the environment light: per node the energy, its centroid direction and its covariance.
//!
//! Level 0 has one node per texel of the lat-long map; each coarser level joins 2 x 2 nodes. The energy of a texel is the integral of
//! the *bilinear* radiance over the texel's area. The mean of a bilinear function over a rectangle within one patch is its value at the
//! centre, so four quadrants suffice. The covariance of radiance and sin(theta) over a quadrant is neglected in the energy, but not in
//! the centroid. Where a texel is too coarse for a lobe, [`Cell`]s finer than texels are computed on demand.

pub use super::moments::Node;
use super::moments::{Moments, Symmetric};
use crate::{
    light::Environment,
    math::{Vec3, elementary::sin_cos},
};
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};

/// A rectangle of the map: level (negative is finer than texels), row and column at that level.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cell {
    level: i8,
    row: u32,
    column: u32,
}

impl Cell {
    /// Whether its light is stored, not computed on demand.
    #[inline]
    pub(super) fn is_at_least_a_texel(self) -> bool {
        self.level >= 0
    }

    /// Its place in a list of `count` recent cells.
    #[inline]
    pub(super) fn slot(self, count: usize) -> usize {
        let place = (self.row as usize).wrapping_mul(61) + self.column as usize;
        (place + 977 * usize::from(self.level.unsigned_abs())) % count
    }
}

#[derive(Debug)]
struct Level {
    rows: u32,
    columns: u32,
    nodes: Vec<Node>,
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
        let mut levels = vec![texel_level(&environment)];
        while let Some(finest) = levels.last().filter(|l| l.rows > TOP_ROWS) {
            levels.push(coarsen(finest));
        }
        let energy: f64 = levels[0].nodes.iter().map(|n| f64::from(strongest(n.energy))).sum();
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

    /// The coarsest cells, which cover the sphere.
    pub fn roots(&self) -> impl Iterator<Item = Cell> + '_ {
        let level = self.levels.len() - 1;
        let top = &self.levels[level];
        let level = i8::try_from(level).unwrap_or(i8::MAX);
        (0..top.rows).flat_map(move |row| (0..top.columns).map(move |column| Cell { level, row, column }))
    }

    /// The light of a cell.
    #[must_use]
    pub fn node(&self, cell: Cell) -> Node {
        match usize::try_from(cell.level) {
            Ok(level) => {
                let level = &self.levels[level];
                level.nodes[cell.row as usize * level.columns as usize + cell.column as usize]
            }
            Err(_) => self.sub_texel(cell),
        }
    }

    /// The cells into which a cell splits; empty for the finest cells.
    pub fn children(&self, cell: Cell) -> impl Iterator<Item = Cell> + use<> {
        let (rows, columns) = match usize::try_from(cell.level - 1) {
            Ok(level) => (self.levels[level].rows, self.levels[level].columns),
            Err(_) => (u32::MAX, u32::MAX),
        };
        let fine = cell.level > DEEPEST;
        (0..4u32).filter_map(move |k| {
            let (row, column) = (2 * cell.row + k / 2, 2 * cell.column + k % 2);
            (fine && row < rows && column < columns).then_some(Cell { level: cell.level - 1, row, column })
        })
    }

    fn sub_texel(&self, cell: Cell) -> Node {
        let parts = Quadrants::new(&self.environment, f64::from(1u32 << cell.level.unsigned_abs()));
        let (row, column) = (f64::from(cell.row), f64::from(cell.column));
        parts.moments(parts.row(row), parts.column(column)).node()
    }
}

/// Equal rectangles of the map in (u, v), each within one bilinear patch: `scale` of them, a power of two, along each side of a texel.
struct Quadrants<'a> {
    environment: &'a Environment,
    /// Rectangles along the map's height and width.
    size: [f64; 2],
    dtheta: f64,
    dphi: f64,
    /// Sine of half of `dtheta`.
    half: f64,
}

/// The middle of a row or column of quadrants: its place on the map, sine and cosine of its angle.
#[derive(Clone, Copy)]
struct Middle {
    place: f64,
    sin: f64,
    cos: f64,
}

impl<'a> Quadrants<'a> {
    fn new(environment: &'a Environment, scale: f64) -> Self {
        let size = [environment.height() as f64 * scale, environment.width() as f64 * scale];
        let (dtheta, dphi) = (PI / size[0], TAU / size[1]);
        Self { environment, size, dtheta, dphi, half: sin_cos(0.5 * dtheta).0 }
    }

    fn row(&self, row: f64) -> Middle {
        let place = (row + 0.5) / self.size[0];
        let (sin, cos) = sin_cos(PI * place);
        Middle { place, sin, cos }
    }

    fn column(&self, column: f64) -> Middle {
        let place = (column + 0.5) / self.size[1];
        let (sin, cos) = sin_cos(TAU * place - self.environment.rotation_deg().to_radians());
        Middle { place, sin, cos }
    }

    /// The light of one rectangle.
    ///
    /// Over a square of side 1 around 0 the density `1 + a s + b t + c s t` has the mean (a, b)/12, the mean squares 1/12 and the mean
    /// product c/144. Here `a`, `b`, `c` are the changes of the bilinear radiance over the rectangle, relative to its middle, and `b`
    /// holds that of sin(theta) too.
    fn moments(&self, row: Middle, column: Middle) -> Moments {
        let Self { environment, size, dtheta, dphi, half } = *self;
        // Exact: integral of sin(theta) over the row is 2 sin(middle) sin(dtheta / 2).
        let solid_angle = dphi * 2.0 * row.sin * half;
        let (radiance, slopes) = environment.radiance_and_slopes(column.place, row.place);
        let sum = radiance.element_sum();
        // Slopes per texel become changes over the rectangle, relative to the radiance.
        let side = environment.height() as f64 / size[0];
        let [a, b, c] = if sum > 0.0 { slopes.map(|slope| slope * side / sum) } else { [0.0; 3] };
        let (s, t) = (a / 12.0, (b + dtheta * row.cos / row.sin) / 12.0);
        let ((sin_theta, cos_theta), (sin_phi, cos_phi)) = (row.turned(t * dtheta), column.turned(s * dphi));
        let centroid = Vec3::new(sin_theta * sin_phi, cos_theta, -sin_theta * cos_phi);

        let width = row.sin * dphi;
        let east = Vec3::new(cos_phi, 0.0, sin_phi);
        let south = centroid.cross(east);
        let mixed = width * dtheta * (c * side / 144.0 - s * t);
        let spread = Symmetric::square(east) * (width * width * (1.0 / 12.0 - s * s))
            + Symmetric::square(south) * (dtheta * dtheta * (1.0 / 12.0 - t * t))
            + Symmetric::product(east, south) * mixed;
        // Rows widen towards the equator: take the wider edge. The centroid lies within 2/9 of the sides of the middle (a rectangle at
        // a pole, whose density grows away from it and towards a bright texel).
        let wider = width + dtheta * dphi;
        let radius = (0.5 + 2.0 / 9.0) * (dtheta * dtheta + wider * wider).sqrt();
        Moments { energy: radiance * solid_angle, centroid, spread, radius }
    }
}

impl Middle {
    /// Sine and cosine of the middle's angle plus a small one: of less than a radian, with an error of its ninth power / 9!.
    fn turned(self, by: f64) -> (f64, f64) {
        let x = by * by;
        let sin = by * (1.0 - x / 6.0 * (1.0 - x / 20.0 * (1.0 - x / 42.0)));
        let cos = 1.0 - x / 2.0 * (1.0 - x / 12.0 * (1.0 - x / 30.0 * (1.0 - x / 56.0)));
        (self.sin * cos + self.cos * sin, self.cos * cos - self.sin * sin)
    }
}

fn texel_level(environment: &Environment) -> Level {
    let (height, width) = (environment.height(), environment.width());
    let parts = Quadrants::new(environment, 2.0);
    let columns: Vec<Middle> = (0..2 * width).map(|j| parts.column(j as f64)).collect();
    let nodes = (0..height).into_par_iter().flat_map_iter(|i| {
        let rows = [2 * i, 2 * i + 1].map(|row| parts.row(row as f64));
        let (parts, columns) = (&parts, &columns);
        (0..width).map(move |j| {
            let quadrant = |k: usize| parts.moments(rows[k / 2], columns[2 * j + k % 2]);
            Moments::join(&std::array::from_fn::<_, 4, _>(quadrant)).node()
        })
    });
    let count = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
    Level { rows: count(height), columns: count(width), nodes: nodes.collect() }
}

fn coarsen(fine: &Level) -> Level {
    let (rows, columns) = (fine.rows.div_ceil(2), fine.columns.div_ceil(2));
    let nodes = (0..rows).into_par_iter().flat_map_iter(|row| {
        (0..columns).map(move |column| {
            let mut children = Vec::with_capacity(4);
            for k in 0..4 {
                let (r, c) = (2 * row + k / 2, 2 * column + k % 2);
                if r < fine.rows && c < fine.columns {
                    children.push(Moments::from(&fine.nodes[r as usize * fine.columns as usize + c as usize]));
                }
            }
            Moments::join(&children).node()
        })
    });
    Level { rows, columns, nodes: nodes.collect() }
}

/// The strongest channel.
#[must_use]
pub fn strongest(energy: [f32; 3]) -> f32 {
    energy[0].max(energy[1]).max(energy[2])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        image::Image,
        math::{Rgb, widen},
    };

    /// The sum over the coarsest cells.
    fn root_energy(pyramid: &LightPyramid) -> Rgb {
        pyramid.roots().fold(Rgb::ZERO, |sum, cell| sum + widen(pyramid.node(cell).energy))
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
            let sum = pyramid.children(root).fold(Rgb::ZERO, |sum, child| sum + widen(pyramid.node(child).energy));
            // Single precision.
            assert!((sum / widen(pyramid.node(root).energy) - Rgb::ONE).abs().max_element() < 1e-5, "{root:?}");
        }
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
