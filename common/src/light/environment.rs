//! Radiance as a function of direction: a lat-long map, bilinear between texel centres (design section 3).
//!
//! Texel (i, j) of H x W covers theta in \[pi i/H, pi (i+1)/H\] from +Y and u in \[j/W, (j+1)/W\]; its value sits at
//! the centre. Columns wrap; across a pole the map continues at u + 1/2, so "row -1" is row 0 shifted by W/2. With
//! v = theta/pi a direction is `d = (sin(theta) sin(2 pi u), cos(theta), -sin(theta) cos(2 pi u))`: the image centre is
//! +Z, u = 1/4 is +X, the left and right edges are -Z.
//!
//! The texels are stored with a border of one texel (the wrapped columns, the rows beyond the poles), so that a look-up
//! needs no branches. They have a fourth channel, the node of the sampling density (see [`super::LightDistribution`]),
//! so that one look-up gives both radiance and density.
//!
//! A rotation is an offset in u that is added when directions are converted. The texels are not resampled.

use super::LightError;
use crate::image::Image;
use crate::math::elementary::sin_cos;
use crate::math::{Rgb, Vec3, arctangent::angle, to_f32, widen};
use std::f64::consts::{PI, TAU};

/// An environment map: incident radiance (linear Rec. 709) from every direction, infinitely far away.
#[derive(Debug, Clone, PartialEq)]
pub struct Environment {
    width: usize,
    height: usize,
    /// In [0, 360).
    rotation_deg: f64,
    rotation_turns: f64,
    /// Columns of the bordered grid.
    stride: usize,
    /// Width and height, for the look-up.
    size: [f64; 2],
    /// (height + 2) x (width + 2): red, green, blue, density node.
    nodes: Vec<[f32; 4]>,
}

/// The position of a direction among the texel centres.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    /// Index of the upper left node in the bordered grid.
    pub(super) node: usize,
    /// Position between the left (0) and right (1) node.
    pub(super) s: f64,
    /// Position between the upper (0) and lower (1) node.
    pub(super) t: f64,
}

impl Environment {
    /// The map of a canonical lat-long image, not rotated.
    ///
    /// # Errors
    /// [`LightError::Size`] for an empty image or an odd width, [`LightError::Texel`] for a texel that is negative or
    /// not finite, [`LightError::Black`] if every texel is 0.
    #[allow(clippy::needless_pass_by_value, reason = "the map replaces the image: callers should not keep both")]
    pub fn new(image: Image) -> Result<Self, LightError> {
        let (width, height) = (image.width(), image.height());
        if width < 2 || height < 1 || !width.is_multiple_of(2) {
            return Err(LightError::Size { width, height });
        }
        let is_bad = |texel: &[f32; 3]| texel.iter().any(|x| !x.is_finite() || *x < 0.0);
        if let Some(index) = image.pixels().iter().position(is_bad) {
            let found = image.pixels()[index];
            return Err(LightError::Texel { column: index % width, row: index / width, found });
        }
        if image.pixels().iter().all(|texel| *texel == [0.0; 3]) {
            return Err(LightError::Black);
        }
        let (stride, size) = (width + 2, [width as f64, height as f64]);
        let nodes = bordered_nodes(&image);
        Ok(Self { width, height, rotation_deg: 0.0, rotation_turns: 0.0, stride, size, nodes })
    }

    /// The same map rotated about +Y by `degrees`, right-handed: positive is anticlockwise seen from above, and 90
    /// brings the light at +Z to +X. Successive rotations add up; the texels do not change. `degrees` must be finite:
    /// any other value gives a rotation of 0.
    #[must_use]
    pub fn rotated(mut self, degrees: f64) -> Self {
        let sum = (self.rotation_deg + degrees).rem_euclid(360.0);
        // A small negative angle is rounded up to 360. A NaN fails the comparison too.
        self.rotation_deg = if sum < 360.0 { sum } else { 0.0 };
        self.rotation_turns = self.rotation_deg / 360.0;
        self
    }

    /// The rotation about +Y in degrees, in [0, 360); see [`Environment::rotated`].
    #[must_use]
    pub fn rotation_deg(&self) -> f64 {
        self.rotation_deg
    }

    /// Columns.
    #[must_use]
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    #[must_use]
    pub fn height(&self) -> usize {
        self.height
    }

