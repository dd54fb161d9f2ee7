//! An orthonormal frame around a normal.
//!
//! Source: Duff et al., *Building an Orthonormal Basis, Revisited* (JCGT 6(1), 2017). The frame is continuous except
//! across z = 0, where the formula branches on the sign of z.

use super::Vec3;

/// A right-handed orthonormal frame whose third axis is the surface normal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// First tangent.
    pub tangent: Vec3,
    /// Second tangent.
    pub bitangent: Vec3,
    /// The normal.
    pub normal: Vec3,
}

impl Frame {
    /// The frame around a unit normal.
    #[must_use]
    pub fn from_normal(normal: Vec3) -> Self {
        let sign = 1.0_f64.copysign(normal.z);
        let a = -1.0 / (sign + normal.z);
        let b = normal.x * normal.y * a;
        Self {
            tangent: Vec3::new(1.0 + sign * normal.x * normal.x * a, sign * b, -sign * normal.x),
            bitangent: Vec3::new(b, sign + normal.y * normal.y * a, -normal.y),
            normal,
        }
    }

    /// World to local: the normal becomes +Z.
    #[must_use]
    pub fn to_local(&self, v: Vec3) -> Vec3 {
        Vec3::new(v.dot(self.tangent), v.dot(self.bitangent), v.dot(self.normal))
    }

    /// Local to world.
    #[must_use]
    pub fn to_world(&self, v: Vec3) -> Vec3 {
        self.tangent * v.x + self.bitangent * v.y + self.normal * v.z
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frame_is_orthonormal_and_right_handed_everywhere() {
        const TOLERANCE: f64 = 1e-14; // a few roundings of unit-sized products
        for i in 0..200 {
            let z = 1.0 - (f64::from(i) + 0.5) / 100.0;
            let (s, c) = crate::math::elementary::sin_cos(2.4 * f64::from(i));
            let r = (1.0 - z * z).max(0.0).sqrt();
            let f = Frame::from_normal(Vec3::new(r * c, r * s, z));
            assert!((f.tangent.cross(f.bitangent) - f.normal).length() < TOLERANCE);
            assert!((f.tangent.length() - 1.0).abs() < TOLERANCE && f.tangent.dot(f.normal).abs() < TOLERANCE);
            let v = Vec3::new(0.3, -0.5, 0.8);
            assert!((f.to_world(f.to_local(v)) - v).length() < TOLERANCE);
        }
    }
}
