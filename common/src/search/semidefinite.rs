//! Cholesky factorisation with diagonal pivoting of a small positive semidefinite matrix that may be singular
//! (Higham, *Accuracy and Stability of Numerical Algorithms*, section 10.3).
//!
//! The matrix is first scaled to unit diagonal, so that a pivot is the fraction of a column's square that the columns
//! before it do not explain (1 - R^2). Columns with a pivot of at most [`RANK_TOLERANCE`] are dependent; their solution
//! is 0.

/// The largest pivot that counts as rounding: 50 units in the last place. That is about ten times the remainder of
/// an exactly dependent column after ten eliminations, and a hundredth of what the least damping adds to such a column.
const RANK_TOLERANCE: f64 = 1e-14;

/// The largest component of a null vector, in units of scaled columns, that counts as rounding.
const NULL_TOLERANCE: f64 = 1e-6;

/// The factor of a k x k matrix: `P S A S P^T = L L^T`, with S the scale to unit diagonal and P the pivoting.
#[derive(Debug)]
pub(super) struct Factor {
    /// L, row-major k x k. Rows beyond the rank are filled only in the leading columns.
    lower: Vec<f64>,
    /// The parameter of each pivot.
    order: Vec<usize>,
    /// 1 / sqrt(A_ii), or 0 for an empty column.
    scale: Vec<f64>,
    rank: usize,
}

impl Factor {
    /// Factorises the symmetric matrix with the given elements.
    pub(super) fn new(size: usize, element: impl Fn(usize, usize) -> f64) -> Self {
        let scale: Vec<f64> = (0..size)
            .map(|i| element(i, i))
            .map(|square| if square > 0.0 { 1.0 / square.sqrt() } else { 0.0 })
            .collect();
        let mut work: Vec<f64> = vec![0.0; size * size];
        for i in 0..size {
            for j in 0..size {
                work[i * size + j] = element(i, j) * scale[i] * scale[j];
            }
        }
        let mut factor = Self { lower: vec![0.0; size * size], order: (0..size).collect(), scale, rank: 0 };
        while factor.rank < size && factor.eliminate(&mut work) {
            factor.rank += 1;
        }
        factor
    }

    /// The basic solution of `A x = rhs`, which is 0 in the dependent columns.
    pub(super) fn solve(&self, rhs: &[f64]) -> Vec<f64> {
        let size = self.order.len();
        let mut y: Vec<f64> = (0..self.rank).map(|p| rhs[self.order[p]] * self.scale[self.order[p]]).collect();
        for p in 0..self.rank {
            let known: f64 = (0..p).map(|q| self.lower[p * size + q] * y[q]).sum();
            y[p] = (y[p] - known) / self.lower[p * size + p];
        }
        self.back_substitute(&mut y);
        let mut x = vec![0.0; size];
        for (p, value) in y.into_iter().enumerate() {
            x[self.order[p]] = value * self.scale[self.order[p]];
        }
        x
    }

    /// The diagonal of the inverse; infinite for each parameter with a component in a null vector.
    pub(super) fn inverse_diagonal(&self) -> Vec<f64> {
        let size = self.order.len();
        let mut diagonal: Vec<f64> = (0..size)
            .map(|i| {
                let unit: Vec<f64> = (0..size).map(|j| f64::from(u8::from(i == j))).collect();
                self.solve(&unit)[i]
            })
            .collect();
        for dependent in self.rank..size {
            diagonal[self.order[dependent]] = f64::INFINITY;
            let mut null: Vec<f64> = self.lower[dependent * size..dependent * size + self.rank].to_vec();
            self.back_substitute(&mut null);
            for (p, component) in null.into_iter().enumerate() {
                if component.abs() > NULL_TOLERANCE {
                    diagonal[self.order[p]] = f64::INFINITY;
                }
            }
        }
        diagonal
    }

