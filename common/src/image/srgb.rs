//! The sRGB transfer function (IEC 61966-2-1:1999), between display codes in [0, 1] and linear values in [0, 1].

use crate::math::elementary::{pow, pow_positive};

/// The linear value of a display code. `code` in [0, 1] gives [0, 1]; other values continue the two branches.
#[must_use]
pub fn to_linear(code: f64) -> f64 {
    if code <= 0.04045 { code / 12.92 } else { pow((code + 0.055) / 1.055, 2.4) }
}

/// The display code of a linear value. `linear` in [0, 1] gives [0, 1]; other values continue the two branches.
#[must_use]
pub fn from_linear(linear: f64) -> f64 {
    const EXPONENT: f64 = 1.0 / 2.4;
    if linear > 0.003_130_8 {
        1.055 * if linear <= 1.0 { pow_positive(linear, EXPONENT) } else { pow(linear, EXPONENT) } - 0.055
    } else {
        linear * 12.92
    }
}

/// The nearest 8-bit code of a linear value, after clamping to [0, 1]. NaN gives 0; writers reject it before.
#[must_use]
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to 0..=255 first")]
pub fn to_code(linear: f64) -> u8 {
    (from_linear(linear.clamp(0.0, 1.0)) * 255.0 + 0.5).clamp(0.0, 255.0) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_survives_the_round_trip() {
        for code in 0..=255u8 {
            assert_eq!(to_code(to_linear(f64::from(code) / 255.0)), code);
        }
        for code in 0..=65535u16 {
            let x = f64::from(code) / 65535.0;
            // The standard's two branches differ by 3e-8 where they join; elsewhere the error is rounding.
            assert!((from_linear(to_linear(x)) - x).abs() < 1e-7, "{x}");
        }
    }

    #[test]
    fn codes_are_rounded_to_the_nearest() {
        for code in 0..255u8 {
            let middle = to_linear((f64::from(code) + 0.5) / 255.0);
            assert_eq!(to_code(middle - 1e-6), code);
            assert_eq!(to_code(middle + 1e-6), code + 1);
        }
        assert_eq!(to_code(f64::INFINITY), 255);
        assert_eq!(to_code(-1.0), 0);
        assert_eq!(to_code(f64::NAN), 0);
        assert!(from_linear(f64::NAN).is_nan() && from_linear(f64::INFINITY) == f64::INFINITY);
    }
}
