//! The cosine of the half vector's angle to a power: the lobe of Blinn (1977) and of Ashikhmin & Shirley (2000).

use super::{Angles, Channels, Parameter, Role, Scale, Spread, Width, single::second_order};
use crate::math::elementary::{exp_bounded, ln_positive};

/// The exponent as a parameter.
pub(super) const EXPONENT: Parameter = Parameter {
    name: "n",
    meaning: "exponent of the cosine between normal and half vector",
    channels: Channels::Scalar,
    lower: 1.0,
    upper: 1e5,
    start: 20.0,
    role: Role::Width,
    upper_is_kind: false,
    usual: None,
    scale: Scale::Logarithmic,
};

/// The width of an exponent in the flat parameter vector: `alpha = sqrt(2 / (n + 2))`, for which the peak has the curvature of GGX.
pub(super) const fn width(entry: usize) -> Width {
    Width { entry, of: |n| (2.0 / (n + 2.0)).sqrt(), inverse: exponent, derivative, widened_by: None }
}

fn derivative(n: f64) -> f64 {
    -0.5 * (2.0 / (n + 2.0)).sqrt() / (n + 2.0)
}

/// The exponent of a width of at most 1: `n = 2 / alpha^2 - 2`.
#[inline(always)]
pub(super) fn exponent(alpha: f64) -> f64 {
    2.0 / (alpha * alpha) - 2.0
}

/// The albedo that a sharp lobe divided by the larger of `n.l` and `n.v` may lose: half of it lies beyond the kink at `n.l = n.v`.
pub(super) fn beyond_kink(width: f64, cos_o: f64) -> f64 {
    width * (1.0 - cos_o * cos_o).sqrt() / cos_o + 0.002
}

/// The turn of the normal within which such a lobe varies little: less than its width, because the kink at `n.l = n.v` runs through the
/// mirror direction. With parts of a whole width, tables of stage one were off by 0.34 % of mean radiance under Eucalyptus
/// Grove; with half a width, by 0.14 %.
pub(super) fn footprint(width: f64) -> f64 {
    0.5 * width
}

/// `(n.h)^n`, and the factor by which the spread of light changes its mean.
///
/// Spread: with `u = sin^2(th)` and `k = n/2` it is `(1 - u)^k`; its first derivative by `u`, as a share of it, is `-k / (1 - u)`, its
/// second `k (k - 1) / (1 - u)^2`.
#[inline(always)]
pub(super) fn cosine(g: &Angles, spread: &Spread, alpha: f64) -> (f64, f64) {
    // Near the surface 1 - u may round to 0 in single precision, in which angles are stored.
    let cos2 = (1.0 - g.sin2_h).max(1e-12);
    let k = 0.5 * exponent(alpha);
    let inverse = 1.0 / cos2;
    let slope = k * inverse;
    let blur = second_order(0.5 * slope * (k - 1.0) * inverse * spread.du2 - slope * spread.du);
    (exp_bounded(k * ln_positive(cos2).min(0.0)), blur)
}