    /// Eliminates the largest remaining pivot from `work`. Returns false if all remaining columns are dependent.
    fn eliminate(&mut self, work: &mut [f64]) -> bool {
        let (size, p) = (self.order.len(), self.rank);
        let mut pivot = p;
        for q in p + 1..size {
            if work[q * size + q] > work[pivot * size + pivot] {
                pivot = q;
            }
        }
        let square = work[pivot * size + pivot];
        if square.is_nan() || square <= RANK_TOLERANCE {
            return false;
        }
        self.order.swap(p, pivot);
        for k in 0..size {
            work.swap(p * size + k, pivot * size + k);
            self.lower.swap(p * size + k, pivot * size + k);
        }
        for k in 0..size {
            work.swap(k * size + p, k * size + pivot);
        }
        let root = square.sqrt();
        self.lower[p * size + p] = root;
        for i in p + 1..size {
            self.lower[i * size + p] = work[i * size + p] / root;
        }
        for i in p + 1..size {
            for j in p + 1..size {
                work[i * size + j] -= self.lower[i * size + p] * self.lower[j * size + p];
            }
        }
        true
    }

    /// Solves `L^T z = y` over the pivots, in place.
    fn back_substitute(&self, y: &mut [f64]) {
        let size = self.order.len();
        for p in (0..self.rank).rev() {
            let known: f64 = (p + 1..self.rank).map(|q| self.lower[q * size + p] * y[q]).sum();
            y[p] = (y[p] - known) / self.lower[p * size + p];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gram(columns: &[Vec<f64>]) -> impl Fn(usize, usize) -> f64 + '_ {
        |i, j| columns[i].iter().zip(&columns[j]).map(|(a, b)| a * b).sum()
    }

    #[test]
    fn the_solution_of_full_rank_satisfies_the_equations_in_any_units() {
        let columns = vec![vec![1e-6, 2e-6, 0.0], vec![0.0, 3e4, 1e4], vec![1.0, 0.0, -1.0]];
        let factor = Factor::new(3, gram(&columns));
        let rhs = [3e-6, -2e4, 0.5];
        let x = factor.solve(&rhs);
        for (i, right) in rhs.iter().enumerate() {
            let left: f64 = (0..3).map(|j| gram(&columns)(i, j) * x[j]).sum();
            assert!((left - right).abs() < 1e-12 * right.abs(), "{i}: {left} {right}");
        }
    }

    #[test]
    fn dependent_columns_are_zero_and_the_others_solve_the_equations() {
        // The third column is the sum of the first two, the fourth is empty.
        let columns = vec![vec![1.0, 2.0, 0.3], vec![0.1, -1.0, 1.0], vec![1.1, 1.0, 1.3], vec![0.0; 3]];
        let factor = Factor::new(4, gram(&columns));
        assert_eq!(factor.rank, 2);
        let target = [2.0, -1.0, 0.7];
        let rhs: Vec<f64> = columns.iter().map(|c| c.iter().zip(&target).map(|(a, b)| a * b).sum()).collect();
        let x = factor.solve(&rhs);
        assert_eq!(x.iter().filter(|&&x| x == 0.0).count(), 2);
        for (i, right) in rhs.iter().enumerate() {
            let left: f64 = (0..4).map(|j| gram(&columns)(i, j) * x[j]).sum();
            assert!((left - right).abs() < 1e-13, "{i}: {left} {right}");
        }
        assert!(factor.inverse_diagonal().iter().all(|v| v.is_infinite()));
    }

    #[test]
    fn rounding_does_not_raise_the_rank() {
        use crate::math::sampling::{key, uniform};
        for seed in 0..200 {
            let number = |i: u64, j: u64| 2.0 * uniform(key(&[seed, i, j])) - 1.0;
            let mut columns: Vec<Vec<f64>> = (0..4).map(|j| (0..9).map(|i| number(i, j)).collect()).collect();
            columns[3] = (0..9).map(|i| 0.7 * columns[0][i] - 1.9 * columns[1][i] + 0.1 * columns[2][i]).collect();
            assert_eq!(Factor::new(4, gram(&columns)).rank, 3, "{seed}");
        }
    }
}
