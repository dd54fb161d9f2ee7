//! Eigenvalues and eigenvectors of a small symmetric matrix.
//!
//! Source: Jacobi's method, in the form of Golub & Van Loan, *Matrix Computations*, section 8.5: sweeps of plane rotations, each of which
//! makes one element off the diagonal zero.

/// The eigenvalues of the symmetric n x n matrix with the given elements (i <= j), each with its unit eigenvector.
#[must_use]
pub fn symmetric(n: usize, element: impl Fn(usize, usize) -> f64) -> Vec<(f64, Vec<f64>)> {
    let mut a: Vec<Vec<f64>> = (0..n).map(|i| (0..n).map(|j| element(i.min(j), i.max(j))).collect()).collect();
    let mut vectors: Vec<Vec<f64>> = (0..n).map(|i| (0..n).map(|j| f64::from(u8::from(i == j))).collect()).collect();
    for _ in 0..SWEEPS {
        for p in 0..n {
            for q in p + 1..n {
                if a[p][q] != 0.0 {
                    rotate(&mut a, &mut vectors, p, q);
                }
            }
        }
    }
    let value = |i: usize| a[i][i];
    vectors.into_iter().enumerate().map(|(i, vector)| (value(i), vector)).collect()
}

/// Sweeps: convergence is quadratic, and ten are enough for tens of columns.
const SWEEPS: usize = 12;

/// Makes elements (p, q) and (q, p) zero. Row i of `vectors` is the i-th eigenvector.
fn rotate(a: &mut [Vec<f64>], vectors: &mut [Vec<f64>], p: usize, q: usize) {
    let tau = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
    let sign = if tau < 0.0 { -1.0 } else { 1.0 };
    let t = sign / (tau.abs() + (1.0 + tau * tau).sqrt());
    let c = 1.0 / (1.0 + t * t).sqrt();
    let s = t * c;
    for row in &mut *a {
        (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
    }
    let (first, second) = rows(a, p, q);
    turn(first, second, c, s);
    let (first, second) = rows(vectors, p, q);
    turn(first, second, c, s);
    (a[p][q], a[q][p]) = (0.0, 0.0);
}

/// Rows p and q, p < q.
fn rows(matrix: &mut [Vec<f64>], p: usize, q: usize) -> (&mut [f64], &mut [f64]) {
    let (before, after) = matrix.split_at_mut(q);
    (&mut before[p], &mut after[0])
}

fn turn(first: &mut [f64], second: &mut [f64], c: f64, s: f64) {
    for (x, y) in first.iter_mut().zip(second) {
        (*x, *y) = (c * *x - s * *y, s * *x + c * *y);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vectors_are_orthonormal_and_give_the_matrix_back() {
        let matrix = [[4.0, 1.0, -2.0, 0.0], [1.0, -3.0, 0.5, 1e-9], [-2.0, 0.5, 4.0, 7.0], [0.0, 1e-9, 7.0, 1e-6]];
        let found = symmetric(4, |i, j| matrix[i][j]);
        for i in 0..4 {
            for j in 0..4 {
                let product: f64 = (0..4).map(|k| found[i].1[k] * found[j].1[k]).sum();
                assert!((product - f64::from(u8::from(i == j))).abs() < 1e-14);
                let back: f64 = found.iter().map(|(value, vector)| value * vector[i] * vector[j]).sum();
                assert!((back - matrix[i][j]).abs() < 1e-13, "{i} {j}: {back}");
            }
        }
    }

    #[test]
    fn eigenvalues_of_a_singular_matrix_are_known() {
        let mut values: Vec<f64> = symmetric(3, |_, _| 1.0).into_iter().map(|(value, _)| value).collect();
        values.sort_by(f64::total_cmp);
        assert!(values[0].abs() < 1e-15 && values[1].abs() < 1e-15 && (values[2] - 3.0).abs() < 1e-14, "{values:?}");
    }
}
