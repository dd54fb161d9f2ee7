//! The layouts of environment maps, each as a function from directions to positions in the image and its inverse
//! (design section 3).
//!
//! | name | shape | directions |
//! |---|---|---|
//! | `latlong` | 2:1; any of even width if named | the canonical map, see [`super::Environment`] |
//! | `cross` | 3:4, vertical | column 1: up, front, down, back (turned by 180 degrees); row 1: left, front, right; from inside, front is -Z, right +X, up +Y |
//! | `angular` | square | Debevec: phi = pi r, `d = (sin(phi) x/r, sin(phi) y/r, -cos(phi))` |
//! | `mirror-ball` | square | orthographic view of a ball: n = (x, y, sqrt(1 - r^2)), `d = 2 n_z n - (0,0,1)` |
//!
//! In `angular` and `mirror-ball`, x points right and y up, both in \[-1, 1\], with r = |(x, y)| <= 1.

use super::LightError;
use crate::math::arctangent::angle;
use crate::math::elementary::sin_cos;
use crate::math::{Vec3, cell};
use std::f64::consts::{PI, TAU};

/// The layout of an environment map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mapping {
    /// Latitude and longitude, the canonical layout.
    LatLong,
    /// The six faces of a cube as a vertical cross.
    Cross,
    /// Debevec's light probe: radius proportional to the angle from -Z.
    Angular,
    /// A mirror ball as the camera on +Z sees it: its centre reflects +Z.
    MirrorBall,
}

impl Mapping {
    /// All layouts, in the order of the documentation.
    pub const ALL: [Self; 4] = [Self::LatLong, Self::Cross, Self::Angular, Self::MirrorBall];

    /// The name used on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::LatLong => "latlong",
            Self::Cross => "cross",
            Self::Angular => "angular",
            Self::MirrorBall => "mirror-ball",
        }
    }

    /// The layout of an image by its shape: 2:1 is `latlong`, 3:4 is `cross`.
    ///
    /// # Errors
    /// [`LightError::UnknownLayout`] for any other shape, because several layouts share it.
    pub fn recognise(width: usize, height: usize) -> Result<Self, LightError> {
        if height > 0 && width == 2 * height {
            Ok(Self::LatLong)
        } else if height > 0 && 4 * width == 3 * height {
            Ok(Self::Cross)
        } else {
            Err(LightError::UnknownLayout { width, height })
        }
    }

    /// Checks that an image of this size can have this layout.
    ///
    /// # Errors
    /// [`LightError::Shape`] with the expected shape.
    pub fn check_shape(self, width: usize, height: usize) -> Result<(), LightError> {
        let (fits, expected) = match self {
            Self::LatLong => (width >= 2 && height >= 1 && width.is_multiple_of(2), "of even width"),
            Self::Cross => {
                (width > 0 && width.is_multiple_of(3) && 4 * width == 3 * height, "3:4, made of 3 x 4 square faces")
            }
            Self::Angular | Self::MirrorBall => (width >= 2 && width == height, "square, cropped to the ball"),
        };
        if fits { Ok(()) } else { Err(LightError::Shape { mapping: self.name(), expected, width, height }) }
    }

    /// The position of a direction (unit) in the image: x from 0 at the left edge to 1 at the right, y from 0 at the
    /// top to 1 at the bottom.
    #[must_use]
    pub fn position(self, d: Vec3) -> [f64; 2] {
        match self {
            Self::LatLong => lat_long_position(d),
            Self::Cross => {
                let (face, [a, b]) = face_position(d);
                let [column, row] = FACES[face].place;
                [(column + 0.5 + 0.5 * a) / 3.0, (row + 0.5 + 0.5 * b) / 4.0]
            }
            Self::Angular => {
                let phi = angle(radius(d), -d.z);
                from_disk(d, phi / PI)
            }
            // phi is the angle from +Z; r = sin(phi / 2), in the form that avoids cancellation on this side.
            Self::MirrorBall if d.z > 0.0 => from_disk(d, radius(d) / (2.0 * (1.0 + d.z)).sqrt()),
            Self::MirrorBall => from_disk(d, (0.5 * (1.0 - d.z)).sqrt()),
        }
    }

    /// The direction (unit) at a position of the image; `None` in the empty parts of a cross and outside a ball.
    #[must_use]
    pub fn direction(self, [x, y]: [f64; 2]) -> Option<Vec3> {
        if !((0.0..=1.0).contains(&x) && (0.0..=1.0).contains(&y)) {
            return None;
        }
        match self {
            Self::LatLong => {
                let ((sin_theta, cos_theta), (s, c)) = (sin_cos(PI * y), sin_cos(TAU * x));
                Some(Vec3::new(sin_theta * s, cos_theta, -sin_theta * c))
            }
            Self::Cross => {
                let (column, row) = (cell(3.0 * x, 3) as f64, cell(4.0 * y, 4) as f64);
                let face = FACES.iter().find(|face| face.place == [column, row])?;
                let (a, b) = (2.0 * (3.0 * x - column) - 1.0, 2.0 * (4.0 * y - row) - 1.0);
                Some((face.towards + face.right * a + face.down * b).normalize())
            }
            Self::Angular => on_disk(x, y).map(|[x, y, r]| {
                let (s, c) = sin_cos(PI * r);
                let scale = if r > 0.0 { s / r } else { 0.0 };
                Vec3::new(scale * x, scale * y, -c)
            }),
            Self::MirrorBall => on_disk(x, y).map(|[x, y, r]| {
                let n_z = (1.0 - r * r).max(0.0).sqrt();
                Vec3::new(2.0 * n_z * x, 2.0 * n_z * y, 2.0 * n_z * n_z - 1.0)
            }),
        }
    }

    /// The resolution of the layout at a direction: the image length per radian (the image's width is 1), in the
    /// orientation where it is largest.
    #[must_use]
    pub(super) fn lengths_per_radian(self, d: Vec3) -> f64 {
        match self {
            Self::LatLong => 1.0 / (TAU * sin_theta(d).max(1e-9)),
            Self::Cross => {
                let (_, [a, b]) = face_position(d);
                (1.0 + a * a + b * b) / 6.0
            }
            Self::Angular => 0.5 * (angle(radius(d), -d.z) / PI / radius(d).max(1e-9)).max(1.0 / PI),
            // Tangentially r / sin(phi) = 1 / (2 cos(phi / 2)), which is at least the radial cos(phi / 2) / 2.
            Self::MirrorBall => 0.25 / (0.5 * (1.0 + d.z)).sqrt().max(1e-9),
        }
    }
}

