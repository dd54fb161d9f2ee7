//! The demo's "photograph": the target material by the direct integrator, with noise like that of a measurement.

use super::material::Target;
use lookalike::{
    image::Image,
    light::{Environment, LightDistribution},
    math::{
        Rgb,
        elementary::{ln, sin_cos},
        narrow,
        sampling::{key, uniform},
    },
    render::integrator::Integrator,
    scene::Geometry,
};
use rayon::prelude::*;
use std::{f64::consts::TAU, sync::Arc};

/// Samples per pixel; what they leave of noise adds to that of the camera.
const SAMPLES: u32 = 192;
/// Camera noise: photon noise at mean radiance, and read noise, as shares of the mean radiance.
const PHOTON_NOISE: f64 = 0.004;
const READ_NOISE: f64 = 0.001;
const SEED: u64 = 2020;

/// Takes the photo: linear, multiplied by coverage at the silhouette, black outside. The same bits on every machine.
#[must_use]
pub fn take(geometry: &Geometry, light: &Arc<Environment>) -> Image {
    let distribution = LightDistribution::new(Arc::clone(light));
    let integrator = Integrator { geometry, light: &distribution, samples: SAMPLES, seed: SEED };
    let (width, height) = (geometry.width(), geometry.height());
    let target = Target;
    let radiance: Vec<Rgb> = (0..width * height)
        .into_par_iter()
        .map(|i| {
            let (column, row) = (i % width, i / width);
            let coverage = f64::from(geometry.coverage(column, row));
            if coverage > 0.0 { integrator.pixel([index(column), index(row)], &target) * coverage } else { Rgb::ZERO }
        })
        .collect();
    let lit = radiance.iter().filter(|r| r.max_element() > 0.0);
    let mean = lit.clone().sum::<Rgb>().element_sum() / (3.0 * lit.count().max(1) as f64);
    let noisy = radiance.iter().enumerate().map(|(i, r)| narrow(with_noise(*r, mean, i as u64)));
    Image::from_pixels(width, height, noisy.collect())
}

/// Gaussian noise whose variance is a constant plus a part that grows with radiance.
fn with_noise(radiance: Rgb, mean: f64, pixel: u64) -> Rgb {
    if radiance.max_element() <= 0.0 {
        return radiance;
    }
    let channel = |c: usize| {
        let photons = PHOTON_NOISE * PHOTON_NOISE * mean * radiance[c];
        let read = READ_NOISE * READ_NOISE * mean * mean;
        (radiance[c] + (photons + read).sqrt() * gaussian(key(&[SEED, pixel, c as u64]))).max(0.0)
    };
    Rgb::new(channel(0), channel(1), channel(2))
}

/// A normally distributed number (Box & Muller 1958), a pure function of the key.
fn gaussian(key: u64) -> f64 {
    let radius = (-2.0 * ln(1.0 - uniform(key))).sqrt();
    radius * sin_cos(TAU * uniform(key ^ 0x5555_5555_5555_5555)).1
}

fn index(i: usize) -> u32 {
    u32::try_from(i).unwrap_or(u32::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_noise_is_normal() {
        let n = 20_000;
        let values: Vec<f64> = (0..n).map(|i| gaussian(key(&[7, i]))).collect();
        let mean = values.iter().sum::<f64>() / n as f64;
        let variance = values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / n as f64;
        // Standard errors 0.007 and 0.01; five of them.
        assert!(mean.abs() < 0.035 && (variance - 1.0).abs() < 0.05, "{mean} {variance}");
    }
}
