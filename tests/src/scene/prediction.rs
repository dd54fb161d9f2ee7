//! How far noise moves the result of a fit: the linear prediction of the parameters' standard deviations.
//!
//! Eq. 1 weighs pixels by `W = diag(w)`, which is not the inverse of the noise's covariance `S`. The minimum moves by
//! `-(J'WJ)^-1 J'W n`, so its covariance is the sandwich `(J'WJ)^-1 (J'W S W J) (J'WJ)^-1`; with `W = S^-1` it would
//! be `(J'WJ)^-1` alone. `J` holds the derivatives of the compressed radiance, `S` the variance of the compressed noise.

use super::photograph::Photograph;
use lookalike::{
    brdf::{Model, flat_bounds},
    metric::cost::Compression,
    render::table::TransportTable,
};

/// Covariance of the parameters, `n x n`; zero for parameters at a bound, which noise does not move to first order.
#[derive(Debug, Clone)]
pub struct Prediction {
    n: usize,
    covariance: Vec<f64>,
}

impl Prediction {
    /// The prediction at the true parameters.
    ///
    /// # Panics
    /// When the photo does not determine the parameters.
    #[must_use]
    pub fn new(
        model: &dyn Model,
        truth: &[f64],
        table: &TransportTable,
        photo: &Photograph,
        compression: &Compression,
    ) -> Self {
        let (lower, upper) = flat_bounds(model.parameters());
        let free: Vec<usize> = (0..truth.len()).filter(|&i| lower[i] < truth[i] && truth[i] < upper[i]).collect();
        let derivatives: Vec<_> = free.iter().map(|&i| derivative(model, truth, table, i)).collect();
        let mut radiance = table.planes();
        table.radiance(model, truth, &mut radiance);
        let k = free.len();
        let (mut bread, mut meat) = (vec![0.0; k * k], vec![0.0; k * k]);
        for channel in 0..3 {
            for (p, w) in photo.subset.weights.iter().enumerate() {
                let (_, slope) = compression.apply_with_slope(radiance[channel][p]);
                let row: Vec<f64> = derivatives.iter().map(|d| slope * d[channel][p]).collect();
                let variance = slope * slope * photo.variance;
                for (a, b) in (0..k).flat_map(|a| (0..k).map(move |b| (a, b))) {
                    bread[a * k + b] += w * row[a] * row[b];
                    meat[a * k + b] += w * w * variance * row[a] * row[b];
                }
            }
        }
        let inverse = inverse(bread, k).expect("the photo determines the parameters");
        let sandwich = product(&product(&inverse, &meat, k), &inverse, k);
        let n = truth.len();
        let mut covariance = vec![0.0; n * n];
        for (a, &i) in free.iter().enumerate() {
            for (b, &j) in free.iter().enumerate() {
                covariance[i * n + j] = sandwich[a * k + b];
            }
        }
        Self { n, covariance }
    }

    /// Standard deviation of a linear combination of the parameters: `(entry, factor)` pairs.
    #[must_use]
    pub fn deviation(&self, combination: &[(usize, f64)]) -> f64 {
        let pairs = combination.iter().flat_map(|a| combination.iter().map(move |b| (a, b)));
        pairs.map(|(&(i, x), &(j, y))| x * y * self.covariance[i * self.n + j]).sum::<f64>().sqrt()
    }
}

/// Central difference of every pixel's radiance by one parameter.
fn derivative(model: &dyn Model, point: &[f64], table: &TransportTable, entry: usize) -> [Vec<f64>; 3] {
    let step = 1e-4 * point[entry];
    let at = |sign: f64| {
        let mut moved = point.to_vec();
        moved[entry] += sign * step;
        let mut planes = table.planes();
        table.radiance(model, &moved, &mut planes);
        planes
    };
    let (up, down) = (at(1.0), at(-1.0));
    std::array::from_fn(|c| up[c].iter().zip(&down[c]).map(|(u, d)| (u - d) / (2.0 * step)).collect())
}

fn product(a: &[f64], b: &[f64], n: usize) -> Vec<f64> {
    (0..n * n).map(|ij| (0..n).map(|k| a[ij / n * n + k] * b[k * n + ij % n]).sum()).collect()
}

/// Gauss & Jordan with row pivots; rows and columns are scaled to a unit diagonal first.
fn inverse(mut a: Vec<f64>, n: usize) -> Option<Vec<f64>> {
    let scale: Vec<f64> = (0..n).map(|i| 1.0 / a[i * n + i].sqrt()).collect();
    (0..n * n).for_each(|ij| a[ij] *= scale[ij / n] * scale[ij % n]);
    let mut b: Vec<f64> = (0..n * n).map(|ij| if ij / n == ij % n { 1.0 } else { 0.0 }).collect();
    for column in 0..n {
        let pivot = (column..n).max_by(|&i, &j| a[i * n + column].abs().total_cmp(&a[j * n + column].abs()))?;
        if a[pivot * n + column].abs() < 1e-12 || a[pivot * n + column].is_nan() {
            return None;
        }
        for k in 0..n {
            a.swap(column * n + k, pivot * n + k);
            b.swap(column * n + k, pivot * n + k);
        }
        let head = a[column * n + column];
        for k in 0..n {
            a[column * n + k] /= head;
            b[column * n + k] /= head;
        }
        for row in (0..n).filter(|&row| row != column) {
            let factor = a[row * n + column];
            for k in 0..n {
                a[row * n + k] -= factor * a[column * n + k];
                b[row * n + k] -= factor * b[column * n + k];
            }
        }
    }
    (0..n * n).for_each(|ij| b[ij] *= scale[ij / n] * scale[ij % n]);
    Some(b)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_matrix_times_its_inverse_is_one() {
        let a = vec![4.0, 1.0, 0.5, 1.0, 3e4, -2.0, 0.5, -2.0, 1e-2];
        let one = product(&a, &inverse(a.clone(), 3).unwrap(), 3);
        for (ij, x) in one.iter().enumerate() {
            assert!((x - if ij % 4 == 0 { 1.0 } else { 0.0 }).abs() < 1e-9, "{one:?}");
        }
        assert!(inverse(vec![1.0, 2.0, 2.0, 4.0], 2).is_none());
    }
}
