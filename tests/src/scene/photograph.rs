//! Photographs of known materials: the pixels of stage one by the direct integrator, with measured-like noise.

use super::{
    Scene,
    reference::{Effort, Reference},
};
use lookalike::{
    brdf::Material,
    math::{
        Rgb, luminance, narrow,
        sampling::{key, uniform},
    },
    render::{
        integrator::Integrator,
        subset::{Candidate, PixelSubset, SampleCount, Sampling},
        transport::Pixel,
    },
};
use rayon::prelude::*;

/// What stage one sees of a photograph.
#[derive(Debug)]
pub struct Photograph {
    /// Pixels with their weights.
    pub subset: PixelSubset,
    /// Their radiance.
    pub pixels: Vec<[f32; 3]>,
    /// Mean luminance over the object.
    pub mean_radiance: f64,
    /// Variance of every pixel: the noise that was added, and the integrator's own, which matters in pixels that are hundreds of
    /// times brighter than the mean.
    pub variance: Vec<Rgb>,
    /// Median over the pixels of the integrator's standard error, the worst channel.
    pub standard_error: f64,
}

/// How a photograph is taken.
#[derive(Debug, Clone, Copy)]
pub struct Exposure {
    /// Standard deviation of the Gaussian noise, as a share of mean luminance over the object.
    pub noise: f64,
    /// Draws of stage one.
    pub draws: u32,
    /// Seed of noise, integration and draws.
    pub seed: u64,
    /// Of the integration; standard errors are in units of mean luminance.
    pub effort: Effort,
}

impl Photograph {
    /// Photographs a material: importance sampling sees a cheap rendering, the pixels drawn are integrated well.
    ///
    /// # Panics
    /// When the object reflects no light.
    #[must_use]
    pub fn take(scene: &Scene, material: &Material, exposure: Exposure) -> Self {
        let interior = scene.interior();
        let cheap = Integrator {
            geometry: &scene.geometry,
            light: &scene.light,
            samples: CHEAP_SAMPLES,
            seed: exposure.seed ^ 0xC0FF_EE00,
        };
        let intensities: Vec<f64> = interior.par_iter().map(|&p| luminance(cheap.pixel(p, material))).collect();
        let mean_radiance = intensities.iter().sum::<f64>() / interior.len() as f64;
        let candidates: Vec<Candidate> =
            interior.iter().zip(&intensities).map(|(&pixel, &intensity)| Candidate { pixel, intensity }).collect();
        let count = SampleCount::Draws(exposure.draws);
        let subset = PixelSubset::draw(&candidates, count, Sampling::Importance, exposure.seed, 0)
            .expect("the object reflects light");
        let effort = Effort { level: Rgb::splat(mean_radiance), ..exposure.effort };
        let reference = Reference::new(scene, &subset.pixels, material, effort, exposure.seed);
        let noise = exposure.noise * mean_radiance;
        let noisy = |(&pixel, &radiance): (&Pixel, &Rgb)| narrow(radiance + gaussian(exposure.seed, pixel) * noise);
        let mut errors: Vec<f64> = reference.variance.iter().map(|v| v.max_element().sqrt()).collect();
        errors.sort_by(f64::total_cmp);
        Self {
            pixels: subset.pixels.iter().zip(&reference.radiance).map(noisy).collect(),
            subset,
            mean_radiance,
            variance: reference.variance.iter().map(|v| *v + Rgb::splat(noise * noise)).collect(),
            standard_error: errors[errors.len() / 2],
        }
    }
}

/// Samples per pixel of the rendering that importance sampling sees.
const CHEAP_SAMPLES: u32 = 64;

/// Three independent standard normal numbers for a pixel (Box & Muller 1958).
fn gaussian(seed: u64, [column, row]: Pixel) -> Rgb {
    let one = |channel: u64| {
        let u = |k: u64| uniform(key(&[seed, u64::from(row), u64::from(column), channel, k]));
        (-2.0 * (1.0 - u(0)).ln()).sqrt() * (std::f64::consts::TAU * u(1)).cos()
    };
    Rgb::new(one(0), one(1), one(2))
}
