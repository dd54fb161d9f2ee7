//! Arithmetic on a vector register, whatever its length, of `f64` or `f32`. Each operation is the plain IEEE one in every lane, so a result
//! has the same bits at every [level](super::simd::Level).

use super::to_f32;
use pulp::Simd;
use std::ops::{Add, Div, Mul, Sub};

/// A kind of register: the instructions and the precision.
pub(crate) trait Vector: Copy + std::fmt::Debug {
    /// The register.
    type Register: Copy + std::fmt::Debug;

    fn splat(self, value: f64) -> Self::Register;
    /// The smallest positive number of the precision.
    fn least(self) -> Self::Register;
    fn add(self, a: Self::Register, b: Self::Register) -> Self::Register;
    fn sub(self, a: Self::Register, b: Self::Register) -> Self::Register;
    fn mul(self, a: Self::Register, b: Self::Register) -> Self::Register;
    fn div(self, a: Self::Register, b: Self::Register) -> Self::Register;
    fn sqrt(self, a: Self::Register) -> Self::Register;
    fn max(self, a: Self::Register, b: Self::Register) -> Self::Register;
    fn min(self, a: Self::Register, b: Self::Register) -> Self::Register;
    /// 1 with the sign of each lane.
    fn signum(self, a: Self::Register) -> Self::Register;
    /// `yes` in the lanes in which `a < b`, `no` in the rest.
    fn if_less(self, a: Self::Register, b: Self::Register, yes: Self::Register, no: Self::Register) -> Self::Register;
}

/// Registers of `f64`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Double<S: Simd>(pub(crate) S);

/// Registers of `f32`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Single<S: Simd>(pub(crate) S);

macro_rules! vector {
    ($name:ident, $register:ident, $narrow:expr, $least:expr, $splat:ident $add:ident $sub:ident $mul:ident $div:ident
        $sqrt:ident $max:ident $min:ident $less:ident $select:ident, $bits:ident $of_bits:ident $and:ident $or:ident
        $splat_bits:ident $sign:expr, $one:expr) => {
        impl<S: Simd> Vector for $name<S> {
            type Register = S::$register;

            #[inline(always)]
            fn splat(self, value: f64) -> Self::Register {
                self.0.$splat($narrow(value))
            }

            #[inline(always)]
            fn least(self) -> Self::Register {
                self.0.$splat($least)
            }

            #[inline(always)]
            fn add(self, a: Self::Register, b: Self::Register) -> Self::Register {
                self.0.$add(a, b)
            }

            #[inline(always)]
            fn sub(self, a: Self::Register, b: Self::Register) -> Self::Register {
                self.0.$sub(a, b)
            }

            #[inline(always)]
            fn mul(self, a: Self::Register, b: Self::Register) -> Self::Register {
                self.0.$mul(a, b)
            }

            #[inline(always)]
            fn div(self, a: Self::Register, b: Self::Register) -> Self::Register {
                self.0.$div(a, b)
            }

            #[inline(always)]
            fn sqrt(self, a: Self::Register) -> Self::Register {
                self.0.$sqrt(a)
            }

            #[inline(always)]
            fn max(self, a: Self::Register, b: Self::Register) -> Self::Register {
                self.0.$max(a, b)
            }

            #[inline(always)]
            fn min(self, a: Self::Register, b: Self::Register) -> Self::Register {
                self.0.$min(a, b)
            }

            #[inline(always)]
            fn signum(self, a: Self::Register) -> Self::Register {
                let simd = self.0;
                let sign = simd.$and(simd.$bits(a), simd.$splat_bits($sign));
                simd.$of_bits(simd.$or(sign, simd.$splat_bits($one)))
            }

            #[inline(always)]
            fn if_less(
                self,
                a: Self::Register,
                b: Self::Register,
                yes: Self::Register,
                no: Self::Register,
            ) -> Self::Register {
                self.0.$select(self.0.$less(a, b), yes, no)
            }
        }
    };
}

