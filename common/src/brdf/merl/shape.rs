//! The widths of a table's lobes, for importance sampling.
//!
//! The profile is the mean luminance over `theta_d` below 45 degrees and all `phi_d`, as a function of `theta_h`, above its
//! minimum (the diffuse part). Two widths of GGX are read off it: that of the core, at half of the peak, and that of the tails, inside
//! which lie seven eighths of the energy `profile cos(theta_h) d(omega_h)`. For a GGX material they are equal; for others a few
//! log-spaced widths run from one to the other. Both ends matter (noise of a typical pixel at 64 x 64, 1024 samples, under Uffizi):
//! gold-metallic-paint3 has 2.3 % without its tails and 1.4 % with them, because most of its energy lies at a thousandth of the
//! peak; blue-acrylic has 2.3 % without its core and 1.2 % with it.

use super::{DIMENSIONS, cell_of};
use crate::math::{
    cell,
    elementary::{exp, ln, sin_cos},
    luminance, widen,
};
use std::f64::consts::{FRAC_PI_2, SQRT_2};

/// Ascending widths that cover the lobes of a table of `theta_h x theta_d x phi_d` cells; the last is 1.
pub(super) fn sampling_alphas(cells: &[[f32; 3]]) -> Vec<f64> {
    let rows = profile(cells);
    let base = rows.iter().map(|row| row.value).fold(f64::INFINITY, f64::min);
    let above: Vec<Row> = rows.iter().map(|row| Row { value: row.value - base, ..*row }).collect();
    if energy(&above) <= LEAST_SPECULAR * energy(&rows) {
        return vec![1.0];
    }
    // GGX falls to a half where tan^2 = a^2 (sqrt(2) - 1), and the part tan^2 / (a^2 + tan^2) of its energy lies inside an angle.
    let core = (half_maximum(&above) / (SQRT_2 - 1.0)).sqrt().clamp(LEAST_ALPHA, MOST_ALPHA);
    let tails = (tan2_around(&above, TAILS) * (1.0 - TAILS) / TAILS).sqrt().clamp(core, MOST_ALPHA);
    let span = ln(tails / core);
    let steps = if span < ln(ONE_LOBE) { 0 } else { cell((span / ln(STEP)).ceil(), MOST_STEPS + 1) };
    let at = |k: usize| if steps == 0 { core } else { core * exp(span * k as f64 / steps as f64) };
    (0..=steps).map(at).chain([1.0]).collect()
}

/// Cells of equal `theta_h`.
#[derive(Debug, Clone, Copy)]
struct Row {
    /// Luminance.
    value: f64,
    /// Squared tangents of the inner and outer edge.
    tan2: [f64; 2],
}

impl Row {
    /// `value cos(theta_h) d(omega_h)` up to a factor: the solid angle is the difference of the squared sines of the edges.
    fn energy(&self) -> f64 {
        let [inner, outer] = self.tan2.map(|tan2| tan2 / (1.0 + tan2));
        self.value * (outer - inner)
    }
}

fn energy(rows: &[Row]) -> f64 {
    rows.iter().map(Row::energy).sum()
}

/// The rows from the normal outwards; those of which the horizon cuts more than half are left out, because the rest is grazing.
fn profile(cells: &[[f32; 3]]) -> Vec<Row> {
    let [h_cells, d_cells, phi_cells] = DIMENSIONS;
    let mut sums = vec![(0.0, 0.0); h_cells];
    for (index, &value) in cells.iter().enumerate() {
        let [h, d, _] = cell_of(index);
        if 2 * d < d_cells && value[0] >= 0.0 {
            sums[h].0 += luminance(widen(value));
            sums[h].1 += 1.0;
        }
    }
    let half_row = 0.5 * (d_cells / 2 * phi_cells) as f64;
    let tan2 = |edge: usize| {
        let root = edge as f64 / h_cells as f64;
        let (sin, cos) = sin_cos(root * root * FRAC_PI_2);
        sin * sin / (cos * cos)
    };
    let rows = sums.iter().enumerate().filter(|(_, (_, count))| *count > half_row);
    rows.map(|(h, (sum, count))| Row { value: sum / count, tan2: [tan2(h), tan2(h + 1)] }).collect()
}

/// The squared tangent of the angle at which a profile first falls below half of its peak.
fn half_maximum(rows: &[Row]) -> f64 {
    let Some(peak) = (0..rows.len()).max_by(|&a, &b| rows[a].value.total_cmp(&rows[b].value)) else { return 1.0 };
    let level = 0.5 * rows[peak].value;
    let centre = |row: &Row| 0.5 * (row.tan2[0] + row.tan2[1]);
    let fall = rows[peak..].windows(2).find(|pair| pair[1].value < level);
    fall.map_or(1.0, |pair| {
        let part = (pair[0].value - level) / (pair[0].value - pair[1].value);
        centre(&pair[0]) + (centre(&pair[1]) - centre(&pair[0])) * part
    })
}

/// The squared tangent of the angle inside which lies a part of the energy, even within a row.
fn tan2_around(rows: &[Row], part: f64) -> f64 {
    let mut rest = part * energy(rows);
    for row in rows {
        let here = row.energy();
        if here > rest {
            return row.tan2[0] + (row.tan2[1] - row.tan2[0]) * rest / here;
        }
        rest -= here;
    }
    1.0
}

/// The part of the energy inside the widest lobe.
const TAILS: f64 = 7.0 / 8.0;
/// Below this share of the energy the specular part gets no sampling technique.
const LEAST_SPECULAR: f64 = 0.01;
/// A tenth of the sharpest lobe of a fitted model.
const LEAST_ALPHA: f64 = 5e-4;
/// Wider parts are left to the last entry.
const MOST_ALPHA: f64 = 0.35;
/// Core and tails whose ratio is smaller are one lobe.
const ONE_LOBE: f64 = 1.6;
/// Largest ratio between neighbouring widths.
const STEP: f64 = 6.5;
/// `ln(MOST_ALPHA / LEAST_ALPHA) / ln(STEP)`, rounded up.
const MOST_STEPS: usize = 4;
