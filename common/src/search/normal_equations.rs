//! The normal equations of a small least-squares problem with many residuals.
//!
//! Residuals are added one row at a time and the Jacobian is not stored: n (n + 3) / 2 numbers replace 200,000 rows.
//! The condition number is squared by this, which is acceptable for the few, scaled parameters of a BRDF.

use super::semidefinite::Factor;

/// `J^T J` (n x n, symmetric, positive semidefinite) and `J^T r` (n) of residuals r with Jacobian J; equally `A^T A`
/// and `A^T b` of a linear problem. Sums run in the order in which rows are added.
#[derive(Debug, Clone, PartialEq)]
pub struct NormalEquations {
    /// The upper triangle, row by row: (0,0), (0,1), ..., (0,n-1), (1,1), ...
    triangle: Vec<f64>,
    vector: Vec<f64>,
}

impl NormalEquations {
    /// No residuals: all elements 0, for `dimension` parameters.
    #[must_use]
    pub fn new(dimension: usize) -> Self {
        Self { triangle: vec![0.0; dimension * (dimension + 1) / 2], vector: vec![0.0; dimension] }
    }

    /// Number of parameters n.
    #[must_use]
    pub fn dimension(&self) -> usize {
        self.vector.len()
    }

    /// Removes all residuals.
    pub fn clear(&mut self) {
        self.triangle.fill(0.0);
        self.vector.fill(0.0);
    }

    /// Adds one residual with its derivatives by the parameters, `row`, n long.
    ///
    /// # Panics
    /// If `row` is not n long.
    pub fn add_row(&mut self, row: &[f64], residual: f64) {
        assert_eq!(row.len(), self.dimension(), "a row has one derivative per parameter");
        let mut cells = self.triangle.iter_mut();
        for (i, &left) in row.iter().enumerate() {
            for (right, cell) in row[i..].iter().zip(&mut cells) {
                *cell += left * right;
            }
            self.vector[i] += left * residual;
        }
    }

    /// Adds the residuals summed in `other`, for example those of another block of rows.
    ///
    /// # Panics
    /// If the dimensions differ.
    pub fn add(&mut self, other: &Self) {
        assert_eq!(self.dimension(), other.dimension(), "blocks have the same parameters");
        self.triangle.iter_mut().zip(&other.triangle).for_each(|(a, b)| *a += b);
        self.vector.iter_mut().zip(&other.vector).for_each(|(a, b)| *a += b);
    }

    /// Element (i, j) of `J^T J`; symmetric.
    ///
    /// # Panics
    /// If an index is not below n.
    #[must_use]
    pub fn matrix(&self, i: usize, j: usize) -> f64 {
        self.triangle[self.cell(i, j)]
    }

    /// Element i of `J^T r`.
    ///
    /// # Panics
    /// If the index is not below n.
    #[must_use]
    pub fn vector(&self, i: usize) -> f64 {
        self.vector[i]
    }

    /// Sets elements (i, j) and (j, i) of the matrix.
    ///
    /// # Panics
    /// If an index is not below n.
    pub fn set_matrix(&mut self, i: usize, j: usize, value: f64) {
        let cell = self.cell(i, j);
        self.triangle[cell] = value;
    }

    /// Sets element i of the vector.
    ///
    /// # Panics
    /// If the index is not below n.
    pub fn set_vector(&mut self, i: usize, value: f64) {
        self.vector[i] = value;
    }

