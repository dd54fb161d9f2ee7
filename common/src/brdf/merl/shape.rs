//! How wide the lobes of a table are, for importance sampling.
//!
//! The profile is the mean luminance over `theta_d` below 45 degrees and all `phi_d`, as a function of `theta_h`, above its
//! minimum (the diffuse part). A GGX lobe of width `a` falls to the fraction `q` of its peak at `tan^2(theta_h) = a^2 (1/sqrt(q) - 1)`;
//! so each level at which the profile is read gives the width of a lobe that passes through it: one width for a GGX
//! material, several for one with a sharp core and long tails.

use super::{DIMENSIONS, cell_of};
use crate::math::{elementary::tan, luminance, widen};
use std::f64::consts::FRAC_PI_2;

/// Ascending widths that cover the lobes of a table of `theta_h x theta_d x phi_d` cells; the last is 1.
pub(super) fn sampling_alphas(cells: &[[f32; 3]]) -> Vec<f64> {
    let profile = profile(cells);
    let base = profile.iter().map(|&(_, value)| value).fold(f64::INFINITY, f64::min);
    let peak = profile.iter().map(|&(_, value)| value - base).fold(0.0, f64::max);
    let mut alphas = Vec::new();
    if peak > LEAST_PEAK * base {
        for level in LEVELS {
            let Some(theta_h) = crossing(&profile, base + level * peak) else { continue };
            let alpha = (tan(theta_h) / (1.0 / level.sqrt() - 1.0).sqrt()).max(LEAST_ALPHA);
            if alpha < MOST_ALPHA && alphas.last().is_none_or(|&last| alpha > APART * last) {
                alphas.push(alpha);
            }
        }
    }
    alphas.push(1.0);
    alphas
}

/// `theta_h` in radians and the mean luminance there, ascending; rows without a measurement are left out.
fn profile(cells: &[[f32; 3]]) -> Vec<(f64, f64)> {
    let [h_cells, d_cells, phi_cells] = DIMENSIONS;
    let mut sums = vec![(0.0, 0.0); h_cells];
    for (index, &value) in cells.iter().enumerate() {
        let [h, d, _] = cell_of(index);
        if 2 * d < d_cells && value[0] >= 0.0 {
            sums[h].0 += luminance(widen(value));
            sums[h].1 += 1.0;
        }
    }
    let half_row = (d_cells / 2 * phi_cells) as f64;
    let theta_h = |h: usize| {
        let root = (h as f64 + 0.5) / h_cells as f64;
        root * root * FRAC_PI_2
    };
    // Where the horizon cuts away half of a row, what is left is grazing.
    let rows = sums.iter().enumerate().filter(|(_, (_, count))| *count > 0.5 * half_row);
    rows.map(|(h, (sum, count))| (theta_h(h), sum / count)).collect()
}

/// The angle at which a profile first falls below `level` after its peak, linear between rows.
fn crossing(profile: &[(f64, f64)], level: f64) -> Option<f64> {
    let peak = (0..profile.len()).max_by(|&a, &b| profile[a].1.total_cmp(&profile[b].1))?;
    let after = profile[peak..].windows(2).find(|pair| pair[1].1 < level)?;
    let [(from, high), (to, low)] = [after[0], after[1]];
    Some(from + (to - from) * ((high - level) / (high - low)).clamp(0.0, 1.0))
}

/// Fractions of the peak at which the width is read: the core, the shoulder and the tails.
const LEVELS: [f64; 4] = [0.5, 0.1, 0.01, 0.001];
/// A peak lower than this above the diffuse part is not worth a technique.
const LEAST_PEAK: f64 = 0.1;
/// A tenth of the sharpest lobe of a fitted model.
const LEAST_ALPHA: f64 = 5e-4;
/// Wider lobes are covered by the last entry.
const MOST_ALPHA: f64 = 0.7;
/// Widths closer than this ratio share a technique.
const APART: f64 = 1.6;
