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
    /// Zero for a point without extent.
    pub turn: Turn,
}

/// How normal and view turn over the part of a pixel that a point stands for: their root mean square changes along the part's two sides,
/// whose products give their covariances.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Turn {
    /// Of the normal.
    pub normal: [Vec3; 2],
    /// Of the direction to the viewer.
    pub view: [Vec3; 2],
}

impl Point {
    /// A point seen from above the surface; `None` when the view is not above the horizon.
    #[must_use]
    pub fn new(normal: Vec3, view: Vec3) -> Option<Self> {
        let cos_o = normal.dot(view);
        (cos_o > 0.0).then_some(Self { normal, view, cos_o, turn: Turn::default() })
    }
}
