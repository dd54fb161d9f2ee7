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

use super::{
    point::{Point, Turn},
    pyramid::Node,
};
use crate::math::{
    Vec3,
    lanes::{Lanes, Lanes3, cross, dot},
    simd::dispatch,
};
use pulp::{Simd, WithSimd};

/// Lower limit of `v.h`: as light approaches the direction opposite to the view, a small step of it turns the half vector without
/// bound.
pub(super) const LEAST_COS_D: f64 = 0.05;

/// Nodes as one list for each of their numbers, padded to whole registers.
#[derive(Debug, Default)]
pub(super) struct NodeLists {
    centroid: [Vec<f64>; 3],
    covariance: [Vec<f64>; 3],
    radius: Vec<f64>,
}

/// How a surface point sees them: their angles and the effect of their spread, one list each.
#[derive(Debug, Default)]
pub(super) struct SeenLists {
    /// 0 for a node that is below the horizon.
    pub(super) cos_i: Vec<f64>,
    pub(super) cos_h: Vec<f64>,
    pub(super) sin2_h: Vec<f64>,
    pub(super) cos_d: Vec<f64>,
    pub(super) du: Vec<f64>,
    pub(super) du2: Vec<f64>,
}

impl NodeLists {
    /// Replaces the nodes.
    pub(super) fn set(&mut self, nodes: &[Node]) {
        let padded = nodes.len().next_multiple_of(LONGEST_REGISTER);
        let fill = |list: &mut Vec<f64>, of: &dyn Fn(&Node) -> f32| {
            list.clear();
            list.extend(nodes.iter().map(|node| f64::from(of(node))));
            list.resize(padded, 0.0);
        };
        for axis in 0..3 {
            fill(&mut self.centroid[axis], &|node| node.centroid[axis]);
            fill(&mut self.covariance[axis], &|node| node.covariance[axis]);
        }
        fill(&mut self.radius, &|node| node.radius);
    }

    /// The nodes as light at a surface point.
    pub(super) fn seen_from(&self, point: &Point, seen: &mut SeenLists) {
        let SeenLists { cos_i, cos_h, sin2_h, cos_d, du, du2 } = seen;
        for list in [cos_i, cos_h, sin2_h, cos_d, du, du2] {
            list.resize(self.radius.len(), 0.0);
        }
        dispatch(Pass { nodes: self, point, seen });
    }
}

/// `f64` lanes of the longest register that `pulp` uses.
const LONGEST_REGISTER: usize = 8;

struct Pass<'a> {
    nodes: &'a NodeLists,
    point: &'a Point,
    seen: &'a mut SeenLists,
}

