//! A point of the object's surface and the direction from which the camera sees it.

use crate::math::Vec3;

/// A surface point: unit normal and direction to the viewer, world space.
#[derive(Debug, Clone, Copy)]
pub struct Point {
    /// Surface normal.
    pub normal: Vec3,
    /// Towards the viewer.
    pub view: Vec3,
    /// Cosine of the angle between them, positive.
    pub cos_o: f64,
}

impl Point {
    /// A point seen from above the surface; `None` when the view is not above the horizon.
    #[must_use]
    pub fn new(normal: Vec3, view: Vec3) -> Option<Self> {
        let cos_o = normal.dot(view);
        (cos_o > 0.0).then_some(Self { normal, view, cos_o })
    }
}
