//! Beckmann's distribution of microfacet normals, which several models share.

use super::single::{Seen, second_order};
use crate::math::real::Real;
use std::f64::consts::PI;

/// `D = exp(-tan^2(th)/m^2) / (pi m^2 cos^4(th))`, and the factor by which the spread of light changes its mean.
///
/// Spread: with `u = sin^2(th)` and `c = 1 - u`, `ln D = 1/m^2 - 1/(c m^2) - 2 ln c + ..`, whose slope is `g = 2/c - 1/(c m)^2` and
/// curvature `2/c^2 - 2/(c^3 m^2)`; `D'/D = g` and `D''/D = g^2 + g'`.
#[inline(always)]
pub(super) fn beckmann<T: Real>(g: &Seen<T>, m: T) -> (T, T) {
    let (one, two) = (T::of(1.0), T::of(2.0));
    let m2 = m * m;
    // Farther from the normal, it is dark; there, derivatives would overflow single precision.
    let cos2 = (g.cos_h * g.cos_h).max(T::of(LEAST_COS2));
    let inverse = one / cos2;
    let distribution = (T::of(-1.0) * g.sin2_h * inverse / m2).exp_nonpositive() * inverse * inverse / (T::of(PI) * m2);
    let sharpness = inverse / m2;
    let slope = (two - sharpness) * inverse;
    let curvature = slope * slope + two * (one - sharpness) * inverse * inverse;
    (distribution, second_order(slope * g.du + T::of(0.5) * curvature * g.du2))
}

/// Least square of `n.h` by which it divides.
const LEAST_COS2: f64 = 1e-4;
