//! The angles between light, view, normal and half vector, computed without cancellation.

use crate::math::{Vec3, elementary::fifth_power};

/// Cosines of one pair of directions at one surface point.
///
/// `sin2_h` comes from a cross product: for the sharpest lobes (alpha = 0.005) `1 - cos_h^2` would lose most of its digits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Angles {
    /// `n . l`, light; may be negative.
    pub cos_i: f64,
    /// `n . v`, view.
    pub cos_o: f64,
    /// `n . h`.
    pub cos_h: f64,
    /// `1 - (n . h)^2`.
    pub sin2_h: f64,
    /// `v . h = l . h`.
    pub cos_d: f64,
}

impl Angles {
    /// From unit vectors: normal, light direction, view direction.
    #[must_use]
    #[inline]
    pub fn new(normal: Vec3, wi: Vec3, wo: Vec3) -> Self {
        let half = wi + wo;
        let length2 = half.length_squared().max(f64::MIN_POSITIVE);
        let cross = normal.cross(half);
        Self {
            cos_i: normal.dot(wi),
            cos_o: normal.dot(wo),
            cos_h: normal.dot(half) / length2.sqrt(),
            sin2_h: cross.length_squared() / length2,
            cos_d: 0.5 * length2.sqrt(),
        }
    }

    /// Schlick's `F5 = (1 - v.h)^5`.
    #[must_use]
    #[inline]
    pub fn f5(&self) -> f64 {
        fifth_power((1.0 - self.cos_d).max(0.0))
    }
}
