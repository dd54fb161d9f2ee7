//! The operations that a formula needs in either precision.

use super::{
    elementary::{exp_nonpositive, ln_positive},
    to_f32,
};
use std::ops::{Add, Div, Mul, Sub};

/// `f64` or `f32`.
pub(crate) trait Real:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    /// A number, rounded.
    fn of(x: f64) -> Self;

    fn sqrt(self) -> Self;
    fn max(self, other: Self) -> Self;
    fn min(self, other: Self) -> Self;

    /// e^x for x <= 0, in straight-line code that the compiler can vectorise; 0 where it falls below the smallest normal number.
    fn exp_nonpositive(self) -> Self;

    /// The natural logarithm of a positive number.
    fn ln_positive(self) -> Self;
}

impl Real for f64 {
    #[inline(always)]
    fn of(x: f64) -> Self {
        x
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        self.sqrt()
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.max(other)
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.min(other)
    }

    #[inline(always)]
    fn exp_nonpositive(self) -> Self {
        exp_nonpositive(self)
    }

    #[inline(always)]
    fn ln_positive(self) -> Self {
        ln_positive(self)
    }
}

impl Real for f32 {
    #[inline(always)]
    fn of(x: f64) -> Self {
        to_f32(x)
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        self.sqrt()
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.max(other)
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.min(other)
    }

    /// As [`exp_nonpositive`] in double precision, with a polynomial of degree 6 (truncation below 2e-8); relative error below 3e-7, plus
    /// the rounding of `x`.
    #[inline(always)]
    fn exp_nonpositive(self) -> Self {
        // Adding 1.5 * 2^23 leaves the nearest integer in the low mantissa bits.
        const ROUND: f32 = 12_582_912.0;
        const LN2_HIGH: f32 = 0.693_359_4;
        const LN2_LOW: f32 = -2.121_944_4e-4;
        const LOWEST: f32 = -87.0;
        let x = if self < LOWEST { LOWEST } else { self };
        let shifted = x * std::f32::consts::LOG2_E + ROUND;
        let k = shifted - ROUND;
        let r = (x - k * LN2_HIGH) - k * LN2_LOW;
        let p = 1.0 / 120.0 + r * (1.0 / 720.0);
        let p = 1.0 + r * (1.0 + r * (0.5 + r * (1.0 / 6.0 + r * (1.0 / 24.0 + r * p))));
        let power = f32::from_bits(shifted.to_bits().wrapping_add(127) << 23);
        if self < LOWEST { 0.0 } else { p * power }
    }

    #[inline(always)]
    fn ln_positive(self) -> Self {
        to_f32(ln_positive(f64::from(self)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exponential_in_single_precision_is_that_of_the_same_number() {
        for k in 0..100_000 {
            let x = -0.000_87 * k as f32;
            let (found, exact) = (Real::exp_nonpositive(x), exp_nonpositive(f64::from(x)));
            assert!((f64::from(found) / exact - 1.0).abs() < 3e-7, "{x}: {found} {exact}");
        }
        assert_eq!(Real::exp_nonpositive(-90.0_f32), 0.0);
        assert_eq!(Real::exp_nonpositive(f32::NEG_INFINITY), 0.0);
    }
}