vector!(Double, f64s, std::convert::identity, f64::MIN_POSITIVE,
    splat_f64s add_f64s sub_f64s mul_f64s div_f64s sqrt_f64s max_f64s min_f64s less_than_f64s select_f64s,
    transmute_u64s_f64s transmute_f64s_u64s and_u64s or_u64s splat_u64s 1 << 63, 1.0_f64.to_bits());
vector!(Single, f32s, to_f32, f32::MIN_POSITIVE,
    splat_f32s add_f32s sub_f32s mul_f32s div_f32s sqrt_f32s max_f32s min_f32s less_than_f32s select_f32s,
    transmute_u32s_f32s transmute_f32s_u32s and_u32s or_u32s splat_u32s 1 << 31, 1.0_f32.to_bits());

/// One register.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lanes<V: Vector> {
    vector: V,
    pub(crate) value: V::Register,
}

/// Three registers: a vector in each lane.
pub(crate) type Lanes3<V> = [Lanes<V>; 3];

impl<V: Vector> Lanes<V> {
    #[inline(always)]
    pub(crate) fn new(vector: V, value: V::Register) -> Self {
        Self { vector, value }
    }

    /// The same number in every lane.
    #[inline(always)]
    pub(crate) fn splat(vector: V, value: f64) -> Self {
        Self { vector, value: vector.splat(value) }
    }

    /// The same number in every lane of a register like another.
    #[inline(always)]
    pub(crate) fn splat_like(other: Self, value: f64) -> Self {
        Self::splat(other.vector, value)
    }

    /// `1 / x`, by a division.
    #[inline(always)]
    pub(crate) fn inverse(self) -> Self {
        Self::splat(self.vector, 1.0) / self
    }

    #[inline(always)]
    pub(crate) fn sqrt(self) -> Self {
        Self { value: self.vector.sqrt(self.value), ..self }
    }

    #[inline(always)]
    pub(crate) fn max(self, least: f64) -> Self {
        Self { value: self.vector.max(self.value, self.vector.splat(least)), ..self }
    }

    /// At least the smallest positive number, so that it has an inverse.
    #[inline(always)]
    pub(crate) fn positive(self) -> Self {
        Self { value: self.vector.max(self.value, self.vector.least()), ..self }
    }

    #[inline(always)]
    pub(crate) fn min(self, other: Self) -> Self {
        Self { value: self.vector.min(self.value, other.value), ..self }
    }

    /// 1 with the sign of each lane.
    #[inline(always)]
    pub(crate) fn signum(self) -> Self {
        Self { value: self.vector.signum(self.value), ..self }
    }

    /// `yes` in the lanes in which this is less than `other`, `no` in the rest.
    #[inline(always)]
    pub(crate) fn if_less(self, other: Self, yes: Self, no: Self) -> Self {
        Self { value: self.vector.if_less(self.value, other.value, yes.value, no.value), ..self }
    }
}

macro_rules! operator {
    ($trait:ident, $method:ident) => {
        impl<V: Vector> $trait for Lanes<V> {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self { value: self.vector.$method(self.value, other.value), ..self }
            }
        }

        impl<V: Vector> $trait<f64> for Lanes<V> {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: f64) -> Self {
                $trait::$method(self, Self::splat(self.vector, other))
            }
        }
    };
}

operator!(Add, add);
operator!(Sub, sub);
operator!(Mul, mul);
operator!(Div, div);

#[inline(always)]
pub(crate) fn dot<V: Vector>(a: Lanes3<V>, b: Lanes3<V>) -> Lanes<V> {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
pub(crate) fn cross<V: Vector>(a: Lanes3<V>, b: Lanes3<V>) -> Lanes3<V> {
    [a[1] * b[2] - b[1] * a[2], a[2] * b[0] - b[2] * a[0], a[0] * b[1] - b[0] * a[1]]
}
