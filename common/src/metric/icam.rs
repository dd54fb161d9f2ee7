//! iCAM's spatial filter: contrast sensitivity of luminance, red-green and blue-yellow, by Fourier transform in
//! YCC-RIT.
//!
//! Source: Preiss, Fernandes & Urban 2014 and the authors' `FilterImageCSF.m` (Johnson & Fairchild's contrast
//! sensitivity functions). The image is mirrored on all sides to three times its size. Along each axis the frequency
//! bin `floor(n/2)` has the given cycles per degree. The mean of luminance is subtracted before the filter and added
//! after it.
//!
//! The transform is `rustfft` without its SIMD kernels, so that the rounding does not depend on the processor.

use rayon::prelude::*;
use rustfft::num_complex::Complex;
use rustfft::{Fft, FftDirection, FftPlanner};

use super::colour::Matrix;
use super::planes::Planes;
use crate::math::{
    elementary::{exp, pow},
    real::Real,
};

/// XYZ to YCC-RIT.
pub(super) const XYZ_TO_YCC: Matrix = [[0.0556, 0.9981, -0.0254], [0.9510, -0.9038, 0.0], [0.0386, 1.0822, -1.0276]];

/// Filters three YCC planes in place.
pub(super) fn filter<R: Real>(planes: &mut Planes<R, 3>, cycles_per_degree: f64) {
    let sensitivities: [fn(f64) -> f64; 3] = [luminance_sensitivity, red_green_sensitivity, blue_yellow_sensitivity];
    let (width, height) = (planes.width(), planes.height());
    let filtered: Vec<Vec<f64>> = sensitivities
        .into_iter()
        .enumerate()
        .map(|(channel, sensitivity)| {
            let values: Vec<f64> =
                (0..height).flat_map(|y| planes.row_of(channel, y)[..width].iter().map(|x| x.widen())).collect();
            let mean = if channel == 0 { values.iter().sum::<f64>() / values.len() as f64 } else { 0.0 };
            filter_channel(&values, mean, width, |f| sensitivity(cycles_per_degree * f))
        })
        .collect();
    planes.fill_rows(
        || (),
        |(), y, rows| {
            for (row, values) in rows.into_iter().zip(&filtered) {
                let values = &values[y * width..(y + 1) * width];
                row.iter_mut().zip(values).for_each(|(out, &value)| *out = R::of(value));
            }
        },
    );
}

/// Filters one channel by a gain of the radial frequency, which is 1 at bin `floor(n/2)` of an axis.
fn filter_channel(values: &[f64], mean: f64, width: usize, gain: impl Fn(f64) -> f64 + Sync) -> Vec<f64> {
    let height = values.len() / width;
    let (columns, rows) = (3 * width, 3 * height);
    let mirrored = |i: usize, n: usize| {
        if i < n {
            n - 1 - i
        } else if i < 2 * n {
            i - n
        } else {
            3 * n - 1 - i
        }
    };
    let mut spectrum: Vec<Complex<f64>> = (0..columns * rows)
        .map(|i| {
            let (x, y) = (mirrored(i % columns, width), mirrored(i / columns, height));
            Complex::new(values[y * width + x] - mean, 0.0)
        })
        .collect();
    transform_rows(&mut spectrum, columns, FftDirection::Forward);
    let mut spectrum = transpose(&spectrum, columns);
    transform_rows(&mut spectrum, rows, FftDirection::Forward);
    // The gain is even in both frequencies, so a quarter of the gains is enough.
    let gains: Vec<Vec<f64>> = (0..=columns / 2)
        .into_par_iter()
        .map(|u| {
            let fu = axis_frequency(u, columns);
            let radial = |fv: f64| (fu * fu + fv * fv).sqrt();
            (0..=rows / 2).map(|v| gain(radial(axis_frequency(v, rows)))).collect()
        })
        .collect();
    spectrum.par_chunks_exact_mut(rows).enumerate().for_each(|(u, line)| {
        let gains = &gains[u.min(columns - u)];
        line.iter_mut().enumerate().for_each(|(v, value)| *value *= gains[v.min(rows - v)]);
    });
    transform_rows(&mut spectrum, rows, FftDirection::Inverse);
    let mut spectrum = transpose(&spectrum, rows);
    transform_rows(&mut spectrum, columns, FftDirection::Inverse);
    let scale = 1.0 / (columns * rows) as f64;
    (0..values.len()).map(|i| spectrum[(i / width + height) * columns + i % width + width].re * scale + mean).collect()
}

