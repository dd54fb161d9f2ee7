//! The light of rectangles of the map, each within one bilinear patch.

use crate::{
    light::Environment,
    math::{
        elementary::sin_cos,
        lanes::{Double, Lanes, Lanes3, Vector, cross},
        simd::dispatch,
    },
    render::moments::{Moments, NUMBERS, NodeLanes, Quad, Symmetric, mix},
};
use pulp::{Simd, WithSimd};
use std::f64::consts::{PI, TAU};

/// `f64` lanes of the longest register that `pulp` uses.
pub(super) const LONGEST_REGISTER: usize = 8;

/// Equal rectangles of the map in (u, v), each within one bilinear patch: `scale` of them, a power of two, along each side of a texel.
pub(super) struct Quadrants {
    /// Rectangles along the map's height and width.
    size: [f64; 2],
    rotation_rad: f64,
    dtheta: f64,
    dphi: f64,
    /// Sine of half of `dtheta`.
    half: f64,
    /// Side in texels.
    side: f64,
}

/// The middle of a row or column of quadrants: its place on the map, sine and cosine of its angle.
#[derive(Clone, Copy)]
pub(super) struct Middle {
    place: f64,
    pub(super) sin: f64,
    pub(super) cos: f64,
}

/// Radiance in the middle of a rectangle, and the derivatives of its sum over the channels per texel: along u, along v, mixed.
pub(super) type Light<V> = (Lanes3<V>, Lanes3<V>);

/// The light at a place between four texels: upper left, upper right, lower left, lower right.
#[inline(always)]
pub(super) fn bilinear<V: Vector>([ul, ur, dl, dr]: [Lanes3<V>; 4], s: Lanes<V>, t: Lanes<V>) -> Light<V> {
    let one = Lanes::splat_like(s, 1.0);
    let (left, above) = (one - s, one - t);
    let weights = [left * above, s * above, left * t, s * t];
    let radiance = [
        mix([ul[0], ur[0], dl[0], dr[0]], weights),
        mix([ul[1], ur[1], dl[1], dr[1]], weights),
        mix([ul[2], ur[2], dl[2], dr[2]], weights),
    ];
    let (ul, ur) = (ul[0] + ul[1] + ul[2], ur[0] + ur[1] + ur[2]);
    let (dl, dr) = (dl[0] + dl[1] + dl[2], dr[0] + dr[1] + dr[2]);
    let along = above * (ur - ul) + t * (dr - dl);
    let down = left * (dl - ul) + s * (dr - ur);
    (radiance, [along, down, (dr - dl) - (ur - ul)])
}

impl Quadrants {
    pub(super) fn new(environment: &Environment, scale: f64) -> Self {
        let size = [environment.height() as f64 * scale, environment.width() as f64 * scale];
        let (dtheta, dphi) = (PI / size[0], TAU / size[1]);
        let rotation_rad = environment.rotation_deg().to_radians();
        Self { size, rotation_rad, dtheta, dphi, half: sin_cos(0.5 * dtheta).0, side: 1.0 / scale }
    }

    pub(super) fn row(&self, row: f64) -> Middle {
        let place = (row + 0.5) / self.size[0];
        let (sin, cos) = sin_cos(PI * place);
        Middle { place, sin, cos }
    }

    pub(super) fn column(&self, column: f64) -> Middle {
        let place = (column + 0.5) / self.size[1];
        let (sin, cos) = sin_cos(TAU * place - self.rotation_rad);
        Middle { place, sin, cos }
    }

    /// The light of the rectangles of two rows and columns from these on.
    pub(super) fn quad(&self, environment: &Environment, row: u32, column: u32) -> Quad {
        let rows = [row, row + 1].map(|row| self.row(f64::from(row)));
        let columns = [column, column + 1].map(|column| self.column(f64::from(column)));
        let mut lists = [[0.0; LONGEST_REGISTER]; SUB_TEXEL];
        for k in 0..4 {
            let (row, column) = (rows[k / 2], columns[k % 2]);
            let (corners, [s, t]) = environment.corners([column.place, row.place]);
            let corners = corners.iter().flat_map(|corner| corner[..3].iter().map(|x| f64::from(*x)));
            let numbers = corners.chain([s, t, row.sin, row.cos, column.sin, column.cos]);
            numbers.zip(&mut lists).for_each(|(number, list)| list[k] = number);
        }
        let mut nodes = [[0.0; LONGEST_REGISTER]; NUMBERS];
        dispatch(SubTexels { quadrants: self, lists: &lists, nodes: &mut nodes });
        let mut quad = Quad::default();
        (0..4).for_each(|k| quad.set(k, |number| nodes[number][k]));
        quad
    }

