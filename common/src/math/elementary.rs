//! Elementary functions from one portable implementation (`libm`), so that a result has the same bits on every
//! platform. The methods of `f64` (`x.exp()`, `x.powf(y)`, `x.sin()`, `x.cbrt()`, `x.powi(n)`) call the system's
//! library and must not be used where a result depends on them. `sqrt`, `floor` and `abs` are exact or correctly
//! rounded on every platform and may be used.

/// e^x.
#[must_use]
pub fn exp(x: f64) -> f64 {
    libm::exp(x)
}

/// Natural logarithm.
#[must_use]
pub fn ln(x: f64) -> f64 {
    libm::log(x)
}

/// x^y for x >= 0.
#[must_use]
pub fn pow(x: f64, y: f64) -> f64 {
    libm::pow(x, y)
}

/// x^y for a positive normal number x and a power below 1e300, in straight-line code: relative error below 1e-14 for x in \[1e-12, 1e12\]
/// and y in \[0, 1\].
#[must_use]
#[inline(always)]
pub fn pow_positive(x: f64, y: f64) -> f64 {
    exp_bounded(y * ln_positive(x))
}

/// Cube root.
#[must_use]
pub fn cbrt(x: f64) -> f64 {
    libm::cbrt(x)
}

/// Sine and cosine of an angle in radians.
#[must_use]
pub fn sin_cos(x: f64) -> (f64, f64) {
    libm::sincos(x)
}

/// Tangent of an angle in radians.
#[must_use]
pub fn tan(x: f64) -> f64 {
    libm::tan(x)
}

/// Angle in [0, pi] whose cosine is `x`; `x` is clamped to [-1, 1].
#[must_use]
pub fn acos(x: f64) -> f64 {
    libm::acos(x.clamp(-1.0, 1.0))
}

/// Angle in (-pi, pi] of the point (x, y).
#[must_use]
pub fn atan2(y: f64, x: f64) -> f64 {
    libm::atan2(y, x)
}

/// x^5, the power in Schlick's Fresnel term, by three multiplications.
#[must_use]
pub fn fifth_power(x: f64) -> f64 {
    let x2 = x * x;
    x2 * x2 * x
}

/// e^x for x <= 700, in straight-line code that the compiler can vectorise. The result is 0 for x < -708, just above where
/// e^x falls below the smallest normal number.
///
/// Cody-Waite reduction `x = k ln 2 + r`, |r| <= ln(2)/2, and the Taylor polynomial of degree 13 (truncation below 1e-17);
/// within 2 ulp of [`exp`].
#[must_use]
#[inline(always)]
pub fn exp_bounded(x: f64) -> f64 {
    // Adding 1.5 * 2^52 leaves the nearest integer in the low mantissa bits.
    const ROUND: f64 = 6_755_399_441_055_744.0;
    const LN2_HIGH: f64 = 6.931_471_803_691_238e-1;
    const LN2_LOW: f64 = 1.908_214_929_270_587_7e-10;
    let x_clamped = if x < -708.0 { -708.0 } else { x };
    let shifted = x_clamped * std::f64::consts::LOG2_E + ROUND;
    let k = shifted - ROUND;
    let r = (x_clamped - k * LN2_HIGH) - k * LN2_LOW;
    let mut p = 1.0 / 6_227_020_800.0;
    for inverse in [
        1.0 / 479_001_600.0,
        1.0 / 39_916_800.0,
        1.0 / 3_628_800.0,
        1.0 / 362_880.0,
        1.0 / 40_320.0,
        1.0 / 5_040.0,
        1.0 / 720.0,
        1.0 / 120.0,
        1.0 / 24.0,
        1.0 / 6.0,
        0.5,
        1.0,
        1.0,
    ] {
        p = p * r + inverse;
    }
    let power = f64::from_bits(shifted.to_bits().wrapping_add(1023) << 52);
    if x < -708.0 { 0.0 } else { p * power }
}

/// [`exp_bounded`] in single precision, for x <= 0; 0 for x < -87. A polynomial of degree 6 (relative truncation below 1.7e-7);
/// relative error below 3e-7.
#[must_use]
#[inline(always)]
pub fn exp_nonpositive_single(x: f32) -> f32 {
    // Adding 1.5 * 2^23 leaves the nearest integer in the low mantissa bits.
    const ROUND: f32 = 12_582_912.0;
    const LN2_HIGH: f32 = 0.693_359_4;
    const LN2_LOW: f32 = -2.121_944_4e-4;
    const LOWEST: f32 = -87.0;
    let x_clamped = if x < LOWEST { LOWEST } else { x };
    let shifted = x_clamped * std::f32::consts::LOG2_E + ROUND;
    let k = shifted - ROUND;
    let r = (x_clamped - k * LN2_HIGH) - k * LN2_LOW;
    let p = 1.0 / 120.0 + r * (1.0 / 720.0);
    let p = 1.0 + r * (1.0 + r * (0.5 + r * (1.0 / 6.0 + r * (1.0 / 24.0 + r * p))));
    let power = f32::from_bits(shifted.to_bits().wrapping_add(127) << 23);
    if x < LOWEST { 0.0 } else { p * power }
}

