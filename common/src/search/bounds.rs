//! The box of a search, and the scale of each coordinate inside it.
//!
//! A search works in *scaled* coordinates t; its caller uses *natural* coordinates x:
//!
//! | scale | x(t) | range of t |
//! |---|---|---|
//! | [`Scale::Unscaled`] | t | \[lower, upper\], either may be infinite |
//! | [`Scale::Linear`] | lower + t (upper - lower) | \[0, 1\] |
//! | [`Scale::Logarithmic`] | lower (upper / lower)^t | \[0, 1\] |
//! | [`Scale::OffsetLogarithmic`] | lower + s ((1 + 1/k)^t - 1), s = k (upper - lower), k = [`OFFSET`] | \[0, 1\] |
//!
//! This scaling differs from MATLAB's: the `ScaleMesh` of `patternsearch` derives a scale from the start and ignores
//! the bounds. With scaling by the bounds, one mesh size is the same fraction of every parameter's range, whatever its
//! unit, and does not depend on the start.
//!
//! Bounds map to bounds exactly: t = 0 is `lower` and t = 1 is `upper` to the bit. A range of one value (lower ==
//! upper) is a fixed parameter: its t is always 0.

use super::error::{SearchError, check_dimension};
use crate::math::elementary::{exp, ln};

/// The scale of a coordinate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    /// No scaling: a mesh size of 1 is one unit of the parameter.
    Unscaled,
    /// The range becomes \[0, 1\]; both bounds must be finite.
    Linear,
    /// The logarithm of the range becomes \[0, 1\]; both bounds must be finite and above 0.
    Logarithmic,
    /// About linear in the first hundredth of the range ([`OFFSET`]) and about logarithmic above it. Equal steps of a
    /// reflectance then look about equal, and the lower bound may be 0. Both bounds must be finite.
    OffsetLogarithmic,
}

/// The fraction of the range at which [`Scale::OffsetLogarithmic`] changes from linear to logarithmic.
pub const OFFSET: f64 = 0.01;

/// A box: lower <= upper in every coordinate, each with its scale. Never empty.
#[derive(Debug, Clone, PartialEq)]
pub struct Bounds {
    lower: Vec<f64>,
    upper: Vec<f64>,
    scales: Vec<Scale>,
}

impl Bounds {
    /// A box with a scale per coordinate.
    ///
    /// # Errors
    /// If the lengths differ, there is no coordinate, a range is empty or NaN, or a scale cannot map its range.
    pub fn new(lower: Vec<f64>, upper: Vec<f64>, scales: Vec<Scale>) -> Result<Self, SearchError> {
        if lower.is_empty() {
            return Err(SearchError::NoParameters);
        }
        check_dimension("the upper bound", lower.len(), upper.len())?;
        check_dimension("the list of scales", lower.len(), scales.len())?;
        for (index, scale) in scales.iter().enumerate() {
            check_range(index, lower[index], upper[index], *scale)?;
        }
        Ok(Self { lower, upper, scales })
    }

    /// A box with linear scales.
    ///
    /// # Errors
    /// As [`Bounds::new`].
    pub fn linear(lower: &[f64], upper: &[f64]) -> Result<Self, SearchError> {
        Self::new(lower.to_vec(), upper.to_vec(), vec![Scale::Linear; lower.len()])
    }

    /// Number of parameters, at least 1.
    #[must_use]
    pub fn dimension(&self) -> usize {
        self.lower.len()
    }

    /// Lower bounds, natural.
    #[must_use]
    pub fn lower(&self) -> &[f64] {
        &self.lower
    }

    /// Upper bounds, natural.
    #[must_use]
    pub fn upper(&self) -> &[f64] {
        &self.upper
    }

    /// Scales.
    #[must_use]
    pub fn scales(&self) -> &[Scale] {
        &self.scales
    }

    /// Whether a natural point has the box's dimension and lies in the box, bounds included. False for NaN.
    #[must_use]
    pub fn contains(&self, point: &[f64]) -> bool {
        point.len() == self.dimension() && self.check_inside(point).is_ok()
    }

    /// Clamps every coordinate of a natural point to its bounds; NaN stays NaN.
    pub fn clamp(&self, point: &mut [f64]) {
        for (i, x) in point.iter_mut().enumerate().take(self.dimension()) {
            *x = x.clamp(self.lower[i], self.upper[i]);
        }
    }