impl crate::choice::Choice for Mapping {
    const TABLE: &'static [(Self, &'static str, &'static str)] = &[
        (Self::LatLong, "latlong", "Latitude and longitude (equirectangular), 2:1; the image's centre is +Z"),
        (Self::Cross, "cross", "Vertical cross of the six faces of a cube, 3:4"),
        (Self::Angular, "angular", "Debevec's angular map, square"),
        (
            Self::MirrorBall,
            "mirror-ball",
            "A photo of a mirror ball, square and cropped to it; first divide it by the ball's reflectance",
        ),
    ];
}

impl std::fmt::Display for Mapping {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

impl std::str::FromStr for Mapping {
    type Err = LightError;

    fn from_str(name: &str) -> Result<Self, LightError> {
        let found = Self::ALL.into_iter().find(|mapping| mapping.name() == name);
        found.ok_or_else(|| LightError::UnknownName { found: name.to_owned() })
    }
}

/// A face of the vertical cross: `d ~ towards + a right + b down` for a, b in \[-1, 1\] across the stored face.
struct Face {
    /// Column and row in the grid of 3 x 4 faces.
    place: [f64; 2],
    towards: Vec3,
    right: Vec3,
    down: Vec3,
}

const FACES: [Face; 6] = [
    Face { place: [1.0, 0.0], towards: Vec3::Y, right: Vec3::X, down: Vec3::NEG_Z },
    Face { place: [0.0, 1.0], towards: Vec3::NEG_X, right: Vec3::NEG_Z, down: Vec3::NEG_Y },
    Face { place: [1.0, 1.0], towards: Vec3::NEG_Z, right: Vec3::X, down: Vec3::NEG_Y },
    Face { place: [2.0, 1.0], towards: Vec3::X, right: Vec3::Z, down: Vec3::NEG_Y },
    Face { place: [1.0, 2.0], towards: Vec3::NEG_Y, right: Vec3::X, down: Vec3::Z },
    // Stored rotated by 180 degrees: upright, right would be -X and down -Y.
    Face { place: [1.0, 3.0], towards: Vec3::Z, right: Vec3::X, down: Vec3::Y },
];

/// The index of the face in a direction, and the position on it: a to the right and b down, in \[-1, 1\].
pub(super) fn face_position(d: Vec3) -> (usize, [f64; 2]) {
    let m = d.abs();
    let face = if m.y >= m.x && m.y >= m.z {
        if d.y > 0.0 { 0 } else { 4 }
    } else if m.x >= m.z {
        if d.x > 0.0 { 3 } else { 1 }
    } else if d.z > 0.0 {
        5
    } else {
        2
    };
    let Face { towards, right, down, .. } = &FACES[face];
    let along = d.dot(*towards);
    (face, [d.dot(*right) / along, d.dot(*down) / along])
}

/// The column and row of a face in the grid of 3 x 4 faces.
pub(super) fn face_place(face: usize) -> [f64; 2] {
    FACES[face].place
}

fn lat_long_position(d: Vec3) -> [f64; 2] {
    let u = angle(d.x, -d.z) / TAU;
    [if u < 0.0 { u + 1.0 } else { u }, angle(sin_theta(d), d.y) / PI]
}

/// Distance from the Y axis.
fn sin_theta(d: Vec3) -> f64 {
    (d.x * d.x + d.z * d.z).sqrt()
}

/// Distance from the Z axis.
fn radius(d: Vec3) -> f64 {
    (d.x * d.x + d.y * d.y).sqrt()
}

/// The image position at distance `r` from the centre, at the azimuth of `d` around Z (along x if `d` is on the axis).
fn from_disk(d: Vec3, r: f64) -> [f64; 2] {
    let length = radius(d);
    let (x, y) = if length > 0.0 { (d.x / length, d.y / length) } else { (1.0, 0.0) };
    [0.5 + 0.5 * r * x, 0.5 - 0.5 * r * y]
}

/// The coordinates x (right) and y (up) in \[-1, 1\], and the radius, of an image position; `None` outside the disk.
fn on_disk(x: f64, y: f64) -> Option<[f64; 3]> {
    let (x, y) = (2.0 * x - 1.0, 1.0 - 2.0 * y);
    let r = (x * x + y * y).sqrt();
    // Tolerates rounding, so that the rim belongs to the disk.
    (r <= 1.0 + 1e-12).then_some([x, y, r.min(1.0)])
}

#[cfg(test)]
mod tests;
