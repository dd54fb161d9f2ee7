//! The built-in object: a sphere of radius 1 at the origin that fills a given circle of the photo.
//!
//! Orthographic: the normal at the point (x, y) of the photo has the components (x - cx)/R, (cy - y)/R.
//!
//! Perspective: the distance of the camera follows from the circle. The axis of the camera passes through the middle of
//! the photo along -Z, even if the circle lies elsewhere. The camera then sees the sphere obliquely, as it did when the
//! photo was taken. In the scene the camera is moved sideways and the sphere stays at the origin, which is the same
//! because the light is infinitely far away. The silhouette of such a sphere is an ellipse, longest along the line from
//! the middle of the photo through the centre of the circle. It touches the circle at both ends of that line and lies
//! inside it. In the middle of the photo ellipse and circle are the same.

use super::camera::Pinhole;
use super::{Camera, Circle, SceneError, SurfacePoint, Viewpoint};
use crate::math::Vec3;
use crate::math::arctangent::angle;
use crate::math::elementary::sin_cos;

/// A sphere as it appears in a photo.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sphere {
    circle: Circle,
    view: View,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum View {
    Orthographic { per_pixel: f64 },
    Perspective { pinhole: Pinhole, position: Vec3 },
}

impl Sphere {
    /// The sphere that fills `circle` in a photo of `width` x `height` pixels taken by `camera`.
    ///
    /// # Errors
    /// [`SceneError::Circle`] or [`SceneError::Camera`] for values out of range, [`SceneError::CircleOutside`] if the
    /// circle lies outside the photo.
    pub fn new(width: usize, height: usize, circle: Circle, camera: Camera) -> Result<Self, SceneError> {
        let Circle { x, y, radius } = Circle::new(circle.x, circle.y, circle.radius)?;
        camera.check()?;
        if !circle.meets(width, height) {
            return Err(SceneError::CircleOutside { x, y, radius, width, height });
        }
        let view = match camera.pinhole(width, height) {
            None => View::Orthographic { per_pixel: 1.0 / radius },
            Some(pinhole) => View::Perspective { pinhole, position: position(circle, pinhole) },
        };
        Ok(Self { circle, view })
    }

    /// The circle that the silhouette touches.
    #[must_use]
    pub fn circle(&self) -> Circle {
        self.circle
    }

    /// The camera, as seen from the sphere.
    #[must_use]
    pub fn viewpoint(&self) -> Viewpoint {
        match self.view {
            View::Orthographic { .. } => Viewpoint::Distant(Vec3::Z),
            View::Perspective { position, .. } => Viewpoint::OfSphere(position),
        }
    }

    /// The surface at the point (x, y) of the photo, in pixels; `None` outside the sphere. The normal always faces the
    /// camera.
    #[must_use]
    #[inline]
    pub fn point(&self, x: f64, y: f64) -> Option<SurfacePoint> {
        let (nearest, ray) = match self.view {
            View::Orthographic { per_pixel } => {
                let (dx, dy) = (x - self.circle.x, self.circle.y - y);
                (Vec3::new(dx * per_pixel, dy * per_pixel, 0.0), -Vec3::Z)
            }
            View::Perspective { pinhole, position } => {
                let ray = pinhole.ray(x, y);
                (position - ray * position.dot(ray), ray)
            }
        };
        // From the point of the ray nearest to the sphere's centre, back along the ray to the surface.
        let square = 1.0 - nearest.length_squared();
        (square > 0.0).then(|| SurfacePoint { normal: nearest - ray * square.sqrt(), view: -ray })
    }
}

/// The position of the camera, relative to the sphere's centre.
fn position(circle: Circle, pinhole: Pinhole) -> Vec3 {
    let (right, up) = (circle.x - pinhole.x, pinhole.y - circle.y);
    let offset = (right * right + up * up).sqrt();
    let [right, up] = if offset > 0.0 { [right / offset, up / offset] } else { [1.0, 0.0] };
    // The cone of the silhouette, in the plane through the camera's axis and the circle's centre.
    let near = angle(offset - circle.radius, pinhole.focal_px);
    let far = angle(offset + circle.radius, pinhole.focal_px);
    let (sin_axis, cos_axis) = sin_cos(0.5 * (near + far));
    let (sin_half, _) = sin_cos(0.5 * (far - near));
    Vec3::new(-sin_axis * right, -sin_axis * up, cos_axis) / sin_half
}

#[cfg(test)]
mod tests;
