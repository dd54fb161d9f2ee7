//! The circle of a mask, by least squares on coverage.
//!
//! The disk's coverage `c(p) = clamp((R - |p - centre|) / w + 1/2, 0, 1)` is compared with the mask at every pixel
//! centre. Gauss-Newton steps over (x, y, R) minimise `sum (c - mask)^2` while the width w of the edge shrinks from R/4
//! to one pixel. Only pixels on the edge have a gradient: holes inside and specks outside do not move the circle, a
//! notch moves it little, and the part of the disk outside the photo has no influence.

use super::limits::LEAST_AREA;
use super::{Circle, Mask, SceneError};
use crate::math::{Mat3, Vec3};
use std::f64::consts::PI;

/// A fitted circle and its difference from the mask.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CircleFit {
    /// The circle, in pixels.
    pub circle: Circle,
    /// Sum of |disk - mask| over the sum of the mask: 0 for a perfect disk.
    pub mismatch: f64,
}

/// Fits a circle to the object in a mask.
///
/// # Errors
/// [`SceneError::EmptyMask`] if the mask covers less than 20 pixels.
pub fn fit_circle(mask: &Mask) -> Result<CircleFit, SceneError> {
    let mut circle = start(mask)?;
    let mut edge = (0.25 * circle.radius).max(1.0);
    loop {
        for _ in 0..STEPS {
            let step = gauss_newton_step(mask, circle, edge);
            // The linearisation holds only within the width of the edge, so no step is longer.
            let step = step.clamp_length_max(edge);
            circle.x += step.x;
            circle.y += step.y;
            circle.radius = (circle.radius + step.z).max(0.5);
            if step.length() < 1e-6 {
                break;
            }
        }
        if edge <= 1.0 {
            return Ok(CircleFit { circle, mismatch: mismatch(mask, circle) });
        }
        edge = (0.5 * edge).max(1.0);
    }
}

/// The circle with the mask's centroid and area.
fn start(mask: &Mask) -> Result<Circle, SceneError> {
    let (mut sum, mut x, mut y) = (0.0, 0.0, 0.0);
    for (index, &value) in mask.coverage().iter().enumerate() {
        let value = f64::from(value);
        sum += value;
        x += value * ((index % mask.width()) as f64 + 0.5);
        y += value * ((index / mask.width()) as f64 + 0.5);
    }
    if sum < LEAST_AREA {
        return Err(SceneError::EmptyMask { covered: sum });
    }
    Ok(Circle { x: x / sum, y: y / sum, radius: (sum / PI).sqrt() })
}

/// The step in (x, y, R) that solves the linearised problem; 0 if it has no unique solution.
fn gauss_newton_step(mask: &Mask, circle: Circle, edge: f64) -> Vec3 {
    let mut normal = Mat3::ZERO;
    let mut gradient = Vec3::ZERO;
    for (index, &value) in mask.coverage().iter().enumerate() {
        let (x, y) = ((index % mask.width()) as f64 + 0.5, (index / mask.width()) as f64 + 0.5);
        let distance = circle.distance(x, y);
        let inside = (circle.radius - distance) / edge;
        if inside.abs() < 0.5 && distance > 0.0 {
            let slope = Vec3::new((x - circle.x) / distance, (y - circle.y) / distance, 1.0) / edge;
            normal += Mat3::from_cols(slope * slope.x, slope * slope.y, slope * slope.z);
            gradient += slope * (inside + 0.5 - f64::from(value));
        }
    }
    // The matrix is singular with fewer than three pixels on the edge, or if all of them lie on one line.
    let determinant = normal.determinant();
    let scale = normal.x_axis.x * normal.y_axis.y * normal.z_axis.z;
    if determinant > 1e-9 * scale { -(normal.inverse() * gradient) } else { Vec3::ZERO }
}

fn mismatch(mask: &Mask, circle: Circle) -> f64 {
    let (mut difference, mut sum) = (0.0, 0.0);
    for (index, &value) in mask.coverage().iter().enumerate() {
        let (x, y) = ((index % mask.width()) as f64 + 0.5, (index / mask.width()) as f64 + 0.5);
        let disk = (circle.radius - circle.distance(x, y) + 0.5).clamp(0.0, 1.0);
        difference += (disk - f64::from(value)).abs();
        sum += f64::from(value);
    }
    difference / sum
}

/// The limit of steps per edge width. They converge quadratically, within a few steps.
const STEPS: usize = 30;

#[cfg(test)]
mod tests;
