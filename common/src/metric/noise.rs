//! The noise of a photo, and what it alone costs in CSSIM (design section 6).

use super::{Judge, JudgeOptions, MetricError, Score};
use crate::{
    image::Image,
    math::{
        cell,
        elementary::{ln, sin_cos},
        sampling::{key, uniform},
        to_f32,
    },
};
use std::f64::consts::{FRAC_PI_2, TAU};

/// Rows and columns of a patch.
const PATCH: usize = 8;

/// Fewest patches that tell the noise.
const FEWEST: usize = 8;

/// The share of patches, the smoothest ones, that count: others have structure.
const SMOOTH: f64 = 0.3;

/// For Gaussian noise, the mean over the smoothest patches is below that over all patches by this factor (at [`SMOOTH`], for patches of
/// [`PATCH`]; tested).
const OF_SMOOTHEST: f64 = 0.87;

/// The relative noise of a photo: the standard deviation of a channel's noise over the channel's value, in smooth patches; `None` if fewer
/// than eight patches lie inside the object.
///
/// Immerkær's operator (*Fast Noise Variance Estimation*, CVIU 64(2), 1996), a difference of two Laplacians, is blind to slopes and
/// curvatures. Its mean absolute value over a patch, over the patch's mean, is taken over the smoothest patches. `is_usable` says of each pixel
/// whether it shows the object alone, and is not clipped.
#[must_use]
pub fn relative_noise(photo: &Image, is_usable: &[bool]) -> Option<f64> {
    let (width, height) = (photo.width(), photo.height());
    let (mut patches, mut whole) = (Vec::new(), 0);
    for (y, x) in (0..height / PATCH).flat_map(|y| (0..width / PATCH).map(move |x| (y * PATCH, x * PATCH))) {
        let inside = |y: usize, x: usize| is_usable[y * width + x];
        let is_whole = (y..y + PATCH).all(|y| (x..x + PATCH).all(|x| inside(y, x)));
        whole += usize::from(is_whole);
        patches.extend(is_whole.then(|| (0..3).filter_map(|c| of_patch(photo, (x, y), c))).into_iter().flatten());
    }
    if whole < FEWEST || patches.is_empty() {
        return None;
    }
    patches.sort_by(f64::total_cmp);
    let count = cell(SMOOTH * patches.len() as f64, patches.len()).max(1);
    Some(patches[..count].iter().sum::<f64>() / count as f64 / OF_SMOOTHEST)
}

/// The relative noise of a channel in a patch; `None` where it is black.
fn of_patch(photo: &Image, (left, top): (usize, usize), channel: usize) -> Option<f64> {
    let at = |x: usize, y: usize| f64::from(photo.pixels()[y * photo.width() + x][channel]);
    let (mut sum, mut mean) = (0.0, 0.0);
    for y in top + 1..top + PATCH - 1 {
        for x in left + 1..left + PATCH - 1 {
            let corners = at(x - 1, y - 1) + at(x + 1, y - 1) + at(x - 1, y + 1) + at(x + 1, y + 1);
            let sides = at(x, y - 1) + at(x - 1, y) + at(x + 1, y) + at(x, y + 1);
            sum += (corners - 2.0 * sides + 4.0 * at(x, y)).abs();
            mean += at(x, y);
        }
    }
    // The operator has a standard deviation of 6 times that of the noise; for Gaussian noise its mean absolute value is that times sqrt(2/pi).
    (mean > 0.0 && sum.is_finite()).then(|| sum * FRAC_PI_2.sqrt() / 6.0 / mean)
}

/// CSSIM between a match and the same match with Gaussian noise in proportion to its values: what noise alone costs.
///
/// # Errors
/// If the match cannot be judged.
pub fn noise_floor(matched: &Image, scored: &[f32], exposure: f64, noise: f64) -> Result<Score, MetricError> {
    let judge = Judge::new(matched, scored, exposure, &JudgeOptions::default())?;
    let mut noisy = matched.clone();
    for (i, pixel) in noisy.pixels_mut().iter_mut().enumerate() {
        for (c, value) in pixel.iter_mut().enumerate() {
            *value *= to_f32(1.0 + noise * gaussian(&[i as u64, c as u64]));
        }
    }
    judge.score(&noisy)
}

/// A standard normal number (Box & Muller 1958).
fn gaussian([pixel, channel]: &[u64; 2]) -> f64 {
    let draw = |k: u64| uniform(key(&[*pixel, *channel, k]));
    (-2.0 * ln(1.0 - draw(0))).sqrt() * sin_cos(TAU * draw(1)).0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ball of smooth shading with a highlight and a grid of texture in its left half, with noise.
    fn photo(noise: f64) -> (Image, Vec<f32>) {
        const SIZE: usize = 96;
        let mut image = Image::new(SIZE, SIZE);
        let mut coverage = vec![0.0; SIZE * SIZE];
        for (i, pixel) in image.pixels_mut().iter_mut().enumerate() {
            let (x, y) = ((i % SIZE) as f64 / 48.0 - 1.0, (i / SIZE) as f64 / 48.0 - 1.0);
            let r2 = x * x + y * y;
            if r2 >= 1.0 {
                continue;
            }
            coverage[i] = 1.0;
            let texture = if x < -0.3 && (i / 3) % 2 == 0 { 0.2 } else { 0.0 };
            let light = 0.3 + 0.4 * (1.0 - r2).sqrt() + texture + 3.0 / (1.0 + 200.0 * ((x - 0.3).powi(2) + y * y));
            for (c, value) in pixel.iter_mut().enumerate() {
                let level = light * [1.0, 0.7, 0.4][c];
                *value = to_f32(level * (1.0 + noise * gaussian(&[(7 * i) as u64, c as u64])));
            }
        }
        (image, coverage)
    }

    fn usable(coverage: &[f32]) -> Vec<bool> {
        coverage.iter().map(|&c| c >= 1.0).collect()
    }

    #[test]
    fn noise_is_found_beside_texture_and_highlight() {
        for noise in [0.002, 0.005, 0.01, 0.02] {
            let (image, coverage) = photo(noise);
            let found = relative_noise(&image, &usable(&coverage)).unwrap();
            assert!((found / noise - 1.0).abs() < 0.15, "{noise}: {found}");
        }
        let (clean, coverage) = photo(0.0);
        assert!(relative_noise(&clean, &usable(&coverage)).unwrap() < 0.0005);
        assert_eq!(relative_noise(&clean, &vec![false; coverage.len()]), None);
    }

    #[test]
    fn noise_costs_what_it_costs_between_two_photos() {
        let ((clean, coverage), (noisy, _)) = (photo(0.0), photo(0.01));
        let judge = Judge::new(&clean, &coverage, 1.0, &JudgeOptions::default()).unwrap();
        let score = judge.score(&noisy).unwrap();
        let floor = noise_floor(&clean, &coverage, 1.0, 0.01).unwrap().cssim;
        assert!((floor / score.cssim - 1.0).abs() < 0.2, "{floor} {}", score.cssim);
        assert_eq!(noise_floor(&clean, &coverage, 1.0, 0.0).unwrap().cssim, 0.0);
    }
}
