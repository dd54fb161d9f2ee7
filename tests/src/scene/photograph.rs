//! Photographs of known materials: the pixels of stage one with noise like that of measurements.
//!
//! They are rendered by quadrature that is far finer than the tables of stage one in nodes, positions in the pixel and widths, so that
//! interpolation between widths is negligible. The direct integrator, against which both are tested in the suite `physics`, would need
//! hours until its noise is small beside the noise that is added.

use super::Scene;
use lookalike::{
    brdf::Material,
    math::{
        Rgb, luminance, narrow,
        sampling::{key, uniform},
    },
    render::{
        integrator::Integrator,
        knots::Knots,
        subset::{Candidate, PixelSubset, SampleCount, Sampling},
        transport::{Accuracy, Pixel, TransportPlan},
    },
};
use rayon::prelude::*;

/// The data of a photograph that stage one uses.
#[derive(Debug)]
pub struct Photograph {
    /// Pixels with their weights.
    pub subset: PixelSubset,
    /// Their radiance.
    pub pixels: Vec<[f32; 3]>,
    /// Mean luminance over the object.
    pub mean_radiance: f64,
    /// Variance of the noise of every pixel and channel.
    pub variance: f64,
}

/// Settings of a photograph.
#[derive(Debug, Clone, Copy)]
pub struct Exposure {
    /// Standard deviation of the Gaussian noise, as a share of mean luminance over the object.
    pub noise: f64,
    /// Draws of stage one.
    pub draws: u32,
    /// Seed of noise and draws.
    pub seed: u64,
}

impl Photograph {
    /// Photographs a material: importance sampling uses a cheap rendering; the pixels drawn are integrated accurately.
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
        let noise = exposure.noise * mean_radiance;
        let noisy = |(&pixel, radiance): (&Pixel, Rgb)| narrow(radiance + gaussian(exposure.seed, pixel) * noise);
        let exact = radiance(scene, material, &subset.pixels);
        Self {
            pixels: subset.pixels.iter().zip(exact).map(noisy).collect(),
            subset,
            mean_radiance,
            variance: noise * noise,
        }
    }
}

/// Radiance without noise.
fn radiance(scene: &Scene, material: &Material, pixels: &[Pixel]) -> Vec<Rgb> {
    let (model, parameters) = (material.model(), material.parameters());
    let width = model.lobes().iter().find_map(|basis| basis.width_at(parameters)).unwrap_or(0.5);
    let plan = TransportPlan::of_model(model, Knots::covering(0.8 * width, 1.25 * width, 24.0), FINE);
    let table = plan.integrate(&scene.geometry, &scene.pyramid, pixels);
    let mut planes = table.planes();
    table.radiance(model, parameters, &mut planes);
    (0..pixels.len()).map(|p| Rgb::new(planes[0][p], planes[1][p], planes[2][p])).collect()
}

/// Accuracy of the photograph: a tenth of the errors of stage one.
const FINE: Accuracy = Accuracy { tolerance: 1e-5, footprint: 0.1 };

/// Samples per pixel of the rendering that importance sampling uses.
const CHEAP_SAMPLES: u32 = 64;

/// Three independent standard normal numbers for a pixel (Box & Muller 1958).
fn gaussian(seed: u64, [column, row]: Pixel) -> Rgb {
    let one = |channel: u64| {
        let u = |k: u64| uniform(key(&[seed, u64::from(row), u64::from(column), channel, k]));
        (-2.0 * (1.0 - u(0)).ln()).sqrt() * (std::f64::consts::TAU * u(1)).cos()
    };
    Rgb::new(one(0), one(1), one(2))
}
