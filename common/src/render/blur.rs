//! The light of a pyramid node at a surface point: angles at the node's centroid, and a correction for its spread.
//!
//! Let `x` be the light's offset from the centroid `c` in the tangent plane there, of mean 0 and covariance `S`, and `L = 2 v.h`. To
//! second order the half vector `h = (l + v)/|l + v|`, `l = c + x - c |x|^2/2`, moves along a unit vector `r` across it by
//!
//! `r.x/L - (r.c)|x|^2/(2L) - (r.x)(h.x)/L^2`,
//!
//! and, with `r sin(th) = n - (n.h) h =: q` and `p` the step of the half vector, `u = 1 - (n.h)^2` changes by
//!
//! `-2 (n.h) q.p - (q.p)^2 + (n.h)^2 |p|^2`.
//!
//! The means of both follow from three quadratic forms of `S`.
//!
//! A point may stand for a part of a pixel, over which normal and view [turn](super::point::Turn), independently of the light's spread. A
//! turn `t` of the normal and `s` of the view turns the half vector by `g = (s - (h.s) h)/L` and changes `n.h` by `a = t.h + n.g`. As `n` and
//! `h` stay unit vectors, `u` changes by `(n.h)^2 (|t|^2 + |g|^2) - 2 (n.h) t.g - a^2`, and its mean square change is `4 (n.h)^2 a^2`.

use super::point::{Point, Turn};
use crate::brdf::{BLOCK, Lights};
use crate::math::{
    Vec3,
    lanes::{Lanes, Lanes3, Single, Vector, cross, dot},
    simd::dispatch,
};
use pulp::{Simd, WithSimd};

/// Lower limit of `v.h`: as light approaches the direction opposite to the view, a small step of it turns the half vector without
/// bound.
pub(super) const LEAST_COS_D: f64 = 0.05;

/// Nodes as one list for each of their numbers but their energies, padded to whole registers.
#[derive(Debug, Default)]
pub(super) struct NodeLists {
    pub(super) centroid: [Vec<f32>; 3],
    pub(super) covariance: [Vec<f32>; 3],
    pub(super) radius: Vec<f32>,
}

impl NodeLists {
    /// Replaces the angles and spreads of `lights` by those of the nodes seen from a surface point.
    pub(super) fn seen_from(&self, point: &Point, lights: &mut Lights) {
        let Lights { cos_i, cos_h, sin2_h, cos_d, du, du2, .. } = lights;
        for list in [cos_i, cos_h, sin2_h, cos_d, du, du2] {
            list.resize(self.radius.len(), 0.0);
        }
        dispatch(Pass { nodes: self, point, lights });
    }
}

struct Pass<'a> {
    nodes: &'a NodeLists,
    point: &'a Point,
    lights: &'a mut Lights,
}

impl WithSimd for Pass<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        const { assert!(BLOCK.is_multiple_of(S::F32_LANES), "lists are padded to whole registers") };
        let vector = Single(simd);
        let NodeLists { centroid, covariance, radius } = self.nodes;
        let [x, y, z] = centroid.each_ref().map(|list| S::as_simd_f32s(list).0);
        let [a, b, c] = covariance.each_ref().map(|list| S::as_simd_f32s(list).0);
        let radius = S::as_simd_f32s(radius).0;
        let Lights { cos_i, cos_h, sin2_h, cos_d, du, du2, .. } = self.lights;
        let [cos_i, cos_h, sin2_h, cos_d, du, du2] =
            [cos_i, cos_h, sin2_h, cos_d, du, du2].map(|list| S::as_mut_simd_f32s(list).0);
        let (normal, view) = (splat(vector, self.point.normal), splat(vector, self.point.view));
        let extent = Extent::new(vector, self.point);
        for k in 0..radius.len() {
            let node = Block {
                centroid: [Lanes::new(vector, x[k]), Lanes::new(vector, y[k]), Lanes::new(vector, z[k])],
                covariance: [Lanes::new(vector, a[k]), Lanes::new(vector, b[k]), Lanes::new(vector, c[k])],
                radius: Lanes::new(vector, radius[k]),
            };
            let seen = node.seen_from(normal, view, extent.as_ref());
            cos_i[k] = seen[0].value;
            cos_h[k] = seen[1].value;
            sin2_h[k] = seen[2].value;
            cos_d[k] = seen[3].value;
            du[k] = seen[4].value;
            du2[k] = seen[5].value;
        }
    }
}

