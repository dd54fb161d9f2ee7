//! Sums of light that keep its energy, mean direction and spread.

use crate::math::{Vec3, frame::Frame, narrow, to_f32, widen};
use std::ops::{Add, Mul};

/// Light from one node of the pyramid: a point with a spread.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Node {
    /// Radiance integrated over solid angle, linear Rec. 709.
    pub energy: [f32; 3],
    /// Energy-weighted mean direction, normalised, world space.
    pub centroid: [f32; 3],
    /// Energy-weighted covariance of the directions about the centroid, in the tangent plane there: along the first axis of
    /// [`Frame::from_normal`], mixed, along the second; square chords of the unit sphere.
    pub covariance: [f32; 3],
    /// Largest distance of a point of the node from the centroid, as a chord.
    pub radius: f32,
}

impl Node {
    /// Energy-weighted mean square distance from the centroid, as a chord of the unit sphere.
    #[must_use]
    #[inline]
    pub fn spread2(&self) -> f64 {
        f64::from(self.covariance[0]) + f64::from(self.covariance[2])
    }
}

/// The light of a region of directions.
#[derive(Debug, Clone, Copy)]
pub(super) struct Moments {
    /// Radiance integrated over solid angle, linear Rec. 709.
    pub(super) energy: Vec3,
    /// Energy-weighted mean direction, of unit length.
    pub(super) centroid: Vec3,
    /// Energy-weighted mean of `(x - c)(x - c)^T` over the directions `x`, `c` the centroid.
    pub(super) spread: Symmetric,
    /// Largest distance of a direction from the centroid, as a chord.
    pub(super) radius: f64,
}

/// A symmetric matrix: xx, yy, zz, xy, xz, yz.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Symmetric([f64; 6]);

impl Moments {
    /// The sum: energies add, the centroid is their energy-weighted mean, spreads add by the parallel axis theorem.
    pub(super) fn join(parts: &[Self]) -> Self {
        let weight = |part: &Self| part.energy.element_sum();
        let total: f64 = parts.iter().map(weight).sum();
        // A region without energy still has a centroid and a spread.
        let share = |part: &Self| if total > 0.0 { weight(part) / total } else { 1.0 / parts.len() as f64 };
        let mean: Vec3 = parts.iter().map(|part| part.centroid * share(part)).sum();
        let centroid = mean.normalize_or(parts[0].centroid);
        let (mut energy, mut spread, mut radius) = (Vec3::ZERO, Symmetric([0.0; 6]), 0.0_f64);
        for part in parts {
            let offset = part.centroid - centroid;
            energy += part.energy;
            spread = spread + (part.spread + Symmetric::square(offset)) * share(part);
            radius = radius.max(offset.length() + part.radius);
        }
        Self { energy, centroid, spread, radius }
    }

    /// The node of the pyramid.
    pub(super) fn node(&self) -> Node {
        let Frame { tangent, bitangent, .. } = Frame::from_normal(self.centroid);
        let along = self.spread.times(tangent);
        let covariance = [tangent.dot(along), bitangent.dot(along), bitangent.dot(self.spread.times(bitangent))];
        Node {
            energy: narrow(self.energy),
            centroid: narrow(self.centroid),
            covariance: covariance.map(to_f32),
            radius: to_f32(self.radius),
        }
    }
}

impl From<&Node> for Moments {
    fn from(node: &Node) -> Self {
        let centroid = widen(node.centroid);
        let Frame { tangent, bitangent, .. } = Frame::from_normal(centroid);
        let [a, b, c] = node.covariance.map(f64::from);
        let spread = Symmetric::square(tangent) * a
            + Symmetric::product(tangent, bitangent) * b
            + Symmetric::square(bitangent) * c;
        Self { energy: widen(node.energy), centroid, spread, radius: f64::from(node.radius) }
    }
}

impl Symmetric {
    /// `v v^T`.
    pub(super) fn square(v: Vec3) -> Self {
        Self([v.x * v.x, v.y * v.y, v.z * v.z, v.x * v.y, v.x * v.z, v.y * v.z])
    }

    /// `a b^T + b a^T`.
    pub(super) fn product(a: Vec3, b: Vec3) -> Self {
        Self([
            2.0 * a.x * b.x,
            2.0 * a.y * b.y,
            2.0 * a.z * b.z,
            a.x * b.y + b.x * a.y,
            a.x * b.z + b.x * a.z,
            a.y * b.z + b.y * a.z,
        ])
    }

    fn times(&self, v: Vec3) -> Vec3 {
        let [xx, yy, zz, xy, xz, yz] = self.0;
        Vec3::new(xx * v.x + xy * v.y + xz * v.z, xy * v.x + yy * v.y + yz * v.z, xz * v.x + yz * v.y + zz * v.z)
    }
}

impl Add for Symmetric {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self(std::array::from_fn(|k| self.0[k] + other.0[k]))
    }
}

impl Mul<f64> for Symmetric {
    type Output = Self;

    fn mul(self, scale: f64) -> Self {
        Self(self.0.map(|x| x * scale))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_node_keeps_what_moments_say_of_the_tangent_plane() {
        let centroid = Vec3::new(0.48, 0.6, -0.64);
        let Frame { tangent, bitangent, .. } = Frame::from_normal(centroid);
        let spread = Symmetric::square(tangent * 0.3 + bitangent * 0.1) + Symmetric::product(tangent, bitangent) * 0.02;
        let node = Moments { energy: Vec3::new(1.0, 2.0, 3.0), centroid, spread, radius: 0.5 }.node();
        for (found, expected) in node.covariance.into_iter().zip([0.09, 0.05, 0.01]) {
            assert!((f64::from(found) - expected).abs() < 1e-8, "{found} {expected}");
        }
        assert_eq!(Moments::from(&node).node(), node);
    }
}
