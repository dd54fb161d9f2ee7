//! A point of the object as the camera sees it.

use crate::math::Vec3;

/// A point of the surface as the camera sees it. The normal faces the camera: `normal . view > 0`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// Unit normal, world.
    pub normal: Vec3,
    /// Unit vector towards the camera, world.
    pub view: Vec3,
}