    /// Scaled value of coordinate `index` at the natural value `x`.
    #[must_use]
    pub fn to_scaled(&self, index: usize, x: f64) -> f64 {
        let (lower, upper) = (self.lower[index], self.upper[index]);
        match self.scales[index] {
            Scale::Unscaled => x,
            _ if lower == upper => 0.0,
            Scale::Linear => ((x - lower) / (upper - lower)).clamp(0.0, 1.0),
            Scale::Logarithmic => ((ln(x) - ln(lower)) / (ln(upper) - ln(lower))).clamp(0.0, 1.0),
            Scale::OffsetLogarithmic => (ln(1.0 + (x - lower) / offset(lower, upper)) / stretch()).clamp(0.0, 1.0),
        }
    }

    /// Natural value of coordinate `index` at the scaled value `t`, always inside the box.
    #[must_use]
    pub fn to_natural(&self, index: usize, t: f64) -> f64 {
        let (lower, upper) = (self.lower[index], self.upper[index]);
        let (first, last) = self.scaled_range(index);
        if t <= first {
            return lower;
        }
        if t >= last {
            return upper;
        }
        let x = match self.scales[index] {
            Scale::Unscaled => t,
            Scale::Linear => lower + t * (upper - lower),
            Scale::Logarithmic => exp(ln(lower) + t * (ln(upper) - ln(lower))),
            Scale::OffsetLogarithmic => lower + offset(lower, upper) * (exp(t * stretch()) - 1.0),
        };
        x.clamp(lower, upper)
    }

    /// Derivative dx/dt of coordinate `index` at the natural value `x`; 0 for a fixed, scaled parameter.
    #[must_use]
    pub fn scaled_derivative(&self, index: usize, x: f64) -> f64 {
        let (lower, upper) = (self.lower[index], self.upper[index]);
        match self.scales[index] {
            Scale::Unscaled => 1.0,
            Scale::Linear => upper - lower,
            Scale::Logarithmic => x * (ln(upper) - ln(lower)),
            Scale::OffsetLogarithmic => (x - lower + offset(lower, upper)) * stretch(),
        }
    }

    /// Smallest and largest scaled value of coordinate `index`.
    #[must_use]
    pub fn scaled_range(&self, index: usize) -> (f64, f64) {
        match self.scales[index] {
            Scale::Unscaled => (self.lower[index], self.upper[index]),
            _ if self.lower[index] == self.upper[index] => (0.0, 0.0),
            Scale::Linear | Scale::Logarithmic | Scale::OffsetLogarithmic => (0.0, 1.0),
        }
    }

    /// Largest difference of two natural points in any scaled coordinate.
    #[must_use]
    pub fn scaled_distance(&self, a: &[f64], b: &[f64]) -> f64 {
        (0..self.dimension()).map(|i| (self.to_scaled(i, a[i]) - self.to_scaled(i, b[i])).abs()).fold(0.0, f64::max)
    }

    /// Returns an error if the start has the wrong length or lies outside the box.
    pub(super) fn check_start(&self, start: &[f64]) -> Result<(), SearchError> {
        check_dimension("the start", self.dimension(), start.len())?;
        self.check_inside(start)
    }

    fn check_inside(&self, point: &[f64]) -> Result<(), SearchError> {
        for (index, &value) in point.iter().enumerate() {
            let (lower, upper) = (self.lower[index], self.upper[index]);
            if !(value.is_finite() && lower <= value && value <= upper) {
                return Err(SearchError::StartOutside { index, value, lower, upper });
            }
        }
        Ok(())
    }
}

/// `s` of [`Scale::OffsetLogarithmic`].
fn offset(lower: f64, upper: f64) -> f64 {
    OFFSET * (upper - lower)
}

/// The logarithm of `1 + 1/k` of [`Scale::OffsetLogarithmic`].
fn stretch() -> f64 {
    ln(1.0 + 1.0 / OFFSET)
}

