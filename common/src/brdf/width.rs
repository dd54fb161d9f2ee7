//! The width of a lobe as a function of a parameter.

use super::{Parameter, flat_bounds};
use crate::math::elementary::{exp, ln};

/// How the width of a lobe follows from one entry of the flat parameter vector, or from two.
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
    /// An entry `t` that widens the lobe: the width is then raised to the power of `1 - t`, and reaches 1 at `t = 1`.
    pub widened_by: Option<usize>,
}

impl Width {
    /// The entry is the width itself.
    #[must_use]
    pub const fn itself(entry: usize) -> Self {
        Self { entry, of: |x| x, inverse: |x| x, derivative: |_| 1.0, widened_by: None }
    }

    /// The width raised to the power of 1 minus an entry.
    #[must_use]
    pub const fn widened(self, entry: usize) -> Self {
        Self { widened_by: Some(entry), ..self }
    }

    /// The width at a flat parameter vector.
    #[must_use]
    pub fn at(&self, parameters: &[f64]) -> f64 {
        let width = (self.of)(parameters[self.entry]);
        self.widened_by.map_or(width, |t| exp(ln(width) * (1.0 - parameters[t])))
    }

    /// Calls `push(entry, derivative)` with the derivatives of the width.
    pub fn derivatives(&self, parameters: &[f64], mut push: impl FnMut(usize, f64)) {
        let slope = (self.derivative)(parameters[self.entry]);
        match self.widened_by {
            None => push(self.entry, slope),
            Some(t) => {
                let (core, widened) = ((self.of)(parameters[self.entry]), self.at(parameters));
                push(self.entry, slope * (1.0 - parameters[t]) * widened / core);
                push(t, -ln(core) * widened);
            }
        }
    }

    /// Smallest and largest width within the bounds of `parameters`.
    #[must_use]
    pub fn span(&self, parameters: &[Parameter]) -> (f64, f64) {
        let (lower, upper) = flat_bounds(parameters);
        self.span_of(&lower, &upper)
    }

    /// Smallest and largest width in a box of flat parameter vectors, whose corners are the smallest and the largest values.
    #[must_use]
    pub fn span_of(&self, lower: &[f64], upper: &[f64]) -> (f64, f64) {
        let (a, b) = ((self.of)(lower[self.entry]), (self.of)(upper[self.entry]));
        let (low, high) = (a.min(b), a.max(b));
        let raised = |width: f64, t: f64| exp(ln(width) * (1.0 - t));
        // Widths are at most 1, so that they grow with the entry that widens.
        self.widened_by.map_or((low, high), |t| (raised(low, lower[t]), raised(high, upper[t])))
    }

    /// Smallest and largest value of the entry whose width lies between two widths.
    #[must_use]
    pub fn entries(&self, (first, last): (f64, f64)) -> (f64, f64) {
        let (a, b) = ((self.inverse)(first), (self.inverse)(last));
        (a.min(b), a.max(b))
    }
}
