//! A surface given by one normal per pixel, for shapes other than the sphere.
//!
//! Normals are world-space unit vectors; length 0 is background. Between pixel centres they are bilinear over the
//! pixels that show the object, and normalised. A point lies on the object where the indicator (1 on the object, 0
//! elsewhere), interpolated the same way, is at least one half. So an edge between two columns lies on the border of
//! the pixels, and a slanted edge cuts through pixels; coverage and normals agree.
//!
//! Only direct light is rendered: self-occlusion and inter-reflection are ignored. A normal that faces away from the
//! camera counts as background.

use super::camera::Pinhole;
use super::{Camera, SceneError, SurfacePoint};
use crate::image::Image;
use crate::math::{Vec3, cell, narrow, widen};

/// A map of normals for a photo of the same size.
#[derive(Debug, Clone, PartialEq)]
pub struct NormalMap {
    width: usize,
    height: usize,
    /// Unit, or 0 for the background.
    normals: Vec<[f32; 3]>,
    pinhole: Option<Pinhole>,
    warnings: Vec<String>,
}

impl NormalMap {
    /// The surface of a map of world-space normals, seen by `camera`.
    ///
    /// Vectors within 5 % of length 1 are normalised. Up to a tenth of the vectors may have another length (the
    /// smoothed edge of a rendered map): they become background, with a warning.
    ///
    /// # Errors
    /// [`SceneError::Normal`] for a vector that is not finite, [`SceneError::NormalLength`] if too many are not unit
    /// vectors, [`SceneError::NoSurface`] if no normal faces the camera, [`SceneError::Camera`] for a camera out of
    /// range.
    pub fn new(map: &Image, camera: Camera) -> Result<Self, SceneError> {
        camera.check()?;
        let (width, height) = (map.width(), map.height());
        let pinhole = camera.pinhole(width, height);
        let mut normals = vec![[0.0; 3]; width * height];
        let (mut total, mut odd, mut away) = (0, Vec::new(), 0);
        for (index, &found) in map.pixels().iter().enumerate() {
            let (column, row) = (index % width, index / width);
            if found.iter().any(|x| !x.is_finite()) {
                return Err(SceneError::Normal { column, row, found });
            }
            let length = widen(found).length();
            if length == 0.0 {
                continue;
            }
            total += 1;
            if (length - 1.0).abs() > LENGTH_TOLERANCE {
                odd.push((column, row, length));
                continue;
            }
            // A map that was normalised before is kept bit for bit.
            let normal = if (length - 1.0).abs() < ROUNDING { found } else { narrow(widen(found) / length) };
            if widen(normal).dot(view(pinhole, column as f64 + 0.5, row as f64 + 0.5)) > 0.0 {
                normals[index] = normal;
            } else {
                away += 1;
            }
        }
        if let Some(&(column, row, length)) = odd.first().filter(|_| 10 * odd.len() > total) {
            return Err(SceneError::NormalLength { count: odd.len(), total, column, row, length });
        }
        if total == odd.len() + away {
            return Err(SceneError::NoSurface);
        }
        Ok(Self { width, height, normals, pinhole, warnings: warnings(odd.len(), away) })
    }

    /// Warnings about the map, for the user.
    #[must_use]
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// The normals in use: `height x width x 3`, row-major, unit or 0.
    #[must_use]
    pub fn to_image(&self) -> Image {
        Image::from_pixels(self.width, self.height, self.normals.clone())
    }

    /// The surface at the point (x, y) of the photo, in pixels; `None` on the background and outside the map. The
    /// normal always faces the camera.
    #[must_use]
    #[inline]
    pub fn point(&self, x: f64, y: f64) -> Option<SurfacePoint> {
        if !(x >= 0.0 && y >= 0.0 && x <= self.width as f64 && y <= self.height as f64) {
            return None;
        }
        let (fx, fy) = ((x - 0.5).max(0.0), (y - 0.5).max(0.0));
        let (left, top) = (cell(fx, self.width), cell(fy, self.height));
        let (right, bottom) = ((left + 1).min(self.width - 1), (top + 1).min(self.height - 1));
        let (s, t) = ((fx - left as f64).min(1.0), (fy - top as f64).min(1.0));
        let (mut sum, mut weight) = (Vec3::ZERO, 0.0);
        for (column, row, w) in [
            (left, top, (1.0 - s) * (1.0 - t)),
            (right, top, s * (1.0 - t)),
            (left, bottom, (1.0 - s) * t),
            (right, bottom, s * t),
        ] {
            if self.is_object(column, row) {
                sum += widen(self.normals[row * self.width + column]) * w;
                weight += w;
            }
        }
        let view = view(self.pinhole, x, y);
        (weight >= 0.5 && sum.dot(view) > MOST_GRAZING * weight).then(|| SurfacePoint { normal: sum.normalize(), view })
    }

    /// Whether the pixel's centre shows the object.
    #[must_use]
    pub fn is_object(&self, column: usize, row: usize) -> bool {
        self.normals[row * self.width + column] != [0.0; 3]
    }

    /// Whether the pixel and its neighbours (eight; fewer at the border of the photo) show the object. The place of the
    /// edge of a map is known only to a pixel.
    #[must_use]
    pub fn is_interior(&self, column: usize, row: usize) -> bool {
        let around = |k: usize, count: usize| k.saturating_sub(1)..(k + 2).min(count);
        around(row, self.height).all(|r| around(column, self.width).all(|c| self.is_object(c, r)))
    }
}

fn view(pinhole: Option<Pinhole>, x: f64, y: f64) -> Vec3 {
    pinhole.map_or(Vec3::Z, |pinhole| -pinhole.ray(x, y))
}

fn warnings(odd: usize, away: usize) -> Vec<String> {
    let mut warnings = Vec::new();
    if odd > 0 {
        warnings.push(format!(
            "vectors of the normal map with a length other than 0 or 1 (a smoothed edge?): {odd}; taken as background"
        ));
    }
    if away > 0 {
        warnings.push(format!("normals of the normal map that face away from the camera: {away}; taken as background"));
    }
    warnings
}

/// Half-precision files keep three digits; vectors of a smoothed edge deviate by more than this.
const LENGTH_TOLERANCE: f64 = 0.05;

/// Ten times the change of a unit vector's length when it is rounded to single precision.
const ROUNDING: f64 = 1e-6;

/// The cosine below which opposite normals cancel or the surface is seen edge-on.
const MOST_GRAZING: f64 = 1e-9;

#[cfg(test)]
mod tests;
