//! Sums of light that keep its energy, mean direction and spread.

use super::blur::tangents;
use crate::math::{
    lanes::{Lanes, Lanes3, Vector, dot},
    to_f32,
};
use std::ops::{Add, Mul};

/// Four nodes: for each of their [numbers](NodeLanes) a list. A node that is not there has no energy.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Quad(pub(super) [[f32; 4]; NUMBERS]);

impl Quad {
    /// Sets one of its nodes from the numbers that `number` returns.
    #[inline]
    pub(super) fn set(&mut self, k: usize, number: impl Fn(usize) -> f64) {
        self.0.iter_mut().enumerate().for_each(|(n, list)| list[k] = to_f32(number(n)));
    }

    /// The numbers of one of its nodes.
    #[inline]
    pub(super) fn numbers(&self, k: usize) -> [f32; NUMBERS] {
        self.0.map(|list| list[k])
    }
}

/// The light of regions of directions, one in each lane.
#[derive(Debug, Clone, Copy)]
pub(super) struct Moments<V: Vector> {
    /// Radiance integrated over solid angle, linear Rec. 709.
    pub(super) energy: Lanes3<V>,
    /// Energy-weighted mean direction, of unit length.
    pub(super) centroid: Lanes3<V>,
    /// Energy-weighted mean of `(x - c)(x - c)^T` over the directions `x`, `c` the centroid.
    pub(super) spread: Symmetric<V>,
    /// Largest distance of a direction from the centroid, as a chord.
    pub(super) radius: Lanes<V>,
}

/// A symmetric matrix in each lane: xx, yy, zz, xy, xz, yz.
#[derive(Debug, Clone, Copy)]
pub(super) struct Symmetric<V: Vector>([Lanes<V>; 6]);

/// A node of the pyramid in each lane, light from around a point:
/// - its energy, radiance integrated over solid angle, linear Rec. 709 (three numbers);
/// - the energy-weighted mean direction, normalised, world space (three);
/// - the energy-weighted covariance of the directions about it, in the tangent plane there: along the first axis of
///   [`Frame::from_normal`](crate::math::frame::Frame::from_normal), mixed, along the second; square chords of the unit sphere (three);
/// - the largest distance of a direction of the node from the mean, as a chord.
pub(super) type NodeLanes<V> = [Lanes<V>; NUMBERS];

/// Count of a node's numbers.
pub(super) const NUMBERS: usize = 10;

impl<V: Vector> Moments<V> {
    /// The sum: energies add, the centroid is their energy-weighted mean, spreads add by the parallel axis theorem. `present` is 0 in lanes
    /// in which a part is missing, else 1; the first part is never missing.
    #[inline(always)]
    pub(super) fn join(parts: &[Self; 4], present: [Lanes<V>; 4]) -> Self {
        let [p, q, r, s] = parts;
        let zero = Lanes::splat_like(p.radius, 0.0);
        let weights = [p.weight(), q.weight(), r.weight(), s.weight()];
        let total = weights[0] + weights[1] + weights[2] + weights[3];
        // A region without energy still has a centroid and a spread.
        let of_total = total.positive().inverse();
        let of_count = (present[0] + present[1] + present[2] + present[3]).inverse();
        let shares = [
            zero.if_less(total, weights[0] * of_total, present[0] * of_count),
            zero.if_less(total, weights[1] * of_total, present[1] * of_count),
            zero.if_less(total, weights[2] * of_total, present[2] * of_count),
            zero.if_less(total, weights[3] * of_total, present[3] * of_count),
        ];
        let mean = [
            mix([p.centroid[0], q.centroid[0], r.centroid[0], s.centroid[0]], shares),
            mix([p.centroid[1], q.centroid[1], r.centroid[1], s.centroid[1]], shares),
            mix([p.centroid[2], q.centroid[2], r.centroid[2], s.centroid[2]], shares),
        ];
        let length2 = dot(mean, mean);
        let inverse = length2.positive().sqrt().inverse();
        let centroid = [
            zero.if_less(length2, mean[0] * inverse, p.centroid[0]),
            zero.if_less(length2, mean[1] * inverse, p.centroid[1]),
            zero.if_less(length2, mean[2] * inverse, p.centroid[2]),
        ];
        let (mut spread, mut radius) = (Symmetric([zero; 6]), zero);
        for k in 0..4 {
            let part = &parts[k];
            let offset =
                [part.centroid[0] - centroid[0], part.centroid[1] - centroid[1], part.centroid[2] - centroid[2]];
            spread = spread + (part.spread + Symmetric::square(offset)) * shares[k];
            let reach = (dot(offset, offset).sqrt() + part.radius) * present[k];
            radius = radius.if_less(reach, reach, radius);
        }
        let energy = [
            p.energy[0] + q.energy[0] + r.energy[0] + s.energy[0],
            p.energy[1] + q.energy[1] + r.energy[1] + s.energy[1],
            p.energy[2] + q.energy[2] + r.energy[2] + s.energy[2],
        ];
        Self { energy, centroid, spread, radius }
    }

