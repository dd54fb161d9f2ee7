//! `merl`: a measured isotropic BRDF, tabulated. A target to render, not a model to fit.
//!
//! Source: Matusik, Pfister, Brand & McMillan, *A Data-Driven Reflectance Model* (SIGGRAPH 2003), and the file format of its
//! database. The table runs over Rusinkiewicz's half and difference angles (1998), `90 x 90 x 180` cells:
//!
//! | axis | range | cell `i` is sampled at |
//! |---|---|---|
//! | `theta_h`, normal to half vector | \[0, pi/2\] | `((i + 1/2) / 90)^2 pi/2`: even in `sqrt(theta_h)` |
//! | `theta_d`, half vector to light | \[0, pi/2\] | `(i + 1/2) / 90 pi/2` |
//! | `phi_d`, light around the half vector | \[0, pi), periodic by pi through reciprocity | `(i + 1/2) / 180 pi` |
//!
//! Between centres the value is trilinear in (`sqrt(theta_h)`, `theta_d`, `phi_d`); beyond the outermost centres of the first
//! two axes it is constant, which at 0 is the reflection that the geometry requires. A cell with a negative channel is *outside*
//! (below the horizon, or not measured): it is dropped and the other weights are renormalised. Where all eight neighbours are
//! outside, the BRDF is 0.
//!
//! `f` is in 1/sr, without the cosine, linear Rec. 709 (by convention; the database does not say). The value is bitwise
//! reciprocal. The albedo is not bounded: extrapolated measurements may exceed 1 at grazing angles.

mod coordinates;
mod error;
mod shape;
#[cfg(test)]
mod tests;

use super::Reflectance;
use crate::math::{Rgb, Vec3, to_f32};
use coordinates::{HalfDifference, Neighbours};

pub use error::MerlError;

/// A measured BRDF: 17 MB in memory.
#[derive(Debug, Clone)]
pub struct MerlTable {
    /// Shape `theta_h x theta_d x phi_d`, 1/sr; a cell outside is negative in all channels.
    cells: Vec<[f32; 3]>,
    /// See [`Reflectance::sampling_alphas`].
    alphas: Vec<f64>,
    content_hash: blake3::Hash,
}

impl MerlTable {
    /// Reads a `.binary` file: the little-endian `i32` dimensions 90, 90, 180, then the red, green and blue planes as
    /// little-endian `f64`, index `phi_d + 180 (theta_d + 90 theta_h)`, to be multiplied by (1, 1.15, 1.66) / 1500. `name` only
    /// appears in errors. Values are kept in single precision.
    ///
    /// # Errors
    /// [`MerlError::Dimensions`], [`MerlError::Length`], [`MerlError::NotFinite`] with the cell, and [`MerlError::Empty`] when every
    /// cell is outside.
    pub fn read(name: &str, bytes: &[u8]) -> Result<Self, MerlError> {
        let planes = planes(name, bytes)?;
        let mut cells = vec![OUTSIDE; CELLS];
        let mut inside = 0_usize;
        for (index, cell) in cells.iter_mut().enumerate() {
            let mut value = [0.0; 3];
            for (channel, x) in value.iter_mut().enumerate() {
                let [theta_h, theta_d, phi_d] = cell_of(index);
                let stored = f64::from_le_bytes(planes[channel * CELLS + index]);
                *x = to_f32(stored * SCALE[channel]);
                if !x.is_finite() {
                    let name = name.to_owned();
                    return Err(MerlError::NotFinite { name, channel, theta_h, theta_d, phi_d, value: stored });
                }
            }
            if value.iter().all(|&x| x >= 0.0) {
                *cell = value;
                inside += 1;
            }
        }
        if inside == 0 {
            return Err(MerlError::Empty { name: name.to_owned() });
        }
        let alphas = shape::sampling_alphas(&cells);
        Ok(Self { cells, alphas, content_hash: blake3::hash(bytes) })
    }

    /// The BRDF in 1/sr, without the cosine, for unit directions that point away from the surface, in the frame whose +Z is
    /// the normal. Zero where either lies at or below the surface.
    #[must_use]
    pub fn eval(&self, wi_local: Vec3, wo_local: Vec3) -> Rgb {
        if wi_local.z <= 0.0 || wo_local.z <= 0.0 {
            return Rgb::ZERO;
        }
        let neighbours = Neighbours::of(&HalfDifference::new(wi_local, wo_local));
        let (mut sum, mut total) = (Rgb::ZERO, 0.0);
        for (row, row_weight) in neighbours.rows {
            for (column, weight) in neighbours.columns {
                let [r, g, b] = self.cells[row + column];
                // A select, because a branch would be mispredicted near the horizon.
                let weight = if r >= 0.0 { row_weight * weight } else { 0.0 };
                sum += Rgb::new(f64::from(r), f64::from(g), f64::from(b)) * weight;
                total += weight;
            }
        }
        if total > 0.0 { sum / total } else { Rgb::ZERO }
    }

    /// BLAKE3 of the file the table was read from.
    #[must_use]
    pub fn content_hash(&self) -> blake3::Hash {
        self.content_hash
    }
}

impl Reflectance for MerlTable {
    fn eval_cos(&self, wi_local: Vec3, wo_local: Vec3) -> Rgb {
        self.eval(wi_local, wo_local) * wi_local.z.max(0.0)
    }

    /// GGX widths from the core of the table's lobes to their tails, and 1 for the rest.
    fn sampling_alphas(&self) -> Vec<f64> {
        self.alphas.clone()
    }
}

/// Checks header and length of a file and returns its planes as little-endian numbers.
fn planes<'a>(name: &str, bytes: &'a [u8]) -> Result<&'a [[u8; 8]], MerlError> {
    let expected = HEADER + 3 * 8 * CELLS;
    let length = || MerlError::Length { name: name.to_owned(), expected, found: bytes.len() };
    let (header, values) = bytes.split_at_checked(HEADER).ok_or_else(length)?;
    let mut found = [0; 3];
    for (dimension, word) in found.iter_mut().zip(header.as_chunks::<4>().0) {
        *dimension = i32::from_le_bytes(*word);
    }
    if found.map(usize::try_from) != DIMENSIONS.map(Ok) {
        return Err(MerlError::Dimensions { name: name.to_owned(), found });
    }
    match values.as_chunks::<8>() {
        (planes, []) if planes.len() == 3 * CELLS => Ok(planes),
        _ => Err(length()),
    }
}

/// The indices of a cell along the three axes.
fn cell_of(index: usize) -> [usize; 3] {
    [index / (DIMENSIONS[2] * DIMENSIONS[1]), index / DIMENSIONS[2] % DIMENSIONS[1], index % DIMENSIONS[2]]
}

/// Cells along `theta_h`, `theta_d`, `phi_d`.
const DIMENSIONS: [usize; 3] = [90, 90, 180];
const CELLS: usize = DIMENSIONS[0] * DIMENSIONS[1] * DIMENSIONS[2];
/// Bytes before the planes.
const HEADER: usize = 12;
/// 1/sr per unit of a stored number (`BRDFRead.cpp` of the database).
const SCALE: [f64; 3] = [1.0 / 1500.0, 1.15 / 1500.0, 1.66 / 1500.0];
/// A cell without a measurement.
const OUTSIDE: [f32; 3] = [-1.0; 3];
