//! The per-pixel cost of stage one (\[BP20b\] Eq. 1):
//!
//! `C(A, B, gamma) = sum_p w_p sum_rgb (A[p]^(1/gamma) - B[p]^(1/gamma))^2`
//!
//! without clamping. A power below 1 has an infinite slope at zero, so the tangent line at a small e replaces it below
//! e. The function is then continuously differentiable with a finite gradient, and negative values keep their order.
//! This function treats A and B the same; `fit` replaces negative values of A by 0 first (design section 1).

use crate::math::elementary::{ln, pow, pow_positive};

/// The compression `x^(1/gamma)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Compression {
    exponent: f64,
    /// The tangent line is used below this; 0 for the paper's `max(x, 0)`.
    knee: f64,
    value_at_knee: f64,
    slope_at_knee: f64,
    /// Radiance is clamped to at most this.
    ceiling: f64,
    /// The scale of the logarithm, if it replaces the power.
    logarithm: Option<f64>,
}

/// The scale of [`Compression::logarithm`], as a fraction of the photo's mean radiance.
pub const LOGARITHM_SCALE: f64 = 0.01;

/// The radiance below which the tangent line is used, as a fraction of the photo's mean radiance (design section 1).
pub const KNEE: f64 = 1e-6;

impl Compression {
    /// Compression with the tangent line below [`KNEE`] times the photo's mean radiance.
    ///
    /// # Panics
    /// Unless gamma and the mean radiance are positive.
    #[must_use]
    pub fn new(gamma: f64, mean_radiance: f64) -> Self {
        assert!(gamma > 0.0 && mean_radiance > 0.0, "gamma {gamma}, mean radiance {mean_radiance}");
        let (exponent, knee) = (1.0 / gamma, KNEE * mean_radiance);
        let value = pow(knee, exponent);
        let slope = exponent * value / knee;
        Self { value_at_knee: value, slope_at_knee: slope, knee, ..Self::power(exponent) }
    }

    /// The paper's compression: `max(x, 0)^(1/gamma)`.
    ///
    /// # Panics
    /// Unless gamma is positive.
    #[must_use]
    pub fn clamped(gamma: f64) -> Self {
        assert!(gamma > 0.0, "gamma {gamma}");
        Self::power(1.0 / gamma)
    }

    /// The compression of radiance clamped to \[0, white\].
    ///
    /// # Panics
    /// Unless gamma and white are positive.
    #[must_use]
    pub fn clamped_to(gamma: f64, white: f64) -> Self {
        assert!(white > 0.0, "white {white}");
        Self { ceiling: white, ..Self::clamped(gamma) }
    }

    /// `ln(1 + max(x, 0) / e)`, where e is [`LOGARITHM_SCALE`] times the photo's mean radiance: an alternative from the
    /// fitting of measured BRDFs (Loew et al., *BRDF Models for Accurate and Efficient Rendering of Glossy Surfaces*,
    /// ACM TOG 31(1), 2012).
    ///
    /// # Panics
    /// Unless the mean radiance is positive.
    #[must_use]
    pub fn logarithm(mean_radiance: f64) -> Self {
        assert!(mean_radiance > 0.0, "mean radiance {mean_radiance}");
        Self { logarithm: Some(LOGARITHM_SCALE * mean_radiance), ..Self::power(1.0) }
    }

    /// The power of `max(x, 0)`.
    fn power(exponent: f64) -> Self {
        Self { exponent, knee: 0.0, value_at_knee: 0.0, slope_at_knee: 0.0, ceiling: f64::INFINITY, logarithm: None }
    }

    /// The compressed value.
    #[must_use]
    pub fn apply(&self, x: f64) -> f64 {
        // Written so that NaN stays NaN.
        let x = if x > self.ceiling { self.ceiling } else { x };
        if let Some(scale) = self.logarithm {
            ln(1.0 + x.max(0.0) / scale)
        } else if x >= self.knee {
            self.power_of(x)
        } else {
            self.value_at_knee + self.slope_at_knee * (x - self.knee)
        }
    }