/// Frequency of a bin up to `floor(n/2)`, relative to that of bin `floor(n/2)`.
fn axis_frequency(bin: usize, n: usize) -> f64 {
    bin as f64 / (n / 2) as f64
}

fn transform_rows(values: &mut [Complex<f64>], length: usize, direction: FftDirection) {
    let plan: std::sync::Arc<dyn Fft<f64>> = FftPlanner::new().plan_fft(length, direction);
    values.par_chunks_exact_mut(length).for_each(|row| plan.process(row));
}

fn transpose(values: &[Complex<f64>], columns: usize) -> Vec<Complex<f64>> {
    let rows = values.len() / columns;
    (0..values.len()).into_par_iter().map(|i| values[i % rows * columns + i / rows]).collect()
}

/// Low-pass: 1 up to 13.3395 cycles per degree, where the band-pass function falls below 1.
fn luminance_sensitivity(f: f64) -> f64 {
    if f <= 13.3395 { 1.0 } else { 0.63 * pow(f, 0.616) * exp(-0.085 * f) }
}

fn red_green_sensitivity(f: f64) -> f64 {
    (91.228 * exp(-0.0003 * pow(f, 2.803)) + 74.907 * exp(-0.0038 * pow(f, 2.601))) / (91.228 + 74.907)
}

fn blue_yellow_sensitivity(f: f64) -> f64 {
    (5.623 * exp(-0.00001 * pow(f, 3.4066)) + 41.9363 * exp(-0.083 * pow(f, 1.3684))) / (5.623 + 41.9363)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gain_of_one_keeps_the_values_and_a_gain_of_zero_keeps_the_mean() {
        let (width, height) = (7, 10);
        let values: Vec<f64> = (0..width * height).map(|i| f64::from(u8::try_from(i * 37 % 101).unwrap())).collect();
        let same = filter_channel(&values, 3.0, width, |_| 1.0);
        assert!(same.iter().zip(&values).all(|(a, b)| (a - b).abs() < 1e-12));
        assert!(filter_channel(&values, 3.0, width, |_| 0.0).iter().all(|x| (x - 3.0).abs() < 1e-12));
    }

    #[test]
    fn a_cosine_of_the_mirrored_image_is_multiplied_by_the_gain_of_its_frequency() {
        // Half-sample mirroring continues cos(pi k (x + 1/2) / n): its period is 2n/k, so 3n columns hold 3k/2 periods.
        let (n, k) = (24, 6);
        let wave = |x: usize| libm::cos(std::f64::consts::PI * f64::from(k) * (x as f64 + 0.5) / n as f64);
        let values: Vec<f64> = (0..n * n).map(|i| wave(i % n)).collect();
        let filtered = filter_channel(&values, 0.0, n, |f| 1.0 - f);
        let gain = 1.0 - 9.0 / 36.0;
        assert!(filtered.iter().zip(&values).all(|(a, b)| (a - gain * b).abs() < 1e-12));
    }

    #[test]
    fn sensitivities_are_one_for_a_constant() {
        assert_eq!([luminance_sensitivity(0.0), red_green_sensitivity(0.0), blue_yellow_sensitivity(0.0)], [1.0; 3]);
        assert!((luminance_sensitivity(13.34) - 1.0).abs() < 1e-4);
    }
}
