//! The wire form of a [`Geometry`]: plain data in a node's parameters. The pixels of a normal map are sent as a blob.
//!
//! `Geometry::from_spec(&geometry.spec(), map)` gives the same geometry, bit for bit, if `map` is
//! [`super::NormalMap::to_image`] of its normal map (`None` for a sphere).

use super::{Camera, Circle, Geometry, SceneError};
use crate::image::Image;
use serde::{Deserialize, Serialize};

/// Describes a [`Geometry`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct GeometrySpec {
    /// Columns of the photo.
    pub width: u32,
    /// Rows of the photo.
    pub height: u32,
    /// The camera that took the photo.
    pub camera: CameraSpec,
    /// The surface of the object.
    pub surface: SurfaceSpec,
}

/// Describes a [`Camera`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CameraSpec {
    /// Parallel rays.
    Orthographic,
    /// A pinhole.
    Perspective {
        /// Vertical field of view in degrees.
        vertical_fov_deg: f64,
    },
}

/// Describes a surface.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SurfaceSpec {
    /// The unit sphere that fills a circle of the photo, in pixels.
    Sphere {
        /// Centre, from the left edge.
        x: f64,
        /// Centre, from the top edge.
        y: f64,
        /// Radius.
        radius: f64,
    },
    /// A normal map of the photo's size, whose pixels are sent as a blob.
    Normals,
}

impl Geometry {
    /// The wire form of this geometry.
    #[must_use]
    pub fn spec(&self) -> GeometrySpec {
        let camera = match self.camera() {
            Camera::Orthographic => CameraSpec::Orthographic,
            Camera::Perspective { vertical_fov_deg } => CameraSpec::Perspective { vertical_fov_deg },
        };
        let surface = match self.circle() {
            Some(Circle { x, y, radius }) => SurfaceSpec::Sphere { x, y, radius },
            None => SurfaceSpec::Normals,
        };
        // No image in memory has more columns or rows.
        let side = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
        GeometrySpec { width: side(self.width()), height: side(self.height()), camera, surface }
    }

    /// The geometry that `spec` describes, with the pixels of its normal map if it has one.
    ///
    /// # Errors
    /// [`SceneError::MissingNormals`] if the map is missing, [`SceneError::Size`] if it has another size, and those of
    /// [`Geometry::sphere`] and [`Geometry::normals`].
    pub fn from_spec(spec: &GeometrySpec, normals: Option<&Image>) -> Result<Self, SceneError> {
        let (width, height) = (spec.width as usize, spec.height as usize);
        let camera = match spec.camera {
            CameraSpec::Orthographic => Camera::Orthographic,
            CameraSpec::Perspective { vertical_fov_deg } => Camera::perspective(vertical_fov_deg)?,
        };
        match (spec.surface, normals) {
            (SurfaceSpec::Sphere { x, y, radius }, _) => Self::sphere(width, height, Circle { x, y, radius }, camera),
            (SurfaceSpec::Normals, None) => Err(SceneError::MissingNormals { width, height }),
            (SurfaceSpec::Normals, Some(map)) if (map.width(), map.height()) != (width, height) => {
                let (found_width, found_height) = (map.width(), map.height());
                Err(SceneError::Size { what: "normal map", width, height, found_width, found_height })
            }
            (SurfaceSpec::Normals, Some(map)) => Self::normals(map, camera),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_wire_form_keeps_spheres_and_maps_bit_for_bit() {
        let camera = Camera::Perspective { vertical_fov_deg: 33.3 };
        let sphere = Geometry::sphere(64, 48, Circle { x: 30.1, y: 20.2, radius: 15.3 }, camera).unwrap();
        let text = serde_json::to_string(&sphere.spec()).unwrap();
        assert_eq!(Geometry::from_spec(&serde_json::from_str(&text).unwrap(), None), Ok(sphere));

        let map = Image::from_pixels(3, 2, vec![[0.1, 0.2, 0.97]; 6]);
        let surface = Geometry::normals(&map, Camera::Orthographic).unwrap();
        let pixels = surface.normal_map().unwrap().to_image();
        let text = serde_json::to_string(&surface.spec()).unwrap();
        assert_eq!(text, r#"{"width":3,"height":2,"camera":"orthographic","surface":"normals"}"#);
        assert_eq!(Geometry::from_spec(&serde_json::from_str(&text).unwrap(), Some(&pixels)), Ok(surface));
    }

    #[test]
    fn a_hostile_description_is_an_error_not_a_panic() {
        let spec = |width, surface, fov| GeometrySpec {
            width,
            height: 8,
            camera: CameraSpec::Perspective { vertical_fov_deg: fov },
            surface,
        };
        let sphere = SurfaceSpec::Sphere { x: f64::NAN, y: 0.0, radius: -1.0 };
        assert!(matches!(Geometry::from_spec(&spec(8, sphere, 30.0), None), Err(SceneError::Circle { .. })));
        assert!(matches!(
            Geometry::from_spec(&spec(8, SurfaceSpec::Normals, f64::NAN), None),
            Err(SceneError::Camera { .. })
        ));
        let missing = Geometry::from_spec(&spec(8, SurfaceSpec::Normals, 30.0), None);
        assert_eq!(missing, Err(SceneError::MissingNormals { width: 8, height: 8 }));
        let other = Geometry::from_spec(&spec(9, SurfaceSpec::Normals, 30.0), Some(&Image::new(8, 8)));
        assert!(matches!(other, Err(SceneError::Size { found_width: 8, width: 9, .. })));
    }
}
