//! From two directions to the cells around them: Rusinkiewicz, *A New Change of Variables for Efficient BRDF
//! Representation* (1998), for isotropic materials.

use super::DIMENSIONS;
use crate::math::{Vec3, arctangent::angle, cell};
use std::f64::consts::{FRAC_PI_2, PI};

/// The angles of a pair of directions, in radians.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct HalfDifference {
    /// Between normal and half vector, in \[0, pi/2\].
    pub(super) theta_h: f64,
    /// Between half vector and either direction, in \[0, pi/2\].
    pub(super) theta_d: f64,
    /// Of the light around the half vector, from the plane of normal and half vector. In \[0, pi\], because exchanging the
    /// directions turns it by pi.
    pub(super) phi_d: f64,
}

impl HalfDifference {
    /// The angles of two unit directions above the surface, in the frame whose +Z is the normal. Exchanging them gives the
    /// same bits.
    #[inline]
    pub(super) fn new(wi: Vec3, wo: Vec3) -> Self {
        // Along the half vector, and across it: of lengths 2 cos(theta_d) and 2 sin(theta_d).
        let (sum, difference) = (wi + wo, wi - wo);
        let length = sum.length();
        let across = (sum.x * sum.x + sum.y * sum.y).sqrt();
        // With the half vector along the normal any plane contains both.
        let (cos_phi, sin_phi) = if across > 0.0 { (sum.x / across, sum.y / across) } else { (1.0, 0.0) };
        let (cos_h, sin_h) = (sum.z / length, across / length);
        let x = (difference.x * cos_phi + difference.y * sin_phi) * cos_h - difference.z * sin_h;
        let y = difference.y * cos_phi - difference.x * sin_phi;
        let is_turned = y < 0.0 || (y == 0.0 && x < 0.0);
        Self {
            theta_h: angle(across, sum.z),
            theta_d: angle(difference.length(), length),
            phi_d: if is_turned { angle(-y, -x) } else { angle(y, x) },
        }
    }
}

/// The eight cells around a pair of directions: index offsets and weights.
#[derive(Debug, Clone, Copy)]
pub(super) struct Neighbours {
    /// Start of a row of `phi_d`, and the weight of its `theta_h` and `theta_d`.
    pub(super) rows: [(usize, f64); 4],
    /// Place in that row, and the weight of its `phi_d`.
    pub(super) columns: [(usize, f64); 2],
}

impl Neighbours {
    #[inline]
    pub(super) fn of(angles: &HalfDifference) -> Self {
        let [h_cells, d_cells, phi_cells] = DIMENSIONS;
        let (h, h_part) = between((angles.theta_h * (1.0 / FRAC_PI_2)).sqrt(), h_cells);
        let (d, d_part) = between(angles.theta_d * (1.0 / FRAC_PI_2), d_cells);
        let start = (h * d_cells + d) * phi_cells;
        let (below, beside) = (d_cells * phi_cells, phi_cells);
        let rows = [
            (start, (1.0 - h_part) * (1.0 - d_part)),
            (start + beside, (1.0 - h_part) * d_part),
            (start + below, h_part * (1.0 - d_part)),
            (start + below + beside, h_part * d_part),
        ];
        let position = angles.phi_d * (phi_cells as f64 / PI) + 0.5;
        // Position k + 1/2 is the centre of cell k; the axis is periodic, so the last cell precedes the first.
        let above = cell(position, phi_cells + 1);
        let part = position - above as f64;
        let first = if above == 0 { phi_cells - 1 } else { above - 1 };
        let second = if above == phi_cells { 0 } else { above };
        Self { rows, columns: [(first, 1.0 - part), (second, part)] }
    }
}

/// The cell before `x` in \[0, 1\] and how far `x` lies from its centre to the next one's; constant beyond the outermost centres.
#[inline]
fn between(x: f64, cells: usize) -> (usize, f64) {
    let position = (x * cells as f64 - 0.5).clamp(0.0, (cells - 1) as f64);
    let first = cell(position, cells - 1);
    (first, position - first as f64)
}
