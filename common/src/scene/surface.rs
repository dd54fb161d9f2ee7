//! A visible point of the object's surface.

use crate::math::Vec3;

/// A visible point of the surface. The normal faces the camera: `normal . view > 0`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// Unit normal, world.
    pub normal: Vec3,
    /// Unit vector towards the camera, world.
    pub view: Vec3,
}
