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
#[inline]
pub fn central(position: f64) -> [f64; STENCIL] {
    let s = position;
    let (s2, s3) = (s * s, s * s * s);
    // A twelfth of the Hermite basis of the slopes at both ends, times 12-fold differences as in `difference`.
    let (a, b) = ((s3 - 2.0 * s2 + s) / 12.0, (s3 - s2) / 12.0);
    let rise = 3.0 * s2 - 2.0 * s3;
    [a, b - 8.0 * a, 1.0 - rise - 8.0 * b, rise + 8.0 * a, 8.0 * b - a, -b]
}

/// The weights of four-point Lagrange interpolation on the values of [`central`]. Its error is nine times larger, so the difference of
/// the two tells how good either is.
#[must_use]
#[inline]
pub fn central_check(position: f64) -> [f64; STENCIL] {
    let [a, b, c, d] = lagrange(position);
    [0.0, a, b, c, d, 0.0]
}

/// As [`stencil`], without slopes and with the weights of [`central_check`]: the first value, the weights, those of the check.
#[must_use]
#[inline]
pub fn checked(position: f64, count: usize) -> (usize, [f64; STENCIL], [f64; STENCIL]) {
    let left = cell(position, count - 1);
    if left >= 2 && left + 3 < count {
        let s = position - left as f64;
        return (left - 2, central(s), central_check(s));
    }
    let stencil = stencil(position, count);
    (stencil.first, stencil.value, check(position, count))
}

/// As [`central_check`] for a [`stencil`], on its six values.
fn check(position: f64, count: usize) -> [f64; STENCIL] {
    let position = position.clamp(0.0, (count - 1) as f64);
    let left = cell(position, count - 1);
    let first = left.saturating_sub(2).min(count - STENCIL);
    let from = left.saturating_sub(1).min(count - 4);
    let mut weights = [0.0; STENCIL];
    weights[from - first..][..4].copy_from_slice(&lagrange(position - (from + 1) as f64));
    weights
}

/// Weights of the values at -1, 0, 1 and 2.
#[inline]
fn lagrange(s: f64) -> [f64; 4] {
    let (p, q, r) = (s + 1.0, s - 1.0, s - 2.0);
    [-s * q * r / 6.0, p * q * r / 2.0, -p * s * r / 2.0, p * s * q / 6.0]
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
            let (first, value, check) = checked(x, 9);
            assert!(first == s.first && (sum(&check) - f(x)).abs() < 1e-12, "{x}");
            assert!(value.iter().zip(s.value).all(|(a, b)| (a - b).abs() < 1e-15), "{x}");
        }
    }

    #[test]
    fn central_weights_are_those_inside_a_long_list() {
        for s in [0.0, 0.3, 0.999] {
            let inside = stencil(2.0 + s, 12);
            assert!(central(s).iter().zip(inside.value).all(|(a, b)| (a - b).abs() < 1e-15));
            assert!(central_check(s).iter().zip(check(2.0 + s, 12)).all(|(a, b)| (a - b).abs() < 1e-15));
        }
        assert_eq!(central(0.0), [0.0, 0.0, 1.0, 0.0, 0.0, 0.0]);
    }
}
