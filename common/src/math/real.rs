//! The operations that a formula needs in either precision.

use super::{
    elementary::{exp_bounded, exp_nonpositive_single, ln_positive},
    to_f32,
};
use std::{
    fmt::Debug,
    ops::{Add, AddAssign, Div, Mul, Sub, SubAssign},
};

/// `f64` or `f32`.
pub(crate) trait Real:
    Copy
    + PartialOrd
    + Debug
    + Send
    + Sync
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + AddAssign
    + SubAssign
{
    const ZERO: Self;
    const ONE: Self;
    /// The distance from 1 to the next larger number.
    const EPSILON: Self;

    /// A number, rounded.
    fn of(x: f64) -> Self;

    fn of_single(x: f32) -> Self;

    fn widen(self) -> f64;

    fn sqrt(self) -> Self;
    fn max(self, other: Self) -> Self;
    fn min(self, other: Self) -> Self;

    /// Not below `least` nor above `most`; NaN stays NaN.
    fn clamped(self, least: f64, most: f64) -> Self;

    /// e^x for x <= 0, in straight-line code that the compiler can vectorise; 0 below -708 (in single precision -87), just above where it falls
    /// below the smallest normal number.
    fn exp_nonpositive(self) -> Self;

    /// The natural logarithm of a positive number.
    fn ln_positive(self) -> Self;
}

macro_rules! real {
    ($name:ident, $of:expr, $exp:expr) => {
        impl Real for $name {
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
            const EPSILON: Self = Self::EPSILON;

            #[inline(always)]
            fn of(x: f64) -> Self {
                $of(x)
            }

            #[inline(always)]
            fn of_single(x: f32) -> Self {
                x.into()
            }

            #[inline(always)]
            fn widen(self) -> f64 {
                f64::from(self)
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
            fn clamped(self, least: f64, most: f64) -> Self {
                self.clamp($of(least), $of(most))
            }

            #[inline(always)]
            fn exp_nonpositive(self) -> Self {
                $exp(self)
            }

            #[inline(always)]
            fn ln_positive(self) -> Self {
                $of(ln_positive(f64::from(self)))
            }
        }
    };
}

real!(f64, std::convert::identity, exp_bounded);
real!(f32, to_f32, exp_nonpositive_single);
