//! Checks of analytic derivatives against finite differences, for tests.
//!
//! Central differences at steps h and h/2, extrapolated to remove the h^2 term (Richardson). The error is of order h^4
//! plus rounding of order 1e-16 / h: about ten digits if h is a thousandth of the scale on which the slope changes.

use super::least_squares::LeastSquaresProblem;
use super::normal_equations::NormalEquations;

/// The largest difference between an analytic and a numeric derivative.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct DerivativeCheck {
    /// Index of the function (the residual), or 0.
    pub(crate) row: usize,
    /// Index of the parameter.
    pub(crate) column: usize,
    /// The analytic derivative.
    pub(crate) analytic: f64,
    /// The derivative by finite differences.
    pub(crate) numeric: f64,
    /// Their difference in units of the largest derivative by this parameter; NaN if either is NaN.
    pub(crate) error: f64,
}

/// Compares a Jacobian (row-major m x n at `point`) with finite differences of `functions` (n values to m), with step
/// `steps[i]` > 0 in parameter i. Every point within the steps must be in the domain of the functions.
///
/// # Panics
/// If lengths do not match.
#[must_use]
pub(crate) fn check_jacobian(
    mut functions: impl FnMut(&[f64]) -> Vec<f64>,
    jacobian: &[f64],
    point: &[f64],
    steps: &[f64],
) -> DerivativeCheck {
    let n = point.len();
    assert_eq!(steps.len(), n, "one step per parameter");
    let columns: Vec<Vec<f64>> = (0..n).map(|i| differences(&mut functions, point, i, steps[i])).collect();
    assert_eq!(jacobian.len(), columns.iter().map(Vec::len).sum::<usize>(), "one row of derivatives per function");
    let mut worst = DerivativeCheck { row: 0, column: 0, analytic: 0.0, numeric: 0.0, error: 0.0 };
    for (column, numeric) in columns.iter().enumerate() {
        let analytic = |row: usize| jacobian[row * n + column];
        let largest = (0..numeric.len()).map(|row| analytic(row).abs().max(numeric[row].abs())).fold(0.0, f64::max);
        for (row, &numeric) in numeric.iter().enumerate() {
            let difference = (analytic(row) - numeric).abs();
            let error = if difference == 0.0 { 0.0 } else { difference / largest };
            // NaN counts as the largest error.
            if !worst.error.is_nan() && (error.is_nan() || error > worst.error) {
                worst = DerivativeCheck { row, column, analytic: analytic(row), numeric, error };
            }
        }
    }
    worst
}

/// Compares a problem's `J^T r` at `point` with half the differences of its cost, as [`check_jacobian`] does.
///
/// # Panics
/// If lengths do not match.
#[must_use]
pub(crate) fn check_gradient(problem: &mut dyn LeastSquaresProblem, point: &[f64], steps: &[f64]) -> DerivativeCheck {
    let mut normal = NormalEquations::new(problem.dimension());
    problem.linearise(point, &mut normal);
    let gradient: Vec<f64> = (0..point.len()).map(|i| normal.vector(i)).collect();
    check_jacobian(|x| vec![0.5 * problem.cost(x)], &gradient, point, steps)
}

fn differences(functions: &mut impl FnMut(&[f64]) -> Vec<f64>, point: &[f64], parameter: usize, step: f64) -> Vec<f64> {
    let mut slope = |h: f64| -> Vec<f64> {
        let (mut ahead, mut behind) = (point.to_vec(), point.to_vec());
        ahead[parameter] += h;
        behind[parameter] -= h;
        let width = ahead[parameter] - behind[parameter];
        functions(&ahead).into_iter().zip(functions(&behind)).map(|(a, b)| (a - b) / width).collect()
    };
    let (coarse, fine) = (slope(step), slope(0.5 * step));
    fine.into_iter().zip(coarse).map(|(fine, coarse)| (4.0 * fine - coarse) / 3.0).collect()
}

#[cfg(test)]
mod tests {
    use super::super::test_functions::{Exponential, Rosenbrock};
    use super::*;

    fn functions(x: &[f64]) -> Vec<f64> {
        vec![x[0] * x[0] * x[1], crate::math::elementary::exp(x[1]), x[0]]
    }

    #[test]
    fn a_correct_jacobian_agrees_to_ten_digits() {
        let (x, y) = (1.3, -0.4);
        let jacobian = [2.0 * x * y, x * x, 0.0, crate::math::elementary::exp(y), 1.0, 0.0];
        let check = check_jacobian(functions, &jacobian, &[x, y], &[1e-3, 1e-3]);
        assert!(check.error < 1e-10, "{check:?}");
    }

    #[test]
    fn a_wrong_or_missing_derivative_is_located() {
        let (x, y) = (1.3, -0.4);
        let mut jacobian = [2.0 * x * y, x * x, 0.0, crate::math::elementary::exp(y), 1.0, 0.0];
        jacobian[3] *= 1.001;
        let check = check_jacobian(functions, &jacobian, &[x, y], &[1e-3, 1e-3]);
        assert!((check.row, check.column) == (1, 1) && check.error > 3e-4, "{check:?}");
        jacobian[4] = f64::NAN;
        let check = check_jacobian(functions, &jacobian, &[x, y], &[1e-3, 1e-3]);
        assert!(check.row == 2 && check.error.is_nan(), "{check:?}");
    }

    #[test]
    fn gradients_of_the_test_problems_are_correct() {
        assert!(check_gradient(&mut Rosenbrock, &[-1.2, 1.0], &[1e-3, 1e-3]).error < 1e-9);
        assert!(check_gradient(&mut Exponential, &[2.0, -0.7, 0.4], &[1e-3; 3]).error < 1e-9);
    }
}