    /// Whether every element is finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.triangle.iter().chain(&self.vector).all(|x| x.is_finite())
    }

    /// The normal equations of the same residuals for the parameters t with dx_i/dt_i = `derivative[i]`.
    #[must_use]
    pub fn reparametrised(&self, derivative: &[f64]) -> Self {
        let mut scaled = self.clone();
        for i in 0..self.dimension() {
            scaled.vector[i] *= derivative[i];
            for j in i..self.dimension() {
                scaled.set_matrix(i, j, self.matrix(i, j) * derivative[i] * derivative[j]);
            }
        }
        scaled
    }

    /// The matrix times a vector: `(J^T J) x`, n long.
    #[must_use]
    pub fn times(&self, x: &[f64]) -> Vec<f64> {
        (0..self.dimension()).map(|i| (0..self.dimension()).map(|j| self.matrix(i, j) * x[j]).sum()).collect()
    }

    /// The diagonal of the inverse of `J^T J` over the parameters marked `free`: the variance of each parameter for
    /// residuals of variance 1. It is 0 for a parameter that is not free (fixed at a bound), and infinite for one that
    /// the residuals do not determine, alone or in combination with others.
    ///
    /// # Panics
    /// If `free` is not n long.
    #[must_use]
    pub fn variances(&self, free: &[bool]) -> Vec<f64> {
        assert_eq!(free.len(), self.dimension(), "one mark per parameter");
        let indices: Vec<usize> = (0..free.len()).filter(|&i| free[i]).collect();
        let mut variances = vec![0.0; free.len()];
        for (variance, &i) in self.factor(&indices).inverse_diagonal().into_iter().zip(&indices) {
            variances[i] = variance;
        }
        variances
    }

    /// The correlation of two parameters in the inverse of `J^T J`, from -1 to 1; NaN if the residuals do not determine one of them.
    #[must_use]
    pub fn correlation(&self, a: usize, b: usize) -> f64 {
        let all: Vec<usize> = (0..self.dimension()).collect();
        let factor = self.factor(&all);
        let diagonal = factor.inverse_diagonal();
        let unit: Vec<f64> = all.iter().map(|&i| f64::from(u8::from(i == a))).collect();
        factor.solve(&unit)[b] / (diagonal[a] * diagonal[b]).sqrt()
    }

    /// The factorised submatrix of the given parameters.
    pub(super) fn factor(&self, indices: &[usize]) -> Factor {
        Factor::new(indices.len(), |a, b| self.matrix(indices[a], indices[b]))
    }

    fn cell(&self, i: usize, j: usize) -> usize {
        let (row, column) = if i <= j { (i, j) } else { (j, i) };
        assert!(column < self.dimension(), "index {column} of {}", self.dimension());
        row * self.dimension() - row * (row + 1) / 2 + column
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of_rows(rows: &[([f64; 3], f64)]) -> NormalEquations {
        let mut normal = NormalEquations::new(3);
        rows.iter().for_each(|(row, residual)| normal.add_row(row, *residual));
        normal
    }

    const ROWS: [([f64; 3], f64); 4] =
        [([1.0, 2.0, 3.0], 4.0), ([-1.0, 0.5, 2.0], -3.0), ([0.0, 1.0, -1.0], 2.0), ([2.0, 0.0, 1.0], 1.0)];

    #[test]
    fn rows_add_up_to_products_of_columns() {
        let normal = of_rows(&ROWS);
        for i in 0..3 {
            for j in 0..3 {
                assert_eq!(normal.matrix(i, j), ROWS.iter().map(|(row, _)| row[i] * row[j]).sum::<f64>());
            }
            assert_eq!(normal.vector(i), ROWS.iter().map(|(row, r)| row[i] * r).sum::<f64>());
        }
        let mut blocks = of_rows(&ROWS[..2]);
        blocks.add(&of_rows(&ROWS[2..]));
        assert_eq!(blocks, normal);
        assert_eq!(normal.times(&[1.0, 0.0, 0.0]), [6.0, 1.5, 3.0]);
        blocks.clear();
        assert_eq!(blocks, NormalEquations::new(3));
    }

    #[test]
    fn reparametrisation_is_the_chain_rule() {
        let derivative = [2.0, 0.5, -1.0];
        let rows = ROWS.map(|(row, r)| (std::array::from_fn(|i| row[i] * derivative[i]), r));
        assert_eq!(of_rows(&ROWS).reparametrised(&derivative), of_rows(&rows));
    }

    #[test]
    fn variances_are_those_of_the_inverse_and_infinite_where_undetermined() {
        // For one parameter 1 / sum of squares; for two the inverse of a 2 x 2 matrix.
        let normal = of_rows(&ROWS);
        assert!((normal.variances(&[true, false, false])[0] - 1.0 / 6.0).abs() < 1e-15);
        let two = normal.variances(&[true, false, true]);
        let determinant = 6.0 * 15.0 - 3.0 * 3.0;
        assert!((two[0] - 15.0 / determinant).abs() < 1e-15 && (two[2] - 6.0 / determinant).abs() < 1e-15);
        assert_eq!(two[1], 0.0);
        // The first two columns are parallel and not determined; the third is determined.
        let parallel = of_rows(&[([1.0, 2.0, 0.0], 0.0), ([3.0, 6.0, 1.0], 0.0), ([0.5, 1.0, -1.0], 0.0)]);
        let variances = parallel.variances(&[true; 3]);
        assert!(variances[0].is_infinite() && variances[1].is_infinite() && variances[2].is_finite());
    }
}
