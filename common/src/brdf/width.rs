//! The width of a lobe as a function of a parameter.

use super::{Parameter, flat_bounds};

/// How the width of a lobe follows from one entry of the flat parameter vector.
///
/// Widths are GGX alphas or equivalent to them; tables have a grid in their logarithm. The parameter may be another quantity, such as the
/// exponent of a cosine, which grows as the lobe gets narrower.
#[derive(Debug, Clone, Copy)]
pub struct Width {
    /// The entry.
    pub entry: usize,
    /// The width at a value of the entry: positive and strictly monotone.
    pub of: fn(f64) -> f64,
    /// Its inverse: the value of the entry at a width.
    pub inverse: fn(f64) -> f64,
    /// Its derivative at a value of the entry.
    pub derivative: fn(f64) -> f64,
}

impl Width {
    /// The entry is the width itself.
    #[must_use]
    pub const fn itself(entry: usize) -> Self {
        Self { entry, of: |x| x, inverse: |x| x, derivative: |_| 1.0 }
    }

    /// The width at a flat parameter vector.
    #[must_use]
    pub fn at(&self, parameters: &[f64]) -> f64 {
        (self.of)(parameters[self.entry])
    }

    /// Smallest and largest width within the bounds of `parameters`.
    #[must_use]
    pub fn span(&self, parameters: &[Parameter]) -> (f64, f64) {
        let (lower, upper) = flat_bounds(parameters);
        let (a, b) = (self.at(&lower), self.at(&upper));
        (a.min(b), a.max(b))
    }

    /// Smallest and largest value of the entry whose width lies between two widths.
    #[must_use]
    pub fn entries(&self, (first, last): (f64, f64)) -> (f64, f64) {
        let (a, b) = ((self.inverse)(first), (self.inverse)(last));
        (a.min(b), a.max(b))
    }
}
