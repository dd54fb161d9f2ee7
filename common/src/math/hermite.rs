//! Interpolation between equally spaced values.
//!
//! Cubic Hermite pieces whose slopes are fourth-order finite differences (six values in all), so the interpolant is continuously
//! differentiable and its error is `h^4/384 f''''`, nine times less than that of four-point Lagrange interpolation.

use super::cell;

/// Values of the widest stencil.
pub const STENCIL: usize = 6;

/// The values around a position, with their weights for the value and the derivative there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stencil {
    /// First value of six.
    pub first: usize,
    /// Weights of the value.
    pub value: [f64; STENCIL],
    /// Weights of the derivative, per step.
    pub slope: [f64; STENCIL],
}

/// The weights at `position`, in steps from the first of `count` values (at least [`STENCIL`]); it is clamped to their range.
#[must_use]
pub fn stencil(position: f64, count: usize) -> Stencil {
    let position = position.clamp(0.0, (count - 1) as f64);
    let left = cell(position, count - 1);
    let s = position - left as f64;
    let first = left.saturating_sub(2).min(count - STENCIL);
    let (mut value, mut slope) = ([0.0; STENCIL], [0.0; STENCIL]);
    let (s2, s3) = (s * s, s * s * s);
    // Hermite basis: values at both ends, then slopes at both ends; and their derivatives.
    value[left - first] += 2.0 * s3 - 3.0 * s2 + 1.0;
    value[left + 1 - first] += 3.0 * s2 - 2.0 * s3;
    slope[left - first] += 6.0 * s2 - 6.0 * s;
    slope[left + 1 - first] += 6.0 * s - 6.0 * s2;
    let ends = [(left, s3 - 2.0 * s2 + s, 3.0 * s2 - 4.0 * s + 1.0), (left + 1, s3 - s2, 3.0 * s2 - 2.0 * s)];
    for (place, basis, basis_slope) in ends {
        let (from, weights) = difference(place, count - 1);
        for (k, w) in weights.iter().enumerate() {
            value[from + k - first] += basis * w / 12.0;
            slope[from + k - first] += basis_slope * w / 12.0;
        }
    }
    Stencil { first, value, slope }
}

/// Weights of the values at -2, -1, 0, 1, 2 and 3 for the value at a position in [0, 1): far from the ends, or where there are none.
#[must_use]
pub fn central(position: f64) -> [f64; STENCIL] {
    stencil(2.0 + position, 2 * STENCIL).value
}

/// Fourth-order first difference at a place of `0..=last`, times 12: the first of five values and the weights.
fn difference(place: usize, last: usize) -> (usize, [f64; 5]) {
    match place {
        0 => (0, [-25.0, 48.0, -36.0, 16.0, -3.0]),
        1 => (0, [-3.0, -10.0, 18.0, -6.0, 1.0]),
        k if k == last => (last - 4, [3.0, -16.0, 36.0, -48.0, 25.0]),
        k if k + 1 == last => (last - 4, [-1.0, 6.0, -18.0, 10.0, 3.0]),
        k => (k - 2, [1.0, -8.0, 0.0, 8.0, -1.0]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cubics_are_reproduced_exactly_up_to_the_ends() {
        let f = |x: f64| 0.3 + x * (0.5 + x * (0.2 - 0.1 * x));
        let df = |x: f64| 0.5 + x * (0.4 - 0.3 * x);
        for i in 0..=100 {
            let x = 0.08 * f64::from(i);
            let s = stencil(x, 9);
            let sum = |w: &[f64; STENCIL]| -> f64 { w.iter().zip(s.first..).map(|(w, k)| w * f(k as f64)).sum() };
            assert!((sum(&s.value) - f(x)).abs() < 1e-12 && (sum(&s.slope) - df(x)).abs() < 1e-12, "{x}");
        }
    }

    #[test]
    fn central_weights_are_those_inside_a_long_list() {
        for s in [0.0, 0.3, 0.999] {
            assert_eq!(central(s), stencil(2.0 + s, 12).value);
        }
        assert_eq!(central(0.0), [0.0, 0.0, 1.0, 0.0, 0.0, 0.0]);
    }
}