#[inline(always)]
pub(super) fn splat<V: Vector>(vector: V, v: Vec3) -> Lanes3<V> {
    [Lanes::splat(vector, v.x), Lanes::splat(vector, v.y), Lanes::splat(vector, v.z)]
}

/// As many nodes as a register has lanes.
struct Block<V: Vector> {
    centroid: Lanes3<V>,
    covariance: Lanes3<V>,
    radius: Lanes<V>,
}

impl<V: Vector> Block<V> {
    /// `cos_i`, `cos_h`, `sin2_h`, `cos_d`, `du` and `du2` at a surface point.
    #[inline(always)]
    fn seen_from(&self, normal: Lanes3<V>, view: Lanes3<V>, extent: Option<&Extent<V>>) -> [Lanes<V>; 6] {
        let centre = self.centroid;
        let half = [centre[0] + view[0], centre[1] + view[1], centre[2] + view[2]];
        let length2 = dot(half, half).positive();
        // `1/|l + v|`, which is also `1/(2 v.h)`.
        let inverse = length2.sqrt().inverse();
        let across = cross(normal, half);
        let centroid_cos_i = dot(normal, centre);
        let cos_h = dot(normal, half) * inverse;
        let sin2_h = dot(across, across) * (inverse * inverse);
        let cos_d = length2 * inverse * 0.5;

        let cos2 = Lanes::splat_like(sin2_h, 1.0) - sin2_h;
        let (of_extent, of_extent2) = match extent {
            Some(extent) => extent.changes(half, inverse, cos_h, cos2),
            None => (Lanes::splat_like(cos2, 0.0), Lanes::splat_like(cos2, 0.0)),
        };

        let tangents = tangents(centre);
        let (normal, view) = (flat(normal, tangents), flat(view, tangents));
        let spread = self.covariance;
        let light2 = spread[0] + spread[2];
        // The mean of the node's directions is shorter than 1 by exactly half their mean square chord from the centroid.
        let shorter = Lanes::splat_like(light2, 1.0) - light2 * 0.5;
        let cos_i = above_horizon(centroid_cos_i, form(spread, normal, normal), self.radius) * shorter;
        // `h` and `q` in the tangent plane, in which the centroid has no component. Light opposite to the view has no half vector.
        let inverse_length = inverse.min(Lanes::splat_like(light2, 1.0 / LEAST_LENGTH));
        let half = [view[0] * inverse_length, view[1] * inverse_length];
        let offset = [normal[0] - cos_h * half[0], normal[1] - cos_h * half[1]];
        let scale = inverse.min(Lanes::splat_like(light2, 0.5 / LEAST_COS_D));
        let scale2 = scale * scale;
        let along2 = form(spread, offset, offset) * scale2;
        let step2 = (light2 - form(spread, half, half)) * scale2;
        let bend = (centroid_cos_i - cos_h * cos_d) * 0.5 * light2 * scale + form(spread, offset, half) * scale2;
        let du = cos_h * bend * 2.0 + cos2 * step2 - along2 + of_extent;
        [cos_i, cos_h, sin2_h, cos_d, du, cos2 * along2 * 4.0 + of_extent2]
    }
}

/// The [turn](super::point::Turn) of a point, the same in every lane.
struct Extent<V: Vector> {
    sides: [Side<V>; 2],
}

/// The turn along one side: `t` of the normal, `s` of the view.
struct Side<V: Vector> {
    normal: Lanes3<V>,
    view: Lanes3<V>,
    /// `n.s`, `|t|^2`, `|s|^2` and `t.s`.
    products: [f64; 4],
}

impl<V: Vector> Extent<V> {
    /// `None` for a point without extent.
    #[inline(always)]
    fn new(vector: V, point: &Point) -> Option<Self> {
        if point.turn == Turn::default() {
            return None;
        }
        Some(Self { sides: [Side::new(vector, point, 0), Side::new(vector, point, 1)] })
    }

