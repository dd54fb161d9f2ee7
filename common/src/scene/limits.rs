//! The limits of a scene's inputs, which the errors state.

/// With 0.1 degrees the rays are parallel to 1e-3 radians.
pub(super) const LEAST_FOV_DEG: f64 = 0.1;

/// Above any real lens with a flat image plane.
pub(super) const MOST_FOV_DEG: f64 = 170.0;

/// The least number of pixels per side of a photo.
pub(super) const LEAST_SIDE: usize = 2;

/// The least coverage, in pixels, to which a circle is fitted.
pub(super) const LEAST_AREA: f64 = 20.0;