    /// The texel of row `i` and column `j`, before rotation.
    ///
    /// # Panics
    /// If outside the map.
    #[must_use]
    pub fn texel(&self, i: usize, j: usize) -> [f32; 3] {
        assert!(i < self.height && j < self.width, "texel ({i}, {j}) of a map of {} x {}", self.height, self.width);
        let [r, g, b, _] = self.nodes[(i + 1) * self.stride + j + 1];
        [r, g, b]
    }

    /// The canonical lat-long image that [`Environment::new`] was given, before rotation.
    #[must_use]
    pub fn to_image(&self) -> Image {
        let texels = (0..self.height).flat_map(|i| (0..self.width).map(move |j| self.texel(i, j))).collect();
        Image::from_pixels(self.width, self.height, texels)
    }

    /// The direction (world, unit) of a point of the map, u and v in [0, 1].
    #[must_use]
    pub fn direction(&self, u: f64, v: f64) -> Vec3 {
        let (sin_theta, cos_theta) = sin_cos(PI * v);
        self.direction_at(u, sin_theta, cos_theta)
    }

    /// The point of the map in a world direction (unit): u in [0, 1), v in [0, 1].
    #[must_use]
    #[inline]
    pub fn uv(&self, direction: Vec3) -> [f64; 2] {
        let sin_theta = (direction.x * direction.x + direction.z * direction.z).sqrt();
        self.uv_at(direction, sin_theta)
    }

    /// Radiance from a world direction (unit), bilinear.
    #[must_use]
    #[inline]
    pub fn radiance(&self, direction: Vec3) -> Rgb {
        let [r, g, b, _] = self.bilinear(self.place(self.uv(direction)));
        Rgb::new(r, g, b)
    }

    /// Radiance at a point of the map, u and v in [0, 1] as in [`Environment::direction`], bilinear.
    #[must_use]
    #[inline]
    pub fn radiance_at(&self, u: f64, v: f64) -> Rgb {
        let [r, g, b, _] = self.bilinear(self.place([u, v]));
        Rgb::new(r, g, b)
    }

    /// The four texels around a point of the map (upper left, upper right, lower left, lower right) and the point's place between them:
    /// 0 at the left and upper ones, 1 at the right and lower ones.
    #[must_use]
    #[inline]
    pub(crate) fn corners(&self, uv: [f64; 2]) -> ([&[f32; 4]; 4], [f64; 2]) {
        let Place { node, s, t } = self.place(uv);
        let rows = &self.nodes[node..node + self.stride + 2];
        ([&rows[0], &rows[1], &rows[self.stride], &rows[self.stride + 1]], [s, t])
    }

    /// A row of the bordered grid: row `i + 1` holds texels `i`, with the texels beyond its ends; the first and the last row lie beyond the
    /// poles. Red, green, blue and a node of the sampling density.
    pub(crate) fn bordered_row(&self, row: usize) -> &[[f32; 4]] {
        &self.nodes[row * self.stride..][..self.stride]
    }

    /// Solid angle in steradians of each texel of row `i`.
    #[must_use]
    pub fn texel_solid_angle(&self, i: usize) -> f64 {
        let height = self.height as f64;
        let (sin_theta, _) = sin_cos(PI * (i as f64 + 0.5) / height);
        let (sin_half, _) = sin_cos(0.5 * PI / height);
        // cos(a) - cos(b) written as a product, which avoids cancellation.
        TAU / self.width as f64 * 2.0 * sin_theta * sin_half
    }

    /// Sum over all texels of radiance times solid angle (radiance x sr). Resampling keeps this energy.
    #[must_use]
    pub fn total(&self) -> Rgb {
        (0..self.height).fold(Rgb::ZERO, |total, i| {
            let row = (0..self.width).fold(Rgb::ZERO, |sum, j| sum + widen(self.texel(i, j)));
            total + row * self.texel_solid_angle(i)
        })
    }

    /// Mean radiance over the sphere of directions.
    #[must_use]
    pub fn mean_radiance(&self) -> Rgb {
        self.total() / (4.0 * PI)
    }

    /// The largest texel value of each channel, an upper bound of the radiance.
    #[must_use]
    pub fn max_radiance(&self) -> Rgb {
        self.nodes.iter().fold(Rgb::ZERO, |max, &[r, g, b, _]| max.max(widen([r, g, b])))
    }

