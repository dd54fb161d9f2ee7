//! Pearson's chi-square test, for tests that compare samples with their density.

use super::Vec3;
use super::elementary::{exp, ln, sin_cos};
use std::f64::consts::{PI, TAU};

/// Outcome of a test.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ChiSquare {
    /// Sum of (observed - expected)^2 / expected.
    pub(crate) statistic: f64,
    /// Bins after pooling, less one.
    pub(crate) degrees_of_freedom: f64,
    /// Probability of a statistic at least this large if the samples follow the density.
    pub(crate) p_value: f64,
}

/// Compares counts with their expectations (of the same total). Consecutive bins are pooled until they expect at least
/// five. A count in bins whose pooled expectation is 0 gives p = 0.
pub(crate) fn chi_square(observed: &[u64], expected: &[f64]) -> ChiSquare {
    assert_eq!(observed.len(), expected.len());
    let (mut statistic, mut bins) = (0.0, 0.0);
    let (mut pooled_count, mut pooled_expected) = (0.0, 0.0);
    for (&count, &expectation) in observed.iter().zip(expected) {
        pooled_count += count as f64;
        pooled_expected += expectation;
        if pooled_expected >= 5.0 {
            statistic += (pooled_count - pooled_expected) * (pooled_count - pooled_expected) / pooled_expected;
            bins += 1.0;
            (pooled_count, pooled_expected) = (0.0, 0.0);
        }
    }
    if pooled_count > 0.0 || pooled_expected > 0.0 {
        statistic += (pooled_count - pooled_expected) * (pooled_count - pooled_expected) / pooled_expected.max(1e-9);
        bins += 1.0;
    }
    let degrees_of_freedom = f64::max(bins - 1.0, 1.0);
    let p_value = upper_gamma(0.5 * degrees_of_freedom, 0.5 * statistic);
    ChiSquare { statistic, degrees_of_freedom, p_value }
}

/// Bins on the sphere of directions: `rows` in theta from +Y, `columns` around +Y. The density of a bin is integrated
/// by a midpoint rule of `quadrature` x `quadrature` points.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SphereBins {
    pub(crate) rows: usize,
    pub(crate) columns: usize,
    pub(crate) quadrature: usize,
}

impl SphereBins {
    /// Tests `count` directions from `sample` against the density `pdf` per steradian. Returns the outcome and the
    /// integral of the density over the sphere.
    pub(crate) fn test(self, count: u32, sample: impl Fn(u32) -> Vec3, pdf: impl Fn(Vec3) -> f64) -> (ChiSquare, f64) {
        let mut observed = vec![0; self.rows * self.columns];
        for i in 0..count {
            let d = sample(i);
            let v = super::elementary::acos(d.y) / PI;
            let turns = super::elementary::atan2(d.x, -d.z) / TAU;
            let u = if turns < 0.0 { turns + 1.0 } else { turns };
            let (row, column) =
                (super::cell(v * self.rows as f64, self.rows), super::cell(u * self.columns as f64, self.columns));
            observed[row * self.columns + column] += 1;
        }
        let masses = self.masses(pdf);
        let total: f64 = masses.iter().sum();
        let expected: Vec<f64> = masses.iter().map(|m| m * f64::from(count)).collect();
        (chi_square(&observed, &expected), total)
    }

    fn masses(self, pdf: impl Fn(Vec3) -> f64) -> Vec<f64> {
        let (fine_rows, fine_columns) = (self.rows * self.quadrature, self.columns * self.quadrature);
        let area = PI / fine_rows as f64 * TAU / fine_columns as f64;
        let mut masses = vec![0.0; self.rows * self.columns];
        for i in 0..fine_rows {
            let (sin_theta, cos_theta) = sin_cos(PI * (i as f64 + 0.5) / fine_rows as f64);
            for j in 0..fine_columns {
                let (s, c) = sin_cos(TAU * (j as f64 + 0.5) / fine_columns as f64);
                let d = Vec3::new(sin_theta * s, cos_theta, -sin_theta * c);
                masses[i / self.quadrature * self.columns + j / self.quadrature] += pdf(d) * sin_theta * area;
            }
        }
        masses
    }
}

/// Regularised upper incomplete gamma function Q(a, x): series below a + 1, Lentz's continued fraction above
/// (Numerical Recipes, section 6.2).
fn upper_gamma(a: f64, x: f64) -> f64 {
    let scale = exp(a * ln(x.max(1e-300)) - x - libm::lgamma(a));
    if x < a + 1.0 {
        let (mut term, mut sum) = (1.0 / a, 1.0 / a);
        for n in 1..10_000 {
            term *= x / (a + f64::from(n));
            sum += term;
        }
        return 1.0 - scale * sum;
    }
    let mut b = x + 1.0 - a;
    let (mut c, mut d) = (1e300, 1.0 / b);
    let mut fraction = d;
    for n in 1..10_000 {
        let n = f64::from(n);
        let coefficient = -n * (n - a);
        b += 2.0;
        d = 1.0 / (coefficient * d + b);
        c = b + coefficient / c;
        fraction *= c * d;
    }
    scale * fraction
}

#[test]
fn p_values_match_the_published_table() {
    // 95 % points of the chi-square distribution (Abramowitz & Stegun, table 26.8).
    for (degrees, point) in [(1.0, 3.841_459), (5.0, 11.070_50), (30.0, 43.772_97), (100.0, 124.342_1)] {
        let p = upper_gamma(0.5 * degrees, 0.5 * point);
        assert!((p - 0.05).abs() < 1e-6, "{degrees}: {p}");
    }
}

#[test]
fn a_wrong_density_is_rejected_and_a_right_one_is_not() {
    let uniform = |i: u32| {
        let p = super::sampling::PointStream::new(super::sampling::key(&[5, u64::from(i)])).point(0);
        let y = 1.0 - 2.0 * p[0];
        let (s, c) = sin_cos(TAU * p[1]);
        let r = (1.0 - y * y).max(0.0).sqrt();
        Vec3::new(r * s, y, r * c)
    };
    let bins = SphereBins { rows: 8, columns: 16, quadrature: 8 };
    let (right, total) = bins.test(100_000, uniform, |_| 0.25 / PI);
    assert!((total - 1.0).abs() < 1e-3 && right.p_value > 1e-3, "{right:?} {total}");
    let (wrong, _) = bins.test(100_000, uniform, |d| 0.25 / PI * (1.0 + 0.1 * d.y));
    assert!(wrong.p_value < 1e-6 && wrong.statistic > wrong.degrees_of_freedom, "{wrong:?}");
}
