//! The angle of a point in the plane, fast and with the same bits on every platform.
//!
//! `libm::atan2` costs about as much as the rest of a look-up in an environment map. Here the angle is reduced, with one
//! division, to the arctangent of |t| <= tan(pi/8). There the odd polynomial below is within 5e-17 of the arctangent (it
//! is near-minimax, from a Chebyshev fit of atan(sqrt z)/sqrt z in 50 digits). Only +, -, *, / are used, without a fused
//! multiply-add, so that every platform computes the same bits.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

/// Angle in \[-pi, pi\] of the point (x, y), within a few units in the last place of pi. The origin gives 0. The
/// arguments must be finite; a NaN comes out as NaN.
#[must_use]
#[inline]
pub fn angle(y: f64, x: f64) -> f64 {
    let (ax, ay) = (x.abs(), y.abs());
    let (low, high) = if ay > ax { (ax, ay) } else { (ay, ax) };
    let folded = low > TAN_PI_8 * high;
    // Each choice compiles to a mask. A branch would be mispredicted often: about half of all directions fold.
    let numerator = low - if folded { high } else { 0.0 };
    let denominator = high + if folded { low } else { 0.0 };
    let t = numerator / denominator.max(f64::MIN_POSITIVE);
    let octant = arctangent(t) + if folded { FRAC_PI_4 } else { 0.0 };
    let quadrant = if ay > ax { FRAC_PI_2 - octant } else { octant };
    let half_turn = if x < 0.0 { PI - quadrant } else { quadrant };
    half_turn.copysign(y)
}

/// Arctangent of |t| <= tan(pi/8), by Estrin's scheme (short dependency chains).
#[inline]
fn arctangent(t: f64) -> f64 {
    let z = t * t;
    let z2 = z * z;
    let z4 = z2 * z2;
    let a = (C[0] + C[1] * z) + (C[2] + C[3] * z) * z2;
    let b = (C[4] + C[5] * z) + (C[6] + C[7] * z) * z2;
    let c = (C[8] + C[9] * z) + C[10] * z2;
    t * (a + (b + c * z4) * z4)
}

const TAN_PI_8: f64 = std::f64::consts::SQRT_2 - 1.0;

const C: [f64; 11] = [
    1.0,
    -0.333_333_333_333_284_3,
    0.199_999_999_988_551_1,
    -0.142_857_141_809_764_67,
    0.111_111_061_804_559_46,
    -0.090_907_730_748_088_14,
    0.076_899_534_963_068_57,
    -0.066_402_339_304_294_08,
    0.056_883_492_268_090_106,
    -0.043_480_522_157_164_62,
    0.021_135_373_157_693_246,
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::elementary::{atan2, sin_cos};

    #[test]
    fn angle_agrees_with_libm_around_the_circle_and_near_the_axes() {
        // Two roundings at the size of pi, and those of the polynomial.
        const TOLERANCE: f64 = 1.0e-15;
        for i in 0..100_000 {
            let (s, c) = sin_cos(f64::from(i) * 1e-4 - 5.0);
            assert!((angle(s, c) - atan2(s, c)).abs() < TOLERANCE, "{s} {c}");
        }
        for tiny in [1e-300, 1e-30, 1e-9] {
            for (y, x) in [(tiny, 1.0), (-tiny, 1.0), (1.0, tiny), (1.0, -tiny), (tiny, -1.0), (-tiny, -1.0)] {
                assert!((angle(y, x) - atan2(y, x)).abs() < TOLERANCE, "{y} {x}");
            }
        }
    }

    #[test]
    fn angle_is_finite_on_the_axes_and_at_the_origin() {
        assert_eq!(angle(0.0, 0.0), 0.0);
        assert_eq!(angle(0.0, 2.0), 0.0);
        assert_eq!(angle(3.0, 0.0), FRAC_PI_2);
        assert_eq!(angle(-3.0, 0.0), -FRAC_PI_2);
        assert_eq!(angle(0.0, -1.0), PI);
        assert_eq!(angle(1.0, 1.0), FRAC_PI_4);
        assert!(angle(f64::NAN, 1.0).is_nan() && angle(1.0, f64::NAN).is_nan());
    }
}