    /// The light of rectangles, from sine and cosine of the angles of their rows and columns.
    ///
    /// Over a square of side 1 around 0 the density `1 + a s + b t + c s t` has the mean (a, b)/12, the mean squares 1/12 and the mean
    /// product c/144. Here `a`, `b`, `c` are the changes of the bilinear radiance over the rectangle, relative to its middle, and `b`
    /// holds that of sin(theta) too.
    #[inline(always)]
    pub(super) fn moments<V: Vector>(
        &self,
        row: [Lanes<V>; 2],
        column: [Lanes<V>; 2],
        (radiance, slopes): Light<V>,
    ) -> Moments<V> {
        let Self { dtheta, dphi, half, side, .. } = *self;
        let zero = Lanes::splat_like(row[0], 0.0);
        // Exact: integral of sin(theta) over the row is 2 sin(middle) sin(dtheta / 2).
        let solid_angle = row[0] * (dphi * 2.0 * half);
        let sum = radiance[0] + radiance[1] + radiance[2];
        // Slopes per texel become changes over the rectangle, relative to the radiance.
        let relative = zero.if_less(sum, Lanes::splat_like(sum, side) / sum.positive(), zero);
        let [a, b, c] = slopes;
        let [a, b, c] = [a * relative, b * relative, c * relative];
        let (s, t) = (a * (1.0 / 12.0), (b + row[1] / row[0] * dtheta) * (1.0 / 12.0));
        let ([sin_theta, cos_theta], [sin_phi, cos_phi]) = (turned(row, t * dtheta), turned(column, s * dphi));
        let centroid = [sin_theta * sin_phi, cos_theta, zero - sin_theta * cos_phi];

        let width = row[0] * dphi;
        let east = [cos_phi, zero, sin_phi];
        let south = cross(centroid, east);
        let twelfth = Lanes::splat_like(zero, 1.0 / 12.0);
        let mixed = width * dtheta * (c * (side / 144.0) - s * t);
        let spread = Symmetric::square(east) * (width * width * (twelfth - s * s))
            + Symmetric::square(south) * ((twelfth - t * t) * (dtheta * dtheta))
            + Symmetric::product(east, south) * mixed;
        // Rows widen towards the equator: take the wider edge. The centroid lies within 2/9 of the sides of the middle (a rectangle at
        // a pole, whose density grows away from it and towards a bright texel).
        let wider = width + dtheta * dphi;
        let radius = (wider * wider + dtheta * dtheta).sqrt() * (0.5 + 2.0 / 9.0);
        let energy = [radiance[0] * solid_angle, radiance[1] * solid_angle, radiance[2] * solid_angle];
        Moments { energy, centroid, spread, radius }
    }
}

/// Sine and cosine of an angle plus a small one: of less than a radian, with an error of its ninth power / 9!.
#[inline(always)]
fn turned<V: Vector>([sin, cos]: [Lanes<V>; 2], by: Lanes<V>) -> [Lanes<V>; 2] {
    let one = Lanes::splat_like(by, 1.0);
    let x = by * by;
    let sin_by = by * (one - x * (1.0 / 6.0) * (one - x * (1.0 / 20.0) * (one - x * (1.0 / 42.0))));
    let cos_by = one - x * 0.5 * (one - x * (1.0 / 12.0) * (one - x * (1.0 / 30.0) * (one - x * (1.0 / 56.0))));
    [sin * cos_by + cos * sin_by, cos * cos_by - sin * sin_by]
}

