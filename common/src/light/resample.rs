//! Conversion of any layout to the canonical lat-long map, with the energy kept.
//!
//! Each texel is the mean of the source over the texel's solid angle. The mean is a midpoint rule with at least three
//! points per source pixel in each direction, so that a light of one pixel is neither lost nor doubled. The source is
//! bilinear between pixel centres. Beyond its outermost centres, a cube face continues with its own edge pixels and a
//! ball with pixels whose centres lie inside it, so that the empty parts of the image contribute nothing.
//!
//! The size of the result follows the source's finest angular resolution: a cross with faces of F pixels gives 4F x 2F,
//! an angular map of S pixels S x S/2, a mirror ball of S pixels 1.6 S x 0.8 S.

use super::mapping::{face_place, face_position};
use super::{Environment, LightError, Mapping};
use crate::image::Image;
use crate::math::elementary::sin_cos;
use crate::math::{Rgb, Vec3, cell, narrow, widen};
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};

/// The environment of an image in the layout `mapping`, not rotated. A lat-long image is not resampled.
///
/// # Errors
/// [`LightError::Shape`] if the image cannot have that layout, [`LightError::Texel`] (with the place in the *source*)
/// for a pixel in use that is negative or not finite, [`LightError::Black`] if every texel is 0.
pub fn to_lat_long(image: Image, mapping: Mapping) -> Result<Environment, LightError> {
    mapping.check_shape(image.width(), image.height())?;
    if mapping == Mapping::LatLong {
        return Environment::new(image);
    }
    check_pixels(&image, mapping)?;
    let height = canonical_height(mapping, image.width());
    let source = Source { image: &image, mapping };
    let texels = (0..height).into_par_iter().flat_map_iter(|i| source.row(i, height)).collect();
    Environment::new(Image::from_pixels(2 * height, height, texels))
}

fn canonical_height(mapping: Mapping, width: usize) -> usize {
    match mapping {
        Mapping::LatLong => width / 2,
        Mapping::Cross => 2 * (width / 3),
        Mapping::Angular => width.div_ceil(2),
        Mapping::MirrorBall => (4 * width).div_ceil(5),
    }
}

fn check_pixels(image: &Image, mapping: Mapping) -> Result<(), LightError> {
    let (width, height) = (image.width(), image.height());
    for (index, &found) in image.pixels().iter().enumerate() {
        let (column, row) = (index % width, index / width);
        let is_bad = found.iter().any(|x| !x.is_finite() || *x < 0.0);
        if is_bad && is_used(mapping, width, height, column, row) {
            return Err(LightError::Texel { column, row, found });
        }
    }
    Ok(())
}

/// Whether the centre of a pixel has a direction.
fn is_used(mapping: Mapping, width: usize, height: usize, column: usize, row: usize) -> bool {
    mapping.direction([(column as f64 + 0.5) / width as f64, (row as f64 + 0.5) / height as f64]).is_some()
}

/// The image that texels are integrated from.
struct Source<'a> {
    image: &'a Image,
    mapping: Mapping,
}