impl WithSimd for Pass<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        const { assert!(LONGEST_REGISTER.is_multiple_of(S::F64_LANES), "lists are padded to whole registers") };
        let NodeLists { centroid, covariance, radius } = self.nodes;
        let [x, y, z] = centroid.each_ref().map(|list| S::as_simd_f64s(list).0);
        let [a, b, c] = covariance.each_ref().map(|list| S::as_simd_f64s(list).0);
        let radius = S::as_simd_f64s(radius).0;
        let SeenLists { cos_i, cos_h, sin2_h, cos_d, du, du2 } = self.seen;
        let [cos_i, cos_h, sin2_h, cos_d, du, du2] =
            [cos_i, cos_h, sin2_h, cos_d, du, du2].map(|list| S::as_mut_simd_f64s(list).0);
        let (normal, view) = (splat(simd, self.point.normal), splat(simd, self.point.view));
        let extent = Extent::new(simd, self.point);
        for k in 0..radius.len() {
            let node = Block {
                centroid: [Lanes::new(simd, x[k]), Lanes::new(simd, y[k]), Lanes::new(simd, z[k])],
                covariance: [Lanes::new(simd, a[k]), Lanes::new(simd, b[k]), Lanes::new(simd, c[k])],
                radius: Lanes::new(simd, radius[k]),
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
fn splat<S: Simd>(simd: S, v: Vec3) -> Lanes3<S> {
    [Lanes::splat(simd, v.x), Lanes::splat(simd, v.y), Lanes::splat(simd, v.z)]
}

/// As many nodes as a register has lanes.
struct Block<S: Simd> {
    centroid: Lanes3<S>,
    covariance: Lanes3<S>,
    radius: Lanes<S>,
}

impl<S: Simd> Block<S> {
    /// `cos_i`, `cos_h`, `sin2_h`, `cos_d`, `du` and `du2` at a surface point.
    #[inline(always)]
    fn seen_from(&self, normal: Lanes3<S>, view: Lanes3<S>, extent: Option<&Extent<S>>) -> [Lanes<S>; 6] {
        let centre = self.centroid;
        let half = [centre[0] + view[0], centre[1] + view[1], centre[2] + view[2]];
        let length2 = dot(half, half).max(f64::MIN_POSITIVE);
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
struct Extent<S: Simd> {
    sides: [Side<S>; 2],
}

/// The turn along one side: `t` of the normal, `s` of the view.
struct Side<S: Simd> {
    normal: Lanes3<S>,
    view: Lanes3<S>,
    /// `n.s`, `|t|^2`, `|s|^2` and `t.s`.
    products: [f64; 4],
}

impl<S: Simd> Extent<S> {
    /// `None` for a point without extent.
    #[inline(always)]
    fn new(simd: S, point: &Point) -> Option<Self> {
        if point.turn == Turn::default() {
            return None;
        }
        Some(Self { sides: [Side::new(simd, point, 0), Side::new(simd, point, 1)] })
    }

    /// Mean and mean square change of `sin2_h`; `half` is not normalised, `inverse` is 1 over its length.
    #[inline(always)]
    fn changes(&self, half: Lanes3<S>, inverse: Lanes<S>, cos_h: Lanes<S>, cos2: Lanes<S>) -> (Lanes<S>, Lanes<S>) {
        let scale = inverse.min(Lanes::splat_like(inverse, 0.5 / LEAST_COS_D));
        let [a, b] = &self.sides;
        let (a, b) = (a.changes(half, inverse, scale, cos_h, cos2), b.changes(half, inverse, scale, cos_h, cos2));
        (a.0 + b.0, (a.1 + b.1) * cos2 * 4.0)
    }
}

impl<S: Simd> Side<S> {
    #[inline(always)]
    fn new(simd: S, point: &Point, side: usize) -> Self {
        let (normal, view) = (point.turn.normal[side], point.turn.view[side]);
        let products = [point.normal.dot(view), normal.length_squared(), view.length_squared(), normal.dot(view)];
        Self { normal: splat(simd, normal), view: splat(simd, view), products }
    }

    /// Mean change of `sin2_h` and mean square change of `cos_h`.
    #[inline(always)]
    fn changes(
        &self,
        half: Lanes3<S>,
        inverse: Lanes<S>,
        scale: Lanes<S>,
        cos_h: Lanes<S>,
        cos2: Lanes<S>,
    ) -> (Lanes<S>, Lanes<S>) {
        let [n_s, t2, s2, t_s] = self.products.map(|product| Lanes::splat_like(inverse, product));
        let (t_h, s_h) = (dot(self.normal, half) * inverse, dot(self.view, half) * inverse);
        let change = t_h + (n_s - cos_h * s_h) * scale;
        let change2 = change * change;
        let of_half2 = (s2 - s_h * s_h) * scale * scale;
        (cos2 * (t2 + of_half2) - cos_h * (t_s - t_h * s_h) * scale * 2.0 - change2, change2)
    }
}

/// Lower limit of `2 v.h` for the place of the half vector in the tangent plane.
const LEAST_LENGTH: f64 = 2e-9;

/// A vector along two tangents.
#[inline(always)]
fn flat<S: Simd>(v: Lanes3<S>, tangents: [Lanes3<S>; 2]) -> [Lanes<S>; 2] {
    [dot(v, tangents[0]), dot(v, tangents[1])]
}

/// The bilinear form of a covariance.
#[inline(always)]
fn form<S: Simd>([a, b, c]: Lanes3<S>, v: [Lanes<S>; 2], w: [Lanes<S>; 2]) -> Lanes<S> {
    a * v[0] * w[0] + b * (v[0] * w[1] + v[1] * w[0]) + c * v[1] * w[1]
}

/// The tangents of [`Frame::from_normal`](crate::math::frame::Frame::from_normal).
#[inline(always)]
fn tangents<S: Simd>([x, y, z]: Lanes3<S>) -> [Lanes3<S>; 2] {
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
fn above_horizon<S: Simd>(cos_i: Lanes<S>, variance: Lanes<S>, radius: Lanes<S>) -> Lanes<S> {
    // Rounding may make a variance of 0 negative.
    let reach = (variance.max(0.0) * 3.0).sqrt().min(radius);
    let (zero, above) = (Lanes::splat_like(reach, 0.0), cos_i + reach);
    let partly = above * above / (reach.max(f64::MIN_POSITIVE) * 4.0);
    zero.if_less(above, cos_i.if_less(reach, partly, cos_i), zero)
}

#[cfg(test)]
mod tests;
