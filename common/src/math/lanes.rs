//! Arithmetic on a vector register of `f64`, whatever its length. Each operation is the plain IEEE one in every lane, so a result has the
//! same bits at every [level](super::simd::Level).

use pulp::Simd;
use std::ops::{Add, Div, Mul, Sub};

/// One register.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lanes<S: Simd> {
    simd: S,
    pub(crate) value: S::f64s,
}

/// Three registers: a vector in each lane.
pub(crate) type Lanes3<S> = [Lanes<S>; 3];

impl<S: Simd> Lanes<S> {
    #[inline(always)]
    pub(crate) fn new(simd: S, value: S::f64s) -> Self {
        Self { simd, value }
    }

    /// The same number in every lane.
    #[inline(always)]
    pub(crate) fn splat(simd: S, value: f64) -> Self {
        Self { simd, value: simd.splat_f64s(value) }
    }

    /// The same number in every lane of a register like another.
    #[inline(always)]
    pub(crate) fn splat_like(other: Self, value: f64) -> Self {
        Self::splat(other.simd, value)
    }

    /// `1 / x`, by a division.
    #[inline(always)]
    pub(crate) fn inverse(self) -> Self {
        Self::splat(self.simd, 1.0) / self
    }

    #[inline(always)]
    pub(crate) fn sqrt(self) -> Self {
        Self { value: self.simd.sqrt_f64s(self.value), ..self }
    }

    #[inline(always)]
    pub(crate) fn max(self, least: f64) -> Self {
        Self { value: self.simd.max_f64s(self.value, self.simd.splat_f64s(least)), ..self }
    }

    #[inline(always)]
    pub(crate) fn min(self, other: Self) -> Self {
        Self { value: self.simd.min_f64s(self.value, other.value), ..self }
    }

    /// 1 with the sign of each lane.
    #[inline(always)]
    pub(crate) fn signum(self) -> Self {
        let Self { simd, value } = self;
        let sign = simd.and_u64s(simd.transmute_u64s_f64s(value), simd.splat_u64s(1 << 63));
        Self { simd, value: simd.transmute_f64s_u64s(simd.or_u64s(sign, simd.splat_u64s(1.0_f64.to_bits()))) }
    }

    /// `yes` in the lanes in which this is less than `other`, `no` in the rest.
    #[inline(always)]
    pub(crate) fn if_less(self, other: Self, yes: Self, no: Self) -> Self {
        let Self { simd, value } = self;
        Self { simd, value: simd.select_f64s(simd.less_than_f64s(value, other.value), yes.value, no.value) }
    }
}

macro_rules! operator {
    ($trait:ident, $method:ident, $of_simd:ident) => {
        impl<S: Simd> $trait for Lanes<S> {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self { value: self.simd.$of_simd(self.value, other.value), ..self }
            }
        }

        impl<S: Simd> $trait<f64> for Lanes<S> {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: f64) -> Self {
                self.$method(Self::splat(self.simd, other))
            }
        }
    };
}

operator!(Add, add, add_f64s);
operator!(Sub, sub, sub_f64s);
operator!(Mul, mul, mul_f64s);
operator!(Div, div, div_f64s);

#[inline(always)]
pub(crate) fn dot<S: Simd>(a: Lanes3<S>, b: Lanes3<S>) -> Lanes<S> {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
pub(crate) fn cross<S: Simd>(a: Lanes3<S>, b: Lanes3<S>) -> Lanes3<S> {
    [a[1] * b[2] - b[1] * a[2], a[2] * b[0] - b[2] * a[0], a[0] * b[1] - b[0] * a[1]]
}
