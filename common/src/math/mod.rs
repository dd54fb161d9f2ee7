//! Vectors, elementary functions that give the same bits on every platform, shading frames, warps and low-discrepancy
//! points. Numbers are `f64`, and `f32` where pixels are stored and tables are integrated.

pub mod arctangent;
#[cfg(test)]
pub(crate) mod chi_square;
pub mod elementary;
pub mod frame;
pub mod hermite;
pub(crate) mod lanes;
pub(crate) mod real;
pub mod sampling;
pub mod simd;
pub mod warp;

/// A direction or position: world space unless the name says otherwise.
pub type Vec3 = glam::DVec3;
/// A rotation.
pub type Mat3 = glam::DMat3;
/// Linear Rec. 709 red, green, blue.
pub type Rgb = glam::DVec3;

/// Rec. 709 luminance of a linear colour.
#[must_use]
pub fn luminance(rgb: Rgb) -> f64 {
    rgb.dot(LUMINANCE_WEIGHTS)
}

/// Rec. 709 luminance weights of linear red, green, blue.
pub const LUMINANCE_WEIGHTS: Rgb = Rgb::new(0.2126, 0.7152, 0.0722);

/// Widens a stored pixel.
#[must_use]
pub fn widen(rgb: [f32; 3]) -> Rgb {
    Rgb::new(f64::from(rgb[0]), f64::from(rgb[1]), f64::from(rgb[2]))
}

/// Narrows a colour to the precision pixels are stored in.
#[must_use]
pub fn narrow(rgb: Rgb) -> [f32; 3] {
    [to_f32(rgb.x), to_f32(rgb.y), to_f32(rgb.z)]
}

/// Rounds to `f32`, the precision of stored pixels and tables.
#[must_use]
#[allow(clippy::cast_possible_truncation, reason = "rounding to f32 is what this function is for")]
pub fn to_f32(x: f64) -> f32 {
    x as f32
}

/// The index of the cell that `x` lies in, of `count` cells of width 1: `floor(x)` clamped to `0..count`. NaN gives 0.
#[must_use]
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturating, then clamped")]
pub fn cell(x: f64, count: usize) -> usize {
    (x.max(0.0) as usize).min(count.saturating_sub(1))
}
