//! The smallest and largest inputs that a scene is made of; the errors state them.

/// A telephoto lens of 0.1 degrees sees parallel rays to 1e-3 radians.
pub(super) const LEAST_FOV_DEG: f64 = 0.1;

/// Beyond this a flat image plane is no longer a camera anyone has.
pub(super) const MOST_FOV_DEG: f64 = 170.0;

/// Pixels along the shorter side of the smallest photo.
pub(super) const LEAST_SIDE: usize = 2;

/// Pixels of coverage below which a circle means nothing.
pub(super) const LEAST_AREA: f64 = 20.0;
