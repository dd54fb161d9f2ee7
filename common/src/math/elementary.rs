//! Elementary functions from one portable implementation (`libm`), so that a result has the same bits on every
//! platform. The methods of `f64` (`x.exp()`, `x.powf(y)`, `x.sin()`, `x.cbrt()`, `x.powi(n)`) go to the system's
//! library and must not be used where a result depends on them. `sqrt`, `floor`, `abs` and `hypot` of a short vector
//! through `sqrt` are exact or correctly rounded everywhere.

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
