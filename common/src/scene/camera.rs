//! The camera that took the photo.

use super::SceneError;
use super::limits::{LEAST_FOV_DEG, MOST_FOV_DEG};
use crate::math::Vec3;
use crate::math::elementary::tan;

/// The camera: on +Z, looking along -Z, with the photo's x along +X.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub enum Camera {
    /// Parallel rays.
    #[default]
    Orthographic,
    /// A pinhole whose axis passes through the middle of the photo; pixels are square.
    Perspective {
        /// Vertical field of view of the whole photo, in degrees.
        vertical_fov_deg: f64,
    },
}

impl Camera {
    /// A pinhole camera with this vertical field of view in degrees.
    ///
    /// # Errors
    /// [`SceneError::Camera`] outside \[0.1, 170\] degrees.
    pub fn perspective(vertical_fov_deg: f64) -> Result<Self, SceneError> {
        let camera = Self::Perspective { vertical_fov_deg };
        camera.check()?;
        Ok(camera)
    }

    /// Checks the field of view, because it is a public field that may hold any value.
    pub(super) fn check(self) -> Result<(), SceneError> {
        match self {
            Self::Perspective { vertical_fov_deg } if !(LEAST_FOV_DEG..=MOST_FOV_DEG).contains(&vertical_fov_deg) => {
                Err(SceneError::Camera { found: self.to_string() })
            }
            _ => Ok(()),
        }
    }

    /// The pinhole for a photo of this size; `None` for parallel rays.
    pub(super) fn pinhole(self, width: usize, height: usize) -> Option<Pinhole> {
        let Self::Perspective { vertical_fov_deg } = self else { return None };
        let (x, y) = (0.5 * width as f64, 0.5 * height as f64);
        Some(Pinhole { x, y, focal_px: y / tan(0.5 * vertical_fov_deg.to_radians()) })
    }
}

impl std::str::FromStr for Camera {
    type Err = SceneError;

    /// Reads `orthographic` or `perspective:FOV_DEG`.
    fn from_str(text: &str) -> Result<Self, SceneError> {
        let fault = || SceneError::Camera { found: text.to_owned() };
        match text.split_once(':') {
            None if text == "orthographic" => Ok(Self::Orthographic),
            Some(("perspective", degrees)) => {
                let degrees = degrees.trim().parse().map_err(|_| fault())?;
                Self::perspective(degrees).map_err(|_| fault())
            }
            _ => Err(fault()),
        }
    }
}

impl std::fmt::Display for Camera {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Orthographic => f.write_str("orthographic"),
            Self::Perspective { vertical_fov_deg } => write!(f, "perspective:{vertical_fov_deg}"),
        }
    }
}

/// The rays of a pinhole camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pinhole {
    /// The point of the photo on the axis, in pixels.
    pub(super) x: f64,
    pub(super) y: f64,
    /// Distance of the image plane, in pixels.
    pub(super) focal_px: f64,
}

impl Pinhole {
    /// The direction (unit) of the ray from the camera through a point of the photo.
    pub(super) fn ray(&self, x: f64, y: f64) -> Vec3 {
        Vec3::new(x - self.x, self.y - y, -self.focal_px).normalize()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_round_trips_and_invalid_text_is_quoted() {
        for camera in [Camera::Orthographic, Camera::Perspective { vertical_fov_deg: 27.5 }] {
            assert_eq!(camera.to_string().parse(), Ok(camera));
        }
        for bad in [
            "",
            "Orthographic",
            "perspective",
            "perspective:",
            "perspective:x",
            "perspective:0",
            "perspective:180",
            "perspective:NaN",
        ] {
            let message = bad.parse::<Camera>().unwrap_err().to_string();
            assert!(message.contains(&format!("`{bad}`")) && message.contains("perspective:FOV_DEG"), "{message}");
        }
    }

    #[test]
    fn rays_open_to_the_field_of_view_with_y_up() {
        let pinhole = Camera::Perspective { vertical_fov_deg: 90.0 }.pinhole(200, 100).unwrap();
        assert!((pinhole.focal_px - 50.0).abs() < 1e-12);
        assert_eq!(pinhole.ray(100.0, 50.0), -Vec3::Z);
        let half = std::f64::consts::FRAC_1_SQRT_2;
        assert!((pinhole.ray(100.0, 0.0) - Vec3::new(0.0, half, -half)).length() < 1e-12);
        assert!(pinhole.ray(150.0, 50.0).x > 0.0);
        assert_eq!(Camera::Orthographic.pinhole(200, 100), None);
    }
}
