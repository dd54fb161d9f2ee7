//! Functions and least-squares problems with known minima, shared by the tests of the searches.

use super::bounds::{Bounds, Scale};
use super::error::SearchError;
use super::least_squares::LeastSquaresProblem;
use super::normal_equations::NormalEquations;
use crate::math::elementary::exp;

impl Bounds {
    /// A box without scaling.
    pub(super) fn unscaled(lower: &[f64], upper: &[f64]) -> Result<Self, SearchError> {
        Self::new(lower.to_vec(), upper.to_vec(), vec![Scale::Unscaled; lower.len()])
    }
}

/// Rosenbrock's function in any even dimension: pairs of `100 (b - a^2)^2 + (1 - a)^2`. Minimum 0 at (1, ..., 1).
pub(super) fn rosenbrock(x: &[f64]) -> f64 {
    x.chunks_exact(2)
        .map(|pair| {
            let (steep, flat) = (pair[1] - pair[0] * pair[0], 1.0 - pair[0]);
            100.0 * steep * steep + flat * flat
        })
        .sum()
}

/// A problem given by its rows, each a residual with its derivatives.
pub(super) trait Rows {
    const DIMENSION: usize;
    fn rows(&self, x: &[f64]) -> Vec<(Vec<f64>, f64)>;
}

impl<T: Rows> LeastSquaresProblem for T {
    fn dimension(&self) -> usize {
        T::DIMENSION
    }

    fn cost(&mut self, point: &[f64]) -> f64 {
        self.rows(point).iter().map(|(_, residual)| residual * residual).sum()
    }

    fn linearise(&mut self, point: &[f64], normal: &mut NormalEquations) {
        self.rows(point).iter().for_each(|(row, residual)| normal.add_row(row, *residual));
    }
}

/// Rosenbrock's function in two dimensions, as two residuals.
pub(super) struct Rosenbrock;

impl Rows for Rosenbrock {
    const DIMENSION: usize = 2;
    fn rows(&self, x: &[f64]) -> Vec<(Vec<f64>, f64)> {
        vec![(vec![-20.0 * x[0], 10.0], 10.0 * (x[1] - x[0] * x[0])), (vec![-1.0, 0.0], 1.0 - x[0])]
    }
}

/// Powell's singular function: the Jacobian has rank 2 at the minimum 0.
pub(super) struct PowellSingular;

impl Rows for PowellSingular {
    const DIMENSION: usize = 4;
    fn rows(&self, x: &[f64]) -> Vec<(Vec<f64>, f64)> {
        let (root5, root10) = (5.0_f64.sqrt(), 10.0_f64.sqrt());
        let (middle, outer) = (x[1] - 2.0 * x[2], x[0] - x[3]);
        vec![
            (vec![1.0, 10.0, 0.0, 0.0], x[0] + 10.0 * x[1]),
            (vec![0.0, 0.0, root5, -root5], root5 * (x[2] - x[3])),
            (vec![0.0, 2.0 * middle, -4.0 * middle, 0.0], middle * middle),
            (vec![2.0 * root10 * outer, 0.0, 0.0, -2.0 * root10 * outer], root10 * outer * outer),
        ]
    }
}

/// `a exp(b t) + c` at t = 0, 0.1, ..., 1.9 against `2.5 exp(-1.3 t) + 0.5` plus a fixed disturbance of +-0.05.
pub(super) struct Exponential;

impl Rows for Exponential {
    const DIMENSION: usize = 3;
    fn rows(&self, x: &[f64]) -> Vec<(Vec<f64>, f64)> {
        (0..20_u8)
            .map(|i| {
                let t = 0.1 * f64::from(i);
                let disturbance = 0.05 * (f64::from(i * 7 % 5) - 2.0) / 2.0;
                let target = 2.5 * exp(-1.3 * t) + 0.5 + disturbance;
                let e = exp(x[1] * t);
                (vec![e, x[0] * t * e, 1.0], x[0] * e + x[2] - target)
            })
            .collect()
    }
}

/// Residuals of `kd` and of the product `ks f0`, which do not determine ks and f0 alone. A last residual, of weight
/// `weak`, determines f0 weakly, or not at all if `weak` is 0.
pub(super) struct Degenerate {
    pub(super) weak: f64,
}

impl Rows for Degenerate {
    const DIMENSION: usize = 3;
    fn rows(&self, x: &[f64]) -> Vec<(Vec<f64>, f64)> {
        let [kd, ks, f0] = [x[0], x[1], x[2]];
        vec![
            (vec![1.0, 0.0, 0.0], kd - 0.4),
            (vec![0.0, f0, ks], ks * f0 - 0.06),
            (vec![1.0, 2.0 * f0, 2.0 * ks], kd + 2.0 * ks * f0 - 0.52),
            (vec![0.0, 0.0, self.weak], self.weak * (f0 - 0.3)),
        ]
    }
}