    /// Columns of the bordered grid.
    pub(super) fn stride(&self) -> usize {
        self.stride
    }

    /// The bordered grid: red, green, blue and the node of the sampling density.
    pub(super) fn nodes(&self) -> &[[f32; 4]] {
        &self.nodes
    }

    /// The point of the map in a direction whose sin(theta) is already known.
    #[inline]
    pub(super) fn uv_at(&self, direction: Vec3, sin_theta: f64) -> [f64; 2] {
        let v = angle(sin_theta, direction.y) * (1.0 / PI);
        let turns = angle(direction.x, -direction.z) * (1.0 / TAU) + self.rotation_turns;
        let u = if turns < 0.0 { turns + 1.0 } else { turns };
        [if u >= 1.0 { u - 1.0 } else { u }, v]
    }

    /// The world direction at `u` and a given polar angle.
    #[inline]
    pub(super) fn direction_at(&self, u: f64, sin_theta: f64, cos_theta: f64) -> Vec3 {
        let (s, c) = sin_cos(TAU * (u - self.rotation_turns));
        Vec3::new(sin_theta * s, cos_theta, -sin_theta * c)
    }

    /// The four nodes around a map point.
    #[inline]
    pub(super) fn place(&self, [u, v]: [f64; 2]) -> Place {
        let (column, s) = split(u * self.size[0] + 0.5);
        let (row, t) = split(v * self.size[1] + 0.5);
        Place { node: row * self.stride + column, s, t }
    }

    /// The bilinear value at a place: red, green, blue, density node.
    #[inline]
    pub(super) fn bilinear(&self, Place { node, s, t }: Place) -> [f64; 4] {
        let rows = &self.nodes[node..node + self.stride + 2];
        let w11 = s * t;
        let weights = [(1.0 - s) - (t - w11), s - w11, t - w11, w11];
        let corners = [rows[0], rows[1], rows[self.stride], rows[self.stride + 1]];
        let mut value = [0.0; 4];
        for (corner, weight) in corners.iter().zip(weights) {
            value[0] += f64::from(corner[0]) * weight;
            value[1] += f64::from(corner[1]) * weight;
            value[2] += f64::from(corner[2]) * weight;
            value[3] += f64::from(corner[3]) * weight;
        }
        value
    }
}

/// Whole part and fraction of `x`, which is at least 0 and below 2^31 here. A NaN gives 0 and a NaN fraction.
#[inline]
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the whole part is wanted")]
fn split(x: f64) -> (usize, f64) {
    let whole = x as i32;
    (whole as usize, x - f64::from(whole))
}

/// The texels with their border and the nodes of the sampling density.
///
/// The density node of a texel is its largest channel times sin(theta) of its centre. In the rows next to the poles it
/// is the larger of the values of two opposite texels. Beyond a pole the node has the opposite sign: the interpolated
/// density then falls to 0 at the pole as sin(theta) does, and the density per solid angle stays finite.
fn bordered_nodes(image: &Image) -> Vec<[f32; 4]> {
    let (width, height) = (image.width(), image.height());
    let mut nodes = Vec::with_capacity((width + 2) * (height + 2));
    for bordered_row in 0..height + 2 {
        let is_beyond_pole = bordered_row == 0 || bordered_row == height + 1;
        let i = bordered_row.clamp(1, height) - 1;
        let shift = if is_beyond_pole { width / 2 } else { 0 };
        let (sin_theta, _) = sin_cos(PI * (i as f64 + 0.5) / height as f64);
        let is_next_to_pole = i == 0 || i == height - 1;
        for bordered_column in 0..width + 2 {
            let j = (bordered_column + width - 1 + shift) % width;
            let [r, g, b] = image.pixel(j, i);
            let brightest = |[r, g, b]: [f32; 3]| f64::from(r.max(g).max(b));
            let here = brightest([r, g, b]);
            let peak =
                if is_next_to_pole { here.max(brightest(image.pixel((j + width / 2) % width, i))) } else { here };
            let density = to_f32(peak * sin_theta);
            nodes.push([r, g, b, if is_beyond_pole { -density } else { density }]);
        }
    }
    nodes
}

#[cfg(test)]
mod tests;
