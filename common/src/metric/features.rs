//! The image-difference features of CID, as deficits: 1 minus the feature, 0 for two equal windows.
//!
//! With dL, dC, dH the differences of window means, s1, s2 the standard deviations and s12 the covariance of lightness:
//! l_L = 1/(1 + .002 dL^2); c_L = (.1 + 2 s1 s2)/(.1 + s1^2 + s2^2); s_L = (.1 + s12)/(.1 + s1 s2), signed;
//! l_C = 1/(1 + .002 dC^2); l_H = 1/(1 + .008 dH^2); and, optionally, c_C as c_L with the chroma's deviations.
//! Source: Lissner et al. 2013; the constants are those of the authors' program (`CID.m`).
//!
//! Deficits, unlike features, keep small differences exact, give identical images a score of exactly 0, and allow
//! windows without a difference to be left out of a sum without changing its bits. By Cauchy and Schwarz |s12| <= s1
//! s2; enforcing it removes only rounding errors.

use super::planes::LANES;
use super::window::{MEAN_CHROMA, MEAN_LIGHTNESS, RowStatistics, VARIANCE_CHROMA, VARIANCE_LIGHTNESS};
use crate::math::real::Real;

/// Features of a window: l_L, c_L, s_L, l_C, l_H.
pub(super) const FEATURES: usize = 5;

pub(super) const LIGHTNESS_WEIGHT: f64 = 0.002;
pub(super) const CHROMA_WEIGHT: f64 = 0.002;
pub(super) const HUE_WEIGHT: f64 = 0.008;
pub(super) const CONTRAST_CONSTANT: f64 = 0.1;
pub(super) const STRUCTURE_CONSTANT: f64 = 0.1;

/// Fills rows with the deficits of the five features.
#[inline(always)]
pub(super) fn deficit_rows(statistics: &RowStatistics<'_>, out: &mut [Vec<f64>; FEATURES]) {
    let n = out[0].len();
    let [l_l, c_l, s_l, l_c, l_h] = out;
    mean_deficit_row(LIGHTNESS_WEIGHT, statistics.reference[MEAN_LIGHTNESS], statistics.image[MEAN_LIGHTNESS], l_l);
    mean_deficit_row(CHROMA_WEIGHT, statistics.reference[MEAN_CHROMA], statistics.image[MEAN_CHROMA], l_c);
    let (c_l, s_l, l_h) = (&mut c_l[..n], &mut s_l[..n], &mut l_h[..n]);
    let (covariance, hue) = (&statistics.covariance_lightness[..n], &statistics.hue_difference[..n]);
    let (v1, v2) = (&statistics.reference[VARIANCE_LIGHTNESS][..n], &statistics.image[VARIANCE_LIGHTNESS][..n]);
    for x in 0..n {
        l_h[x] = mean_deficit(HUE_WEIGHT, hue[x]);
        let product = (v1[x] * v2[x]).sqrt();
        c_l[x] = contrast_deficit(CONTRAST_CONSTANT, v1[x] + v2[x], product);
        s_l[x] = structure_deficit(STRUCTURE_CONSTANT, covariance[x], product);
    }
}

/// Fills a row with the deficit of the chroma contrast c_C.
#[inline(always)]
pub(super) fn chroma_contrast_row(statistics: &RowStatistics<'_>, out: &mut [f64]) {
    let n = out.len();
    let (v1, v2) = (&statistics.reference[VARIANCE_CHROMA][..n], &statistics.image[VARIANCE_CHROMA][..n]);
    for x in 0..n {
        out[x] = contrast_deficit(CONTRAST_CONSTANT, v1[x] + v2[x], (v1[x] * v2[x]).sqrt());
    }
}

#[inline(always)]
fn mean_deficit_row(k: f64, first: &[f64], second: &[f64], out: &mut [f64]) {
    let n = out.len();
    let (first, second) = (&first[..n], &second[..n]);
    for x in 0..n {
        out[x] = mean_deficit(k, first[x] - second[x]);
    }
}

/// 1 - 1/(1 + k d^2).
#[inline(always)]
pub(super) fn mean_deficit<R: Real>(k: f64, difference: R) -> R {
    let t = R::of(k) * (difference * difference);
    t / (R::ONE + t)
}

/// 1 - (k + 2 s1 s2)/(k + s1^2 + s2^2), not below 0.
#[inline(always)]
pub(super) fn contrast_deficit(k: f64, sum_of_variances: f64, product: f64) -> f64 {
    (sum_of_variances - 2.0 * product).max(0.0) / (k + sum_of_variances)
}

/// 1 - (k + s12)/(k + s1 s2).
#[inline(always)]
pub(super) fn structure_deficit(k: f64, covariance: f64, product: f64) -> f64 {
    (product - covariance.max(-product).min(product)) / (k + product)
}

/// Sum of a row in a fixed order: one partial sum per lane, then the lanes from left to right.
///
/// Leaving out windows of error 0 at either end does not change the bits, if the row begins at a multiple of the lanes.
#[inline(always)]
pub(super) fn row_sum<R: Real>(row: &[R]) -> f64 {
    let mut sums = [R::ZERO; LANES];
    let (chunks, rest) = row.as_chunks::<LANES>();
    for chunk in chunks {
        for i in 0..LANES {
            sums[i] += chunk[i];
        }
    }
    for i in 0..rest.len() {
        sums[i] += rest[i];
    }
    sums.iter().map(|sum| sum.widen()).sum()
}

/// As [`row_sum`], of the products of two rows.
#[inline(always)]
pub(super) fn weighted_row_sum<R: Real>(row: &[R], weights: &[R]) -> f64 {
    let mut sums = [R::ZERO; LANES];
    let ((chunks, rest), (weight_chunks, weight_rest)) = (row.as_chunks::<LANES>(), weights.as_chunks::<LANES>());
    for j in 0..chunks.len() {
        for i in 0..LANES {
            sums[i] += weight_chunks[j][i] * chunks[j][i];
        }
    }
    for i in 0..rest.len() {
        sums[i] += weight_rest[i] * rest[i];
    }
    sums.iter().map(|sum| sum.widen()).sum()
}