impl Source<'_> {
    /// Row `i` of a lat-long map of 2 `height` x `height` texels.
    fn row(&self, i: usize, height: usize) -> Vec<[f32; 3]> {
        (0..2 * height).map(|j| narrow(self.texel(i, j, height))).collect()
    }

    fn texel(&self, i: usize, j: usize, height: usize) -> Rgb {
        let side = PI / height as f64;
        let (sin_theta, cos_theta) = sin_cos(side * (i as f64 + 0.5));
        let (s, c) = sin_cos(side * (j as f64 + 0.5));
        let centre = Vec3::new(sin_theta * s, cos_theta, -sin_theta * c);
        let pixels = self.mapping.lengths_per_radian(centre) * self.image.width() as f64 * side;
        let points = |extent: f64| cell((POINTS_PER_PIXEL * extent).ceil(), MOST_POINTS + 1).max(FEWEST_POINTS);
        let (rows, columns) = (points(pixels), points(pixels * sin_theta));
        let (mut sum, mut weight) = (Rgb::ZERO, 0.0);
        for a in 0..rows {
            let (sin_theta, cos_theta) = sin_cos(side * (i as f64 + (a as f64 + 0.5) / rows as f64));
            let mut row_sum = Rgb::ZERO;
            for b in 0..columns {
                let turns = (j as f64 + (b as f64 + 0.5) / columns as f64) / (2 * height) as f64;
                let (s, c) = sin_cos(TAU * turns);
                row_sum += self.radiance(Vec3::new(sin_theta * s, cos_theta, -sin_theta * c));
            }
            sum += row_sum * sin_theta;
            weight += sin_theta * columns as f64;
        }
        sum / weight
    }

    /// Bilinear radiance of the source from a direction.
    fn radiance(&self, d: Vec3) -> Rgb {
        if self.mapping == Mapping::Cross {
            return self.on_face(d);
        }
        let [x, y] = self.mapping.position(d);
        self.on_disk(x * self.image.width() as f64, y * self.image.height() as f64)
    }

    fn on_face(&self, d: Vec3) -> Rgb {
        let size = self.image.width() / 3;
        let (face, [a, b]) = face_position(d);
        let [column, row] = face_place(face).map(|place| cell(place, 4) * size);
        let along = |x: f64| ((0.5 + 0.5 * x) * size as f64 - 0.5).clamp(0.0, (size - 1) as f64);
        let (x, y) = (along(a), along(b));
        let (j, i) = (cell(x, size), cell(y, size));
        let (s, t) = (x - j as f64, y - i as f64);
        let fetch = |i: usize, j: usize| widen(self.image.pixel(column + j.min(size - 1), row + i.min(size - 1)));
        let upper = fetch(i, j) * (1.0 - s) + fetch(i, j + 1) * s;
        let lower = fetch(i + 1, j) * (1.0 - s) + fetch(i + 1, j + 1) * s;
        upper * (1.0 - t) + lower * t
    }

    /// Bilinear radiance at (x, y) in pixels, from the pixels whose centres lie in the disk.
    fn on_disk(&self, x: f64, y: f64) -> Rgb {
        let size = self.image.width();
        let along = |x: f64| (x - 0.5).clamp(0.0, (size - 1) as f64);
        let (fx, fy) = (along(x), along(y));
        let (j, i) = (cell(fx, size), cell(fy, size));
        let (s, t) = (fx - j as f64, fy - i as f64);
        let (mut sum, mut weight) = (Rgb::ZERO, 0.0);
        for (i, wi) in [(i, 1.0 - t), ((i + 1).min(size - 1), t)] {
            for (j, wj) in [(j, 1.0 - s), ((j + 1).min(size - 1), s)] {
                if is_used(self.mapping, size, size, j, i) {
                    sum += widen(self.image.pixel(j, i)) * (wi * wj);
                    weight += wi * wj;
                }
            }
        }
        if weight > 1e-6 {
            return sum / weight;
        }
        // No centre near (x, y) lies in the disk. One always does a pixel and a half closer to the middle.
        let half = 0.5 * size as f64;
        let (dx, dy) = (x - half, y - half);
        let shrink = 1.0 - 1.5 / (dx * dx + dy * dy).sqrt();
        self.on_disk(half + dx * shrink, half + dy * shrink)
    }
}

/// Points of the midpoint rule per source pixel, at the finest resolution of the source.
const POINTS_PER_PIXEL: f64 = 3.0;
/// The least number of points across a texel, for texels much smaller than a source pixel.
const FEWEST_POINTS: usize = 3;
/// The largest number of points across a texel, for the texels that contain the whole rim of a ball.
const MOST_POINTS: usize = 256;

#[cfg(test)]
mod tests;
