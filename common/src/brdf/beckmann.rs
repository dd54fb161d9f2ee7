//! Beckmann's distribution of microfacet normals, which several models share.

use super::{
    Angles, Spread,
    lobe::{LEAST_COS2, second_order},
};
use crate::math::elementary::exp_nonpositive;
use std::f64::consts::PI;

/// `D = exp(-tan^2(th)/m^2) / (pi m^2 cos^4(th))`, and the factor by which the spread of light changes its mean.
///
/// Spread: with `u = sin^2(th)` and `c = 1 - u`, `ln D = 1/m^2 - 1/(c m^2) - 2 ln c + ..`, whose slope is `g = 2/c - 1/(c m)^2` and
/// curvature `2/c^2 - 2/(c^3 m^2)`; `D'/D = g` and `D''/D = g^2 + g'`.
#[inline(always)]
pub(super) fn beckmann(g: &Angles, spread: &Spread, m: f64) -> (f64, f64) {
    let m2 = m * m;
    let cos2 = (g.cos_h * g.cos_h).max(LEAST_COS2);
    let distribution = exp_nonpositive(-g.sin2_h / (cos2 * m2)) / (PI * m2 * cos2 * cos2);
    let inverse = 1.0 / cos2;
    let sharpness = inverse / m2;
    let slope = (2.0 - sharpness) * inverse;
    let curvature = slope * slope + 2.0 * (1.0 - sharpness) * inverse * inverse;
    (distribution, second_order(slope * spread.du + 0.5 * curvature * spread.du2))
}