    /// The power, for any x from 0 to infinity.
    fn power_of(&self, x: f64) -> f64 {
        if self.exponent == 1.0 {
            x
        } else if self.exponent < 1.0 && (f64::MIN_POSITIVE..=f64::MAX).contains(&x) {
            pow_positive(x, self.exponent)
        } else {
            pow(x, self.exponent)
        }
    }

    /// The compressed value and its derivative.
    #[must_use]
    pub fn apply_with_slope(&self, x: f64) -> (f64, f64) {
        let value = self.apply(x);
        let slope = if x >= self.ceiling {
            0.0
        } else if let Some(scale) = self.logarithm {
            if x > 0.0 { 1.0 / (scale + x) } else { 0.0 }
        } else if x > self.knee {
            if self.exponent == 1.0 { 1.0 } else { self.exponent * value / x }
        } else {
            self.slope_at_knee
        };
        (value, slope)
    }
}

/// The weighted sum of squared differences over all pixels and channels, in pixel order. `reference` holds compressed
/// values.
#[must_use]
pub fn cost(compression: &Compression, weights: &[f64], reference: &[Vec<f64>; 3], radiance: &[Vec<f64>; 3]) -> f64 {
    let mut sum = 0.0;
    for (p, weight) in weights.iter().enumerate() {
        let mut pixel = 0.0;
        for c in 0..3 {
            let difference = reference[c][p] - compression.apply(radiance[c][p]);
            pixel += difference * difference;
        }
        sum += weight * pixel;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn compression_is_smooth_at_the_knee_and_keeps_the_order_of_negative_values() {
        let c = Compression::new(2.2, 0.5);
        let knee = KNEE * 0.5;
        let (below, above) = (c.apply_with_slope(knee * (1.0 - 1e-9)), c.apply_with_slope(knee * (1.0 + 1e-9)));
        assert!((below.0 / above.0 - 1.0).abs() < 1e-8 && (below.1 / above.1 - 1.0).abs() < 1e-8);
        assert!(c.apply(-2.0) < c.apply(-1.0) && c.apply(-1.0) < c.apply(0.0));
    }

    #[test]
    fn slopes_are_derivatives() {
        for gamma in [1.0, 1.7, 3.0] {
            let clamped = [Compression::clamped(gamma), Compression::clamped_to(gamma, 21.0)];
            for c in [Compression::new(gamma, 1.0), clamped[0], clamped[1], Compression::logarithm(0.4)] {
                for x in [1e-4, 0.03, 0.7, 20.0] {
                    let h = 1e-6 * x;
                    let numeric = (c.apply(x + h) - c.apply(x - h)) / (2.0 * h);
                    assert!((c.apply_with_slope(x).1 / numeric - 1.0).abs() < 1e-7, "gamma {gamma} x {x}");
                }
            }
        }
        let (white, slope) = Compression::clamped_to(2.0, 4.0).apply_with_slope(9.0);
        assert!((white - 2.0).abs() < 1e-14 && slope == 0.0);
        assert_eq!(Compression::clamped(2.0).apply(f64::INFINITY), f64::INFINITY);
        assert!(Compression::clamped(2.0).apply(f64::NAN).is_nan());
        assert_eq!(Compression::clamped(0.01).apply(1e4), f64::INFINITY);
        assert_eq!(Compression::clamped(0.5).apply(3.0), 9.0);
        assert_eq!(Compression::logarithm(100.0).apply(0.0), 0.0);
        assert!((Compression::logarithm(100.0).apply(1.0) - 2.0_f64.ln()).abs() < 1e-15);
        assert_eq!(Compression::clamped(2.0).apply_with_slope(-1.0), (0.0, 0.0));
        assert_eq!(Compression::clamped(2.0).apply_with_slope(0.0), (0.0, 0.0));
    }

    #[test]
    fn the_cost_is_equation_one() {
        let compression = Compression::clamped(2.0);
        let reference = [vec![2.0, 0.0], vec![1.0, 0.0], vec![0.0, 3.0]]; // already compressed
        let radiance = [vec![1.0, 4.0], vec![1.0, 0.0], vec![0.25, 9.0]];
        let found = cost(&compression, &[1.0, 10.0], &reference, &radiance);
        assert!((found - ((1.0 + 0.0 + 0.25) + 10.0 * 4.0)).abs() < 1e-12, "{found}");
    }
}