    /// The weight of a region in a mean: its energy, summed over the channels.
    #[inline(always)]
    fn weight(&self) -> Lanes<V> {
        self.energy[0] + self.energy[1] + self.energy[2]
    }

    /// The nodes of the pyramid.
    #[inline(always)]
    pub(super) fn node(&self) -> NodeLanes<V> {
        let [tangent, bitangent] = tangents(self.centroid);
        let along = self.spread.times(tangent);
        let [a, b, c] = [dot(tangent, along), dot(bitangent, along), dot(bitangent, self.spread.times(bitangent))];
        let ([red, green, blue], [x, y, z]) = (self.energy, self.centroid);
        [red, green, blue, x, y, z, a, b, c, self.radius]
    }

    /// The light of nodes of the pyramid.
    #[inline(always)]
    pub(super) fn of_node([red, green, blue, x, y, z, a, b, c, radius]: NodeLanes<V>) -> Self {
        let centroid = [x, y, z];
        let [tangent, bitangent] = tangents(centroid);
        let spread = Symmetric::square(tangent) * a
            + Symmetric::product(tangent, bitangent) * b
            + Symmetric::square(bitangent) * c;
        Self { energy: [red, green, blue], centroid, spread, radius }
    }
}

/// A weighted sum.
#[inline(always)]
pub(super) fn mix<V: Vector>(values: [Lanes<V>; 4], shares: [Lanes<V>; 4]) -> Lanes<V> {
    values[0] * shares[0] + values[1] * shares[1] + values[2] * shares[2] + values[3] * shares[3]
}

impl<V: Vector> Symmetric<V> {
    /// `v v^T`.
    #[inline(always)]
    pub(super) fn square([x, y, z]: Lanes3<V>) -> Self {
        Self([x * x, y * y, z * z, x * y, x * z, y * z])
    }

    /// `a b^T + b a^T`.
    #[inline(always)]
    pub(super) fn product(a: Lanes3<V>, b: Lanes3<V>) -> Self {
        Self([
            a[0] * b[0] * 2.0,
            a[1] * b[1] * 2.0,
            a[2] * b[2] * 2.0,
            a[0] * b[1] + b[0] * a[1],
            a[0] * b[2] + b[0] * a[2],
            a[1] * b[2] + b[1] * a[2],
        ])
    }

    #[inline(always)]
    fn times(&self, v: Lanes3<V>) -> Lanes3<V> {
        let [xx, yy, zz, xy, xz, yz] = self.0;
        [dot([xx, xy, xz], v), dot([xy, yy, yz], v), dot([xz, yz, zz], v)]
    }
}

impl<V: Vector> Add for Symmetric<V> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        let ([a, b, c, d, e, f], [u, v, w, x, y, z]) = (self.0, other.0);
        Self([a + u, b + v, c + w, d + x, e + y, f + z])
    }
}

impl<V: Vector> Mul<Lanes<V>> for Symmetric<V> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, scale: Lanes<V>) -> Self {
        let [a, b, c, d, e, f] = self.0;
        Self([a * scale, b * scale, c * scale, d * scale, e * scale, f * scale])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Vec3, frame::Frame, lanes::Double};
    use pulp::Scalar;

    #[test]
    fn a_node_keeps_what_moments_say_of_the_tangent_plane() {
        let lane = |x: f64| Lanes::splat(Double(Scalar), x);
        let lanes = |v: Vec3| [v.x, v.y, v.z].map(lane);
        let centroid = Vec3::new(0.48, 0.6, -0.64);
        let Frame { tangent, bitangent, .. } = Frame::from_normal(centroid);
        let spread = Symmetric::square(lanes(tangent * 0.3 + bitangent * 0.1))
            + Symmetric::product(lanes(tangent), lanes(bitangent)) * lane(0.02);
        let energy = lanes(Vec3::new(1.0, 2.0, 3.0));
        let node = Moments { energy, centroid: lanes(centroid), spread, radius: lane(0.5) }.node();
        for (found, expected) in node[6..9].iter().zip([0.09, 0.05, 0.01]) {
            assert!((found.value - expected).abs() < 1e-12, "{} {expected}", found.value);
        }
        for (again, node) in Moments::of_node(node).node().iter().zip(&node) {
            assert!((again.value - node.value).abs() < 1e-12);
        }
    }
}