/// The natural logarithm of a positive normal number, in straight-line code that the compiler can vectorise or move out of
/// a loop.
///
/// The method of fdlibm: `x = 2^k m` with `m` in [sqrt(1/2), sqrt(2)), `s = (m - 1)/(m + 1)`, an odd polynomial in `s`; within 2 ulp of [`ln`].
#[must_use]
#[inline(always)]
pub fn ln_positive(x: f64) -> f64 {
    const LN2_HIGH: f64 = 6.931_471_803_691_238e-1;
    const LN2_LOW: f64 = 1.908_214_929_270_587_7e-10;
    // MAGIC is the bits of 2^52: with a small integer in its low bits it is 2^52 plus that integer. OFFSET is the bits
    // of 1 minus those of sqrt(1/2), the lower end of the range of `m`.
    const MAGIC: u64 = 0x4330_0000_0000_0000;
    const OFFSET: u64 = 0x0009_5f62_0000_0000;
    let bits = x.to_bits().wrapping_add(OFFSET);
    let k = f64::from_bits(MAGIC | (bits >> 52)) - (f64::from_bits(MAGIC) + 1023.0);
    let f = f64::from_bits((bits & 0x000f_ffff_ffff_ffff).wrapping_add(0x3ff0_0000_0000_0000 - OFFSET)) - 1.0;
    let s = f / (2.0 + f);
    let z = s * s;
    let mut r = 1.479_819_860_511_658_6e-1;
    for coefficient in [
        1.531_383_769_920_937_3e-1,
        1.818_357_216_161_805e-1,
        2.222_219_843_214_978_4e-1,
        2.857_142_874_366_239e-1,
        3.999_999_999_940_942e-1,
        6.666_666_666_666_735e-1,
    ] {
        r = r * z + coefficient;
    }
    let half = 0.5 * f * f;
    k * LN2_HIGH - ((half - (s * (half + r * z) + k * LN2_LOW)) - f)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ln_positive_is_within_two_ulp_of_ln() {
        for i in 0..200_000 {
            let u = crate::math::sampling::uniform(i);
            for x in [u, 1.0 - 1e-3 * u, 1.0 + u, exp(1400.0 * (u - 0.5))] {
                let (fast, exact) = (ln_positive(x), ln(x));
                assert!((fast - exact).abs() <= 2.0 * f64::EPSILON * exact.abs(), "{x}: {fast} {exact}");
            }
        }
        assert_eq!(ln_positive(1.0), 0.0);
        assert!((ln_positive(f64::MIN_POSITIVE) / ln(f64::MIN_POSITIVE) - 1.0).abs() < 1e-15);
    }

    #[test]
    fn exponential_in_single_precision_is_that_of_the_same_number() {
        for k in 0..100_000 {
            let x = -0.000_87 * k as f32;
            let (found, exact) = (exp_nonpositive_single(x), exp_bounded(f64::from(x)));
            assert!((f64::from(found) / exact - 1.0).abs() < 3e-7, "{x}: {found} {exact}");
        }
        assert_eq!(exp_nonpositive_single(-88.0), 0.0);
        assert_eq!(exp_nonpositive_single(f32::NEG_INFINITY), 0.0);
    }

    #[test]
    fn exp_bounded_is_within_two_ulp_of_exp() {
        for i in 0..200_000 {
            let size = crate::math::sampling::uniform(i) * crate::math::sampling::uniform(i + 1_000_000);
            for x in [-708.0 * size, 700.0 * size] {
                let (fast, exact) = (exp_bounded(x), exp(x));
                assert!((fast - exact).abs() <= 2.0 * f64::EPSILON * exact, "{x}: {fast} {exact}");
            }
        }
        assert_eq!(exp_bounded(0.0), 1.0);
        assert_eq!(exp_bounded(-1e9), 0.0);
        assert_eq!(exp_bounded(f64::NEG_INFINITY), 0.0);
    }

    #[test]
    fn powers_agree_with_libm() {
        for i in 0..100_000 {
            let (u, y) = (crate::math::sampling::uniform(i), crate::math::sampling::uniform(i + 1_000_000));
            let x = exp(55.0 * u - 27.5);
            assert!((pow_positive(x, y) / pow(x, y) - 1.0).abs() < 1e-14, "{x} {y}");
        }
    }
}
