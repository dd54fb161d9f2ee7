//! Radiance by the direct integrator, with its own standard error.

use super::Scene;
use lookalike::{
    brdf::{Angles, Lobe, Reflectance, lobe_terms},
    math::{Rgb, Vec3},
    render::{integrator::Integrator, transport::Pixel},
};
use rayon::prelude::*;
use serde_json::{Value, json};

/// How many independent randomisations a standard error is computed from.
pub const RANDOMISATIONS: u32 = 8;

/// A lobe split as tables split it, the parts in different channels: red `1 - F5`, green `F5`, blue the whole lobe. One rendering thus
/// gives the reference of every term, each under one channel of the light.
#[derive(Debug, Clone, Copy)]
pub struct SplitLobe {
    /// The lobe.
    pub lobe: &'static dyn Lobe,
    /// Its width; ignored by a lobe of fixed shape.
    pub width: f64,
}

impl Reflectance for SplitLobe {
    fn eval_cos(&self, wi_local: Vec3, wo_local: Vec3) -> Rgb {
        if wi_local.z <= 0.0 || wo_local.z <= 0.0 {
            return Rgb::ZERO;
        }
        let angles = Angles::new(Vec3::Z, wi_local, wo_local);
        let value = self.lobe.eval(&angles, self.width);
        if lobe_terms(self.lobe) == 1 {
            Rgb::splat(value)
        } else {
            Rgb::new(1.0 - angles.f5(), angles.f5(), 1.0) * value
        }
    }

    fn sampling_alphas(&self) -> Vec<f64> {
        vec![self.lobe.equivalent_alpha(self.width).unwrap_or(1.0)]
    }
}

/// Radiance of some pixels by Monte Carlo integration.
#[derive(Debug, Clone)]
pub struct Reference {
    /// Mean over the randomisations, per pixel.
    pub radiance: Vec<Rgb>,
    /// Variance of `radiance`, per pixel.
    pub variance: Vec<Rgb>,
    /// Per channel, the root mean square over the pixels of the standard error of `radiance`.
    pub standard_error: Rgb,
}

/// The sample counts and the target error of a reference.
#[derive(Debug, Clone, Copy)]
pub struct Effort {
    /// Samples per pixel at the start, over all randomisations.
    pub first: u32,
    /// A pixel gets four times the samples as long as its standard error, in any channel, is above this share of `level`.
    pub standard_error: f64,
    /// The scale of errors, per channel: mean radiance over the object.
    pub level: Rgb,
    /// The most samples that a pixel gets.
    pub most: u32,
}

impl Reference {
    /// Integrates `pixels`; references with different `seed` use different random numbers.
    #[must_use]
    pub fn new(scene: &Scene, pixels: &[Pixel], reflectance: &dyn Reflectance, effort: Effort, seed: u64) -> Self {
        let estimate = |pixel: Pixel, samples: u32| Estimate::new(scene, pixel, reflectance, samples, seed);
        let mut estimates: Vec<Estimate> = pixels.par_iter().map(|&pixel| estimate(pixel, effort.first)).collect();
        let limit = effort.level * effort.standard_error;
        estimates.par_iter_mut().zip(pixels).for_each(|(current, &pixel)| {
            let mut samples = effort.first;
            while current.variance.cmpgt(limit * limit).any() && samples < effort.most {
                samples = samples.saturating_mul(4).min(effort.most);
                *current = estimate(pixel, samples);
            }
        });
        Self::from_moments(estimates.iter().map(|e| e.mean).collect(), estimates.iter().map(|e| e.variance).collect())
    }

    /// Mean radiance of each pixel, and the variance of that mean.
    #[must_use]
    pub fn from_moments(radiance: Vec<Rgb>, variance: Vec<Rgb>) -> Self {
        let mean_variance = variance.iter().sum::<Rgb>() / variance.len() as f64;
        Self { radiance, variance, standard_error: Rgb::from_array(mean_variance.to_array().map(f64::sqrt)) }
    }

    /// The stored form: mean and variance of each pixel, red, green, blue.
    #[must_use]
    pub fn to_json(&self) -> Value {
        json!({ "mean": self.radiance.iter().map(|rgb| rounded(*rgb, 6)).collect::<Vec<_>>(),
                "variance": self.variance.iter().map(|rgb| rounded(*rgb, 2)).collect::<Vec<_>>() })
    }

    /// Reads the form that [`to_json`](Self::to_json) writes.
    ///
    /// # Panics
    /// When the value has another form.
    #[must_use]
    pub fn from_json(stored: &Value) -> Self {
        let list = |name: &str| stored[name].as_array().expect(name).iter().map(rgb).collect();
        Self::from_moments(list("mean"), list("variance"))
    }
}

/// A colour rounded to this many significant digits.
#[must_use]
pub(super) fn rounded(colour: Rgb, digits: usize) -> [f64; 3] {
    colour.to_array().map(|x| format!("{x:.*e}", digits - 1).parse().expect("a number"))
}

/// Reads a colour stored by [`rounded`].
pub(super) fn rgb(stored: &Value) -> Rgb {
    Rgb::from_array(std::array::from_fn(|channel| stored[channel].as_f64().expect("three numbers")))
}

/// One pixel: the mean over randomisations and the variance of that mean.
#[derive(Debug, Clone, Copy)]
struct Estimate {
    mean: Rgb,
    variance: Rgb,
}

impl Estimate {
    fn new(scene: &Scene, pixel: Pixel, reflectance: &dyn Reflectance, samples: u32, seed: u64) -> Self {
        let (geometry, light) = (&scene.geometry, &scene.light);
        let run = |k: u32| {
            let seed = seed * u64::from(RANDOMISATIONS) + u64::from(k);
            Integrator { geometry, light, samples: samples / RANDOMISATIONS, seed }.pixel(pixel, reflectance)
        };
        let runs: Vec<Rgb> = (0..RANDOMISATIONS).map(run).collect();
        let n = f64::from(RANDOMISATIONS);
        let mean = runs.iter().sum::<Rgb>() / n;
        let squares: Rgb = runs.iter().map(|r| (*r - mean) * (*r - mean)).sum();
        Self { mean, variance: squares / (n * (n - 1.0)) }
    }
}
