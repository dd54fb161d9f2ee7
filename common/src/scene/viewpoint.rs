//! Where the camera stands, as seen from the surface.

use crate::math::{Vec3, elementary::acos};

/// A camera for which the direction to it follows from the surface normal, so that everything seen of a convex object under distant
/// light is a function of the normal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Viewpoint {
    /// Parallel rays; the unit direction to the camera.
    Distant(Vec3),
    /// A pinhole that sees the unit sphere; its position relative to the sphere's centre, farther away than 1.
    OfSphere(Vec3),
}

impl Viewpoint {
    /// The unit normal in the middle of the visible ones.
    #[must_use]
    pub fn axis(self) -> Vec3 {
        match self {
            Self::Distant(view) => view,
            Self::OfSphere(position) => position.normalize(),
        }
    }

    /// The largest angle between the axis and a visible normal, in radians.
    #[must_use]
    pub fn reach_rad(self) -> f64 {
        match self {
            Self::Distant(_) => std::f64::consts::FRAC_PI_2,
            Self::OfSphere(position) => acos(1.0 / position.length()),
        }
    }

    /// The unit direction to the camera from the point that has this unit normal.
    #[must_use]
    pub fn view(self, normal: Vec3) -> Vec3 {
        match self {
            Self::Distant(view) => view,
            Self::OfSphere(position) => (position - normal).normalize(),
        }
    }
}
