//! The grid of lobe widths of a transport table, and interpolation on it.
//!
//! Knots are equally spaced in the logarithm of the width; between them, see [`hermite`].

use crate::math::{
    elementary::{exp, ln},
    hermite::{self, STENCIL, Stencil},
};

/// Knots per factor of two of width in tables of stage one.
///
/// Beckmann's exponential is the sharpest function of `ln m`: its largest error between knots is 1.3e-4 of its peak with six knots per
/// octave, and 2.8e-4 with the five of full-resolution tables (tested below).
pub const PER_OCTAVE: f64 = 6.0;

/// Limits of a grid that was received from a peer.
const MOST_KNOTS: usize = 4096;
const LARGEST_LN: f64 = 100.0;

/// Widths equally spaced in their logarithm; at least [`STENCIL`] of them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Knots {
    first_ln: f64,
    step_ln: f64,
    count: usize,
}

impl Knots {
    /// Knots from `lower` to `upper` (both knots themselves), at least `per_octave` per factor of two.
    ///
    /// # Panics
    /// Unless `0 < lower < upper`.
    #[must_use]
    pub fn covering(lower: f64, upper: f64, per_octave: f64) -> Self {
        assert!(0.0 < lower && lower < upper, "knots from {lower} to {upper}");
        let (first_ln, span_ln) = (ln(lower), ln(upper) - ln(lower));
        let intervals = (span_ln / std::f64::consts::LN_2 * per_octave).ceil().max(1.0);
        let count = crate::math::cell(intervals, usize::MAX).max(STENCIL - 1) + 1;
        Self { first_ln, step_ln: span_ln / (count - 1) as f64, count }
    }

    /// Number of knots.
    #[must_use]
    pub fn count(&self) -> usize {
        self.count
    }

    /// The width at a knot.
    #[must_use]
    pub fn width(&self, index: usize) -> f64 {
        exp(self.first_ln + self.step_ln * index as f64)
    }

    /// All widths, ascending.
    #[must_use]
    pub fn widths(&self) -> Vec<f64> {
        (0..self.count).map(|k| self.width(k)).collect()
    }

    /// Smallest and largest width.
    #[must_use]
    pub fn span(&self) -> (f64, f64) {
        (self.width(0), self.width(self.count - 1))
    }

    /// The plain numbers behind the grid: logarithm of the first width, step of the logarithm, count.
    #[must_use]
    pub fn to_parts(&self) -> (f64, f64, usize) {
        (self.first_ln, self.step_ln, self.count)
    }

    /// The grid from [`Self::to_parts`]; `None` when the numbers make no grid.
    #[must_use]
    pub fn from_parts(first_ln: f64, step_ln: f64, count: usize) -> Option<Self> {
        let knots = Self { first_ln, step_ln, count };
        let sized = (STENCIL..=MOST_KNOTS).contains(&count) && step_ln > 0.0;
        let ends = [first_ln, first_ln + step_ln * count as f64];
        (sized && ends.iter().all(|ln| ln.is_finite() && ln.abs() < LARGEST_LN)).then_some(knots)
    }

    /// Interpolation weights at a width, those of the slope per unit of its logarithm; a width outside the span is clamped to it.
    #[must_use]
    pub fn stencil(&self, width: f64) -> Stencil {
        let mut stencil = hermite::stencil((ln(width) - self.first_ln) / self.step_ln, self.count);
        stencil.slope.iter_mut().for_each(|w| *w /= self.step_ln);
        stencil
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn interpolate(knots: &Knots, f: impl Fn(f64) -> f64, width: f64) -> (f64, f64) {
        let s = knots.stencil(width);
        let at = |k: usize| f(knots.width(s.first + k));
        ((0..STENCIL).map(|k| s.value[k] * at(k)).sum(), (0..STENCIL).map(|k| s.slope[k] * at(k)).sum())
    }

    #[test]
    fn cubics_in_the_logarithm_are_reproduced_exactly_up_to_the_ends() {
        let knots = Knots::covering(0.005, 1.0, PER_OCTAVE);
        let f = |w: f64| 0.3 + ln(w) * (0.5 + ln(w) * (0.2 - 0.1 * ln(w)));
        let df = |w: f64| 0.5 + ln(w) * (0.4 - 0.3 * ln(w));
        for i in 0..=1000 {
            let w = exp(ln(0.005) * (1.0 - f64::from(i) / 1000.0));
            let (value, slope) = interpolate(&knots, f, w);
            assert!((value - f(w)).abs() < 1e-12 && (slope - df(w)).abs() < 1e-10, "{w}");
        }
    }

    #[test]
    fn a_lobe_is_interpolated_to_a_thousandth_of_its_peak() {
        // GGX's and Beckmann's distribution at a fixed half angle, as functions of their width.
        for per_octave in [PER_OCTAVE, 5.0] {
            lobe_is_interpolated(&Knots::covering(0.005, 1.0, per_octave));
        }
    }

    fn lobe_is_interpolated(knots: &Knots) {
        let t2: f64 = 0.1 * 0.1;
        let ggx = |a: f64| a * a * t2 / ((a * a + t2) * (a * a + t2));
        let beckmann = |m: f64| exp(-t2 / (m * m)) * t2 / (m * m);
        for i in 0..=1000 {
            let w = exp(ln(0.005) * (1.0 - f64::from(i) / 1000.0));
            assert!((interpolate(knots, ggx, w).0 - ggx(w)).abs() < 5e-5 * 0.25);
            assert!((interpolate(knots, beckmann, w).0 - beckmann(w)).abs() < 1e-3 * 0.37);
        }
    }

    #[test]
    fn a_coat_is_interpolated_on_few_knots() {
        use crate::render::spans::OTHERS_PER_OCTAVE;
        let knots = Knots::covering(0.005, 0.1, OTHERS_PER_OCTAVE);
        // Its values where the half vector is the normal, and at growing angles from it.
        for t2 in [0.0, 1e-6, 1e-4, 2.5e-3, 0.1] {
            let coat = |a: f64| -1.0 / ((a * a + t2) * ln(a));
            let worst = (0..=1000).map(|i| {
                let w = 0.005 * exp(ln(20.0) * f64::from(i) / 1000.0);
                (interpolate(&knots, coat, w).0 / coat(w) - 1.0).abs()
            });
            let worst = worst.fold(0.0, f64::max);
            assert!(worst < 7e-4, "{t2}: {worst:.1e}");
        }
    }

    #[test]
    fn the_slope_is_the_derivative_of_the_value() {
        let knots = Knots::covering(0.02, 0.2, 5.0);
        let f = |w: f64| 1.0 / (1.0 + w * w * 100.0);
        for w in [0.021, 0.05, 0.1, 0.19] {
            let h = 1e-5;
            let up = interpolate(&knots, f, w * exp(h)).0;
            let down = interpolate(&knots, f, w * exp(-h)).0;
            assert!((interpolate(&knots, f, w).1 - (up - down) / (2.0 * h)).abs() < 1e-7);
        }
    }
}