fn check_range(index: usize, lower: f64, upper: f64, scale: Scale) -> Result<(), SearchError> {
    let is_ordered = lower <= upper && lower < f64::INFINITY && upper > f64::NEG_INFINITY;
    if !is_ordered {
        return Err(SearchError::EmptyRange { index, lower, upper });
    }
    let expected = match scale {
        Scale::Linear | Scale::OffsetLogarithmic if !(upper - lower).is_finite() => "finite bounds",
        Scale::Logarithmic if !(lower > 0.0 && upper.is_finite()) => "finite bounds above 0",
        _ => return Ok(()),
    };
    Err(SearchError::UnscalableRange { index, lower, upper, expected })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn example() -> Bounds {
        let scales = vec![Scale::Linear, Scale::Logarithmic, Scale::Unscaled, Scale::Linear, Scale::OffsetLogarithmic];
        Bounds::new(vec![-1.0, 0.005, f64::NEG_INFINITY, 0.7, 0.0], vec![3.0, 1.0, 9.0, 0.7, 2.0], scales).unwrap()
    }

    #[test]
    fn bounds_map_to_bounds_exactly_and_the_middle_to_the_mean_of_its_scale() {
        let bounds = example();
        for i in [0, 1, 3, 4] {
            let (first, last) = bounds.scaled_range(i);
            assert_eq!(bounds.to_natural(i, first), bounds.lower()[i]);
            assert_eq!(bounds.to_natural(i, last), bounds.upper()[i]);
            assert_eq!(bounds.to_scaled(i, bounds.lower()[i]), first);
            assert_eq!(bounds.to_scaled(i, bounds.upper()[i]), last);
        }
        assert_eq!(bounds.to_natural(0, 0.5), 1.0);
        assert!((bounds.to_natural(1, 0.5) - 0.005_f64.sqrt()).abs() < 1e-15);
        assert_eq!(bounds.to_natural(2, -40.0), -40.0);
        // A hundredth of the range is at t = ln 2 / ln 101.
        assert!((bounds.to_scaled(4, 0.02) - 0.150_190).abs() < 1e-6);
        assert!((bounds.to_natural(4, bounds.to_scaled(4, 0.02)) - 0.02).abs() < 1e-15);
        assert_eq!(bounds.scaled_range(3), (0.0, 0.0));
    }

    #[test]
    fn scaled_derivative_is_the_slope_of_the_map() {
        let bounds = example();
        for (i, t) in [(0, 0.3), (1, 0.3), (2, 0.3), (4, 0.0001), (4, 0.3)] {
            let h = 1e-6;
            let slope = (bounds.to_natural(i, t + h) - bounds.to_natural(i, t - h)) / (2.0 * h);
            let derivative = bounds.scaled_derivative(i, bounds.to_natural(i, t));
            assert!((slope - derivative).abs() < 1e-8 * derivative, "{i}: {slope} {derivative}");
        }
        assert_eq!(bounds.scaled_derivative(3, 0.7), 0.0);
    }

    #[test]
    fn faulty_boxes_are_refused_with_the_coordinate() {
        let refuse = |lower: f64, upper: f64, scale| Bounds::new(vec![lower], vec![upper], vec![scale]).unwrap_err();
        assert!(matches!(refuse(1.0, 0.0, Scale::Linear), SearchError::EmptyRange { index: 0, .. }));
        assert!(matches!(refuse(f64::NAN, 0.0, Scale::Linear), SearchError::EmptyRange { .. }));
        assert!(matches!(refuse(0.0, f64::INFINITY, Scale::Linear), SearchError::UnscalableRange { .. }));
        assert!(matches!(refuse(0.0, 1.0, Scale::Logarithmic), SearchError::UnscalableRange { .. }));
        assert_eq!(Bounds::linear(&[], &[]), Err(SearchError::NoParameters));
        assert!(matches!(Bounds::linear(&[0.0, 0.0], &[1.0]), Err(SearchError::Dimension { expected: 2, .. })));
    }

    #[test]
    fn a_point_is_inside_if_and_only_if_it_is_within_the_bounds() {
        let bounds = Bounds::linear(&[0.0, 0.0], &[1.0, 2.0]).unwrap();
        assert!(bounds.contains(&[0.0, 2.0]) && !bounds.contains(&[0.0, 2.1]) && !bounds.contains(&[f64::NAN, 1.0]));
        assert!(!bounds.contains(&[0.5]));
        let mut point = [-3.0, 5.0];
        bounds.clamp(&mut point);
        assert_eq!(point, [0.0, 2.0]);
        assert_eq!(bounds.scaled_distance(&[0.0, 0.0], &[0.1, 1.0]), 0.5);
    }
}