/// Numbers on which the light of a rectangle within a bilinear patch depends: three channels of four corners, the place between them,
/// sine and cosine of the angles of its row and column.
const SUB_TEXEL: usize = 18;

/// The nodes of four rectangles.
struct SubTexels<'a> {
    quadrants: &'a Quadrants,
    lists: &'a [[f64; LONGEST_REGISTER]; SUB_TEXEL],
    nodes: &'a mut [[f64; LONGEST_REGISTER]; NUMBERS],
}

impl WithSimd for SubTexels<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        const { assert!(LONGEST_REGISTER.is_multiple_of(S::F64_LANES), "lists are padded to whole registers") };
        let lists = self.lists.each_ref().map(|list| S::as_simd_f64s(list).0);
        let mut nodes = self.nodes.each_mut().map(|list| S::as_mut_simd_f64s(list).0);
        for k in 0..4_usize.div_ceil(S::F64_LANES) {
            let corners = [
                load3(simd, &lists[0..3], k),
                load3(simd, &lists[3..6], k),
                load3(simd, &lists[6..9], k),
                load3(simd, &lists[9..12], k),
            ];
            let light =
                bilinear(corners, Lanes::new(Double(simd), lists[12][k]), Lanes::new(Double(simd), lists[13][k]));
            let row = [Lanes::new(Double(simd), lists[14][k]), Lanes::new(Double(simd), lists[15][k])];
            let column = [Lanes::new(Double(simd), lists[16][k]), Lanes::new(Double(simd), lists[17][k])];
            store(&self.quadrants.moments(row, column, light).node(), &mut nodes, k);
        }
    }
}

#[inline(always)]
pub(super) fn load3<S: Simd>(simd: S, lists: &[&[S::f64s]], k: usize) -> Lanes3<Double<S>> {
    [
        Lanes::new(Double(simd), lists[0][k]),
        Lanes::new(Double(simd), lists[1][k]),
        Lanes::new(Double(simd), lists[2][k]),
    ]
}

#[inline(always)]
pub(super) fn store<S: Simd>(node: &NodeLanes<Double<S>>, lists: &mut [&mut [S::f64s]; NUMBERS], k: usize) {
    for number in 0..NUMBERS {
        lists[number][k] = node[number].value;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{image::Image, math::Rgb};
    use pulp::Scalar;

    #[test]
    fn slopes_are_those_of_the_bilinear_function() {
        const STEP: f64 = 1e-3; // texels; differences are exact inside a cell, because the function is bilinear there
        let texel = |k: usize| [(k * 7 % 11) as f32, (k * 5 % 13) as f32, 0.5];
        let map = Environment::new(Image::from_pixels(8, 4, (0..32).map(texel).collect())).unwrap().rotated(30.0);
        let (width, height) = (map.width() as f64, map.height() as f64);
        let lane = |x: f64| Lanes::splat(Double(Scalar), x);
        let light = |x: f64, y: f64| {
            let (corners, [s, t]) = map.corners([x / width, y / height]);
            let corners = corners.map(|[r, g, b, _]| [*r, *g, *b].map(|x| lane(f64::from(x))));
            let (radiance, slopes) = bilinear(corners, lane(s), lane(t));
            (radiance.map(|x| x.value), slopes.map(|x| x.value))
        };
        let sum = |x: f64, y: f64| light(x, y).0.iter().sum::<f64>();
        for (x, y) in [(2.2, 1.3), (0.1, 2.9), (3.95, 0.2), (7.8, 3.7)] {
            let (radiance, [along, down, mixed]) = light(x, y);
            assert!((Rgb::from(radiance) - map.radiance_at(x / width, y / height)).length() < 1e-12);
            let difference = |a: f64, b: f64| (a - b) / (2.0 * STEP);
            assert!((along - difference(sum(x + STEP, y), sum(x - STEP, y))).abs() < 1e-9);
            assert!((down - difference(sum(x, y + STEP), sum(x, y - STEP))).abs() < 1e-9);
            let down_at = |x: f64| difference(sum(x, y + STEP), sum(x, y - STEP));
            assert!((mixed - difference(down_at(x + STEP), down_at(x - STEP))).abs() < 1e-6);
        }
    }
}
