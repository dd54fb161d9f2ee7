//! The position of the sun, and the soft edge that the garden and the room both use.

use lookalike::math::{Vec3, elementary::sin_cos};

/// Radians above the horizon, and from +Z towards +X.
pub(super) const SUN_ELEVATION: f64 = 0.375;
pub(super) const SUN_AZIMUTH: f64 = 0.42;

/// The unit direction of the sun's centre.
pub(super) fn sun_direction() -> Vec3 {
    let ((sin_elevation, cos_elevation), (sin_azimuth, cos_azimuth)) = (sin_cos(SUN_ELEVATION), sin_cos(SUN_AZIMUTH));
    Vec3::new(cos_elevation * sin_azimuth, sin_elevation, cos_elevation * cos_azimuth)
}

/// 0 below `low`, 1 above `high`, a cubic between.
pub(super) fn smooth_step(low: f64, high: f64, x: f64) -> f64 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
