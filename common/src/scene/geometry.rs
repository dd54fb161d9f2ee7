//! The surface in the photo, of any kind, as rendering needs it.

use super::coverage::pixel_coverage;
use super::limits::LEAST_SIDE;
use super::{Camera, Circle, NormalMap, SceneError, Sphere, SurfacePoint, Viewpoint};
use crate::image::Image;
use crate::math::Vec3;
use crate::math::arctangent::angle;

/// An object in a photo of a given size.
#[derive(Debug, Clone, PartialEq)]
pub struct Geometry {
    width: usize,
    height: usize,
    camera: Camera,
    surface: Surface,
}

/// The kinds of surface.
#[derive(Debug, Clone, PartialEq)]
enum Surface {
    Sphere(Sphere),
    Normals(NormalMap),
}

impl Geometry {
    /// The unit sphere that fills `circle` in a photo of `width` x `height` pixels; see [`Sphere`].
    ///
    /// # Errors
    /// [`SceneError::TooSmall`] below 2 x 2 pixels, [`SceneError::Circle`] and [`SceneError::Camera`] for values out of
    /// range, [`SceneError::CircleOutside`] if the circle lies outside the photo.
    pub fn sphere(width: usize, height: usize, circle: Circle, camera: Camera) -> Result<Self, SceneError> {
        check_size(width, height)?;
        let surface = Surface::Sphere(Sphere::new(width, height, circle, camera)?);
        Ok(Self { width, height, camera, surface })
    }

    /// The surface of a normal map (world-space unit normals, length 0 is background) for a photo of the map's size;
    /// see [`NormalMap`].
    ///
    /// # Errors
    /// [`SceneError::TooSmall`] below 2 x 2 pixels, and those of [`NormalMap::new`].
    pub fn normals(map: &Image, camera: Camera) -> Result<Self, SceneError> {
        let (width, height) = (map.width(), map.height());
        check_size(width, height)?;
        let surface = Surface::Normals(NormalMap::new(map, camera)?);
        Ok(Self { width, height, camera, surface })
    }

    /// Columns of the photo.
    #[must_use]
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows of the photo.
    #[must_use]
    pub fn height(&self) -> usize {
        self.height
    }

    /// The camera that took the photo.
    #[must_use]
    pub fn camera(&self) -> Camera {
        self.camera
    }

    /// The circle that the sphere fills; `None` for a normal map.
    #[must_use]
    pub fn circle(&self) -> Option<Circle> {
        match &self.surface {
            Surface::Sphere(sphere) => Some(sphere.circle()),
            Surface::Normals(_) => None,
        }
    }

    /// The normal map; `None` for a sphere.
    #[must_use]
    pub fn normal_map(&self) -> Option<&NormalMap> {
        match &self.surface {
            Surface::Sphere(_) => None,
            Surface::Normals(map) => Some(map),
        }
    }

    /// The camera, as seen from the surface; `None` if equal normals are seen from different directions.
    #[must_use]
    pub fn viewpoint(&self) -> Option<Viewpoint> {
        match &self.surface {
            Surface::Sphere(sphere) => Some(sphere.viewpoint()),
            Surface::Normals(_) => (self.camera == Camera::Orthographic).then_some(Viewpoint::Distant(Vec3::Z)),
        }
    }

    /// The surface at the point (x, y) of the photo: pixels from the top left corner, y down, so that pixel (c, r)
    /// covers \[c, c + 1\] x \[r, r + 1\]. `None` outside the object.
    #[must_use]
    #[inline]
    pub fn point(&self, x: f64, y: f64) -> Option<SurfacePoint> {
        match &self.surface {
            Surface::Sphere(sphere) => sphere.point(x, y),
            Surface::Normals(map) => map.point(x, y),
        }
    }

    /// The fraction of a pixel that the object covers, in \[0, 1\]: exactly 1 if the object covers all of it, else an
    /// estimate by 256 points of at most 255/256.
    #[must_use]
    pub fn coverage(&self, column: usize, row: usize) -> f32 {
        if let Some(circle) = self.circle() {
            // The silhouette lies inside the circle, so a pixel half a diagonal outside is empty.
            if circle.distance(column as f64 + 0.5, row as f64 + 0.5) > circle.radius + 0.708 {
                return 0.0;
            }
        }
        pixel_coverage(column, row, |x, y| self.point(x, y).is_some())
    }

    /// Whether a pixel surely shows only the object: it has full coverage and is not next to the edge of a normal map,
    /// whose place is known only to a pixel.
    #[must_use]
    pub fn is_interior(&self, column: usize, row: usize) -> bool {
        self.coverage(column, row) == 1.0 && self.normal_map().is_none_or(|map| map.is_interior(column, row))
    }

    /// How far the normal turns over a pixel against the half vector of a distant light, in radians: between the middles of the left and right edge,
    /// and of the top and bottom edge. The half vector turns against the normal by half as far as the direction to the camera
    /// does (by more for light at grazing angles). 0 where an edge's middle is not on the object.
    #[must_use]
    pub fn normal_turns(&self, column: usize, row: usize) -> [f64; 2] {
        let at = |x: f64, y: f64| self.point(column as f64 + x, row as f64 + y);
        [[(0.0, 0.5), (1.0, 0.5)], [(0.5, 0.0), (0.5, 1.0)]].map(|[from, to]| {
            at(from.0, from.1).zip(at(to.0, to.1)).map_or(0.0, |(a, b)| {
                let of_normal = angle(a.normal.cross(b.normal).length(), a.normal.dot(b.normal));
                of_normal + 0.5 * (a.view - b.view).length()
            })
        })
    }
}

fn check_size(width: usize, height: usize) -> Result<(), SceneError> {
    if width < LEAST_SIDE || height < LEAST_SIDE { Err(SceneError::TooSmall { width, height }) } else { Ok(()) }
}

#[cfg(test)]
mod tests;