    /// Mean and mean square change of `sin2_h`; `half` is not normalised, `inverse` is 1 over its length.
    #[inline(always)]
    fn changes(&self, half: Lanes3<V>, inverse: Lanes<V>, cos_h: Lanes<V>, cos2: Lanes<V>) -> (Lanes<V>, Lanes<V>) {
        let scale = inverse.min(Lanes::splat_like(inverse, 0.5 / LEAST_COS_D));
        let [a, b] = &self.sides;
        let (a, b) = (a.changes(half, inverse, scale, cos_h, cos2), b.changes(half, inverse, scale, cos_h, cos2));
        (a.0 + b.0, (a.1 + b.1) * cos2 * 4.0)
    }
}

impl<V: Vector> Side<V> {
    #[inline(always)]
    fn new(vector: V, point: &Point, side: usize) -> Self {
        let (normal, view) = (point.turn.normal[side], point.turn.view[side]);
        let products = [point.normal.dot(view), normal.length_squared(), view.length_squared(), normal.dot(view)];
        Self { normal: splat(vector, normal), view: splat(vector, view), products }
    }

    /// Mean change of `sin2_h` and mean square change of `cos_h`.
    #[inline(always)]
    fn changes(
        &self,
        half: Lanes3<V>,
        inverse: Lanes<V>,
        scale: Lanes<V>,
        cos_h: Lanes<V>,
        cos2: Lanes<V>,
    ) -> (Lanes<V>, Lanes<V>) {
        let [n_s, t2, s2, t_s] = self.products.map(|product| Lanes::splat_like(inverse, product));
        let (t_h, s_h) = (dot(self.normal, half) * inverse, dot(self.view, half) * inverse);
        let change = t_h + (n_s - cos_h * s_h) * scale;
        let change2 = change * change;
        let of_half2 = (s2 - s_h * s_h) * scale * scale;
        (cos2 * (t2 + of_half2) - cos_h * (t_s - t_h * s_h) * scale * 2.0 - change2, change2)
    }
}

/// Lower limit of `2 v.h` for the place of the half vector in the tangent plane, ten times the rounding of directions.
const LEAST_LENGTH: f64 = 1e-6;

/// A vector along two tangents.
#[inline(always)]
fn flat<V: Vector>(v: Lanes3<V>, tangents: [Lanes3<V>; 2]) -> [Lanes<V>; 2] {
    [dot(v, tangents[0]), dot(v, tangents[1])]
}

/// The bilinear form of a covariance.
#[inline(always)]
fn form<V: Vector>([a, b, c]: Lanes3<V>, v: [Lanes<V>; 2], w: [Lanes<V>; 2]) -> Lanes<V> {
    a * v[0] * w[0] + b * (v[0] * w[1] + v[1] * w[0]) + c * v[1] * w[1]
}

/// The tangents of [`Frame::from_normal`](crate::math::frame::Frame::from_normal).
#[inline(always)]
pub(super) fn tangents<V: Vector>([x, y, z]: Lanes3<V>) -> [Lanes3<V>; 2] {
    let sign = z.signum();
    let minus_a = (sign + z).inverse();
    let zero = Lanes::splat_like(x, 0.0);
    let b = zero - x * y * minus_a;
    let one = Lanes::splat_like(x, 1.0);
    [[one - sign * x * x * minus_a, sign * b, zero - sign * x], [b, sign - y * y * minus_a, zero - y]]
}

/// Mean of `max(0, n.l)` over light of mean cosine `cos_i` and variance `variance`. The cosine is taken as uniformly distributed, no
/// farther than `radius` from its mean. Every lobe vanishes linearly at the horizon; without this mean, a node that crosses the horizon
/// would count fully or not at all.
#[inline(always)]
fn above_horizon<V: Vector>(cos_i: Lanes<V>, variance: Lanes<V>, radius: Lanes<V>) -> Lanes<V> {
    // Rounding may make a variance of 0 negative.
    let reach = (variance.max(0.0) * 3.0).sqrt().min(radius);
    let (zero, above) = (Lanes::splat_like(reach, 0.0), cos_i + reach);
    let partly = above * above / (reach.positive() * 4.0);
    zero.if_less(above, cos_i.if_less(reach, partly, cos_i), zero)
}

#[cfg(test)]
mod tests;
