//! The demo's "photograph": the target material under the demo's light, with noise like that of a camera.
//!
//! The light is integrated by the adaptive cut of the transport tables, but the material is evaluated exactly for each
//! direction: no table, no basis lobes, no interpolation over widths. Each pixel is evaluated at one position.

use super::material::Target;
use lookalike::{
    brdf::{Reflectance, Tail},
    image::Image,
    light::Environment,
    math::{
        Rgb, Vec3,
        elementary::{ln, sin_cos},
        frame::Frame,
        narrow,
        sampling::{key, uniform},
        simd,
    },
    render::{
        cut::{Band, Cut},
        point::Point,
        pyramid::LightPyramid,
    },
    scene::Geometry,
};
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Largest error of a node of the light, in units of the mean radiance, for a lobe of albedo 1.
const TOLERANCE: f64 = 1e-2;
/// Camera noise: photon noise at mean radiance, and read noise, as shares of the mean radiance.
const PHOTON_NOISE: f64 = 0.004;
const READ_NOISE: f64 = 0.001;
const SEED: u64 = 2020;

/// Renders the photo: linear, multiplied by coverage at the silhouette, black outside. Every machine gives the same bits.
#[must_use]
pub fn take(geometry: &Geometry, light: &Environment) -> Image {
    let pyramid = LightPyramid::new(light.clone());
    let (width, height) = (geometry.width(), geometry.height());
    let radiance: Vec<Rgb> = (0..width * height)
        .into_par_iter()
        .map_init(
            || Cut::new(&pyramid),
            |cut, i| {
                let (column, row) = (i % width, i / width);
                radiance_at(geometry, column, row, cut) * f64::from(geometry.coverage(column, row))
            },
        )
        .collect();
    let lit = radiance.iter().filter(|r| r.max_element() > 0.0);
    let mean = lit.clone().sum::<Rgb>().element_sum() / (3.0 * lit.count().max(1) as f64);
    let noisy = radiance.iter().enumerate().map(|(i, r)| narrow(with_noise(*r, mean, i as u64)));
    Image::from_pixels(width, height, noisy.collect())
}

/// Radiance at the centre of a pixel or, if that misses the object, at the first of a few positions that hit it.
fn radiance_at(geometry: &Geometry, column: usize, row: usize, cut: &mut Cut<'_>) -> Rgb {
    let positions = [(0.5, 0.5), (0.2, 0.2), (0.8, 0.2), (0.2, 0.8), (0.8, 0.8)];
    let see = |(x, y)| geometry.point(column as f64 + x, row as f64 + y);
    let Some(point) = positions.into_iter().find_map(see).and_then(|p| Point::new(p.normal, p.view)) else {
        return Rgb::ZERO;
    };
    let alphas = Target.sampling_alphas();
    let sharpest = alphas.iter().fold(1.0_f64, |least, a| least.min(*a));
    cut.refine(&point, 0.0, Band::Glossy(sharpest, 1.0, Tail::Short), TOLERANCE);
    let frame = Frame::from_normal(point.normal);
    let wo = frame.to_local(point.view);
    let lights: Vec<(Vec3, Rgb)> = cut.directions().collect();
    let mut reflected = vec![Rgb::ZERO; lights.len()];
    simd::dispatch(
        #[inline(always)]
        || {
            for (out, &(direction, energy)) in reflected.iter_mut().zip(&lights) {
                *out = energy * Target.eval_cos(frame.to_local(direction).normalize(), wo);
            }
        },
    );
    reflected.iter().sum()
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

/// A normally distributed number (Box & Muller 1958). A pure function of the key.
fn gaussian(key: u64) -> f64 {
    let radius = (-2.0 * ln(1.0 - uniform(key))).sqrt();
    radius * sin_cos(TAU * uniform(key ^ 0x5555_5555_5555_5555)).1
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
        // The standard errors are 0.007 and 0.01; the bounds are five of them.
        assert!(mean.abs() < 0.035 && (variance - 1.0).abs() < 0.05, "{mean} {variance}");
    }
}
