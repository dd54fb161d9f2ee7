//! Materials in MERL's format from closed formulas, without files of measurements.

use lookalike::{
    brdf::Reflectance,
    math::{Vec3, elementary::sin_cos},
};
use std::f64::consts::{FRAC_PI_2, PI};

/// `theta_h`, `theta_d`, `phi_d`.
const CELLS: [usize; 3] = [90, 90, 180];

/// Stored values are multiplied by these.
const SCALE: [f64; 3] = [1.0 / 1500.0, 1.15 / 1500.0, 1.66 / 1500.0];

/// The file of a material: its values at the centres of the cells, -1 below the horizon, as in the original files.
#[must_use]
pub fn file_of(material: &dyn Reflectance) -> Vec<u8> {
    let mut planes: [Vec<u8>; 3] = Default::default();
    for theta_h in 0..CELLS[0] {
        for theta_d in 0..CELLS[1] {
            for phi_d in 0..CELLS[2] {
                let (wi, wo) = directions([theta_h, theta_d, phi_d]);
                let is_above = wi.z > 0.0 && wo.z > 0.0;
                let value = is_above.then(|| material.eval_cos(wi, wo) / wi.z);
                for (channel, plane) in planes.iter_mut().enumerate() {
                    let stored = value.map_or(-1.0, |rgb| rgb[channel] / SCALE[channel]);
                    plane.extend(stored.to_le_bytes());
                }
            }
        }
    }
    let header = CELLS.iter().flat_map(|&n| i32::try_from(n).unwrap_or(i32::MAX).to_le_bytes());
    header.chain(planes.concat()).collect()
}

/// Directions of light and view at the centre of a cell, local, normal +Z.
fn directions(cell: [usize; 3]) -> (Vec3, Vec3) {
    let centre = |axis: usize| (cell[axis] as f64 + 0.5) / CELLS[axis] as f64;
    let root = centre(0);
    let (sin_h, cos_h) = sin_cos(root * root * FRAC_PI_2);
    let (sin_d, cos_d) = sin_cos(centre(1) * FRAC_PI_2);
    let (sin_phi, cos_phi) = sin_cos(centre(2) * PI);
    let along = Vec3::new(sin_h, 0.0, cos_h) * cos_d;
    let across = Vec3::new(cos_h * cos_phi, sin_phi, -sin_h * cos_phi) * sin_d;
    (along + across, along - across)
}
