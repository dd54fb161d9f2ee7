//! The photographed object: its shape, its place in the photo, and the camera.
//!
//! [`Geometry`] gives the surface normal and the direction to the camera for a point of the photo. [`Capture`] joins it
//! with the photo and the light, and classifies each pixel as usable or with the reason why it is not.
//!
//! Conventions (design section 3): the world is right-handed with +Y up; the camera sits on +Z and looks along -Z;
//! pixel (column, row), top left first, covers \[column, column + 1\] x \[row, row + 1\], so x grows to the right with
//! +X and y grows downwards, against +Y.

mod camera;
mod capture;
mod circle;
mod coverage;
mod error;
mod fit;
mod geometry;
mod limits;
mod mask;
mod normals;
mod pixels;
mod placement;
mod plateau;
mod spec;
mod sphere;
mod surface;
mod viewpoint;

pub use camera::Camera;
pub use capture::{Capture, CaptureInput};
pub use circle::Circle;
pub use error::SceneError;
pub use fit::{CircleFit, fit_circle};
pub use geometry::Geometry;
pub use mask::Mask;
pub use normals::NormalMap;
pub use pixels::{PixelCounts, PixelStatus};
pub use placement::{CircleSource, Placement};
pub use plateau::plateau;
pub use spec::{CameraSpec, GeometrySpec, SurfaceSpec};
pub use sphere::Sphere;
pub use surface::SurfacePoint;
pub use viewpoint::Viewpoint;
