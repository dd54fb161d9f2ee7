//! A full image by the direct integrator, with an estimate of its noise.
//!
//! Each pixel is rendered twice, with two independent randomisations of half the samples. The image is their mean; the noise is
//! estimated from their difference. Pixels are multiplied by their coverage, so an edge pixel shows the object over black.

use super::integrator::Integrator;
use crate::{
    brdf::Reflectance,
    image::Image,
    light::LightDistribution,
    math::{Rgb, luminance, narrow, sampling::key},
    scene::Geometry,
};
use rayon::prelude::*;

/// The scene to render, and the number of samples.
#[derive(Debug, Clone, Copy)]
pub struct Shot<'a> {
    /// The object and the camera.
    pub geometry: &'a Geometry,
    /// The light with its sampling density.
    pub light: &'a LightDistribution,
    /// The material of the object.
    pub reflectance: &'a dyn Reflectance,
    /// Samples per pixel.
    pub samples: u32,
    /// Seed of the run.
    pub seed: u64,
}

/// A rendered image.
#[derive(Debug, Clone, PartialEq)]
pub struct Rendering {
    /// Mean radiance over the covered part of each pixel times the coverage: linear Rec. 709 over black.
    pub image: Image,
    /// How much of each pixel is the object, in \[0, 1\]; `height x width`, row-major.
    pub coverage: Vec<f32>,
    /// Mean radiance over the object.
    pub mean_radiance: Rgb,
    /// `None` with a single sample, or if the object is black.
    pub noise: Option<Noise>,
}

/// The standard error of pixels, over those that the object covers completely.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Of a typical pixel, relative to its own luminance: the median over the pixels, scaled to a standard deviation. It corresponds
    /// to the visible noise.
    pub typical: f64,
    /// Root mean square over pixels and channels, relative to the mean radiance (mean of the channels). Highlights dominate it.
    pub rms: f64,
}

impl Shot<'_> {
    /// Renders the image, its rows in parallel; the result is the same bit for bit on any number of threads. `row_done` is called once
    /// per row, in any order, from any thread.
    #[must_use]
    pub fn render(&self, row_done: impl Fn() + Sync) -> Rendering {
        let (width, height) = (self.geometry.width(), self.geometry.height());
        let row = |row: usize| {
            let pixels: Vec<Pixel> = (0..width).map(|column| self.pixel(column, row)).collect();
            row_done();
            pixels
        };
        let pixels: Vec<Pixel> = (0..height).into_par_iter().flat_map_iter(row).collect();
        let covered = pixels.iter().map(|p| f64::from(p.coverage)).sum::<f64>();
        let total = pixels.iter().fold(Rgb::ZERO, |sum, p| sum + p.radiance * f64::from(p.coverage));
        let mean_radiance = if covered > 0.0 { total / covered } else { Rgb::ZERO };
        let shown = |p: &Pixel| narrow(p.radiance * f64::from(p.coverage));
        Rendering {
            image: Image::from_pixels(width, height, pixels.iter().map(shown).collect()),
            coverage: pixels.iter().map(|p| p.coverage).collect(),
            mean_radiance,
            noise: noise(&pixels, mean_radiance),
        }
    }

    fn pixel(&self, column: usize, row: usize) -> Pixel {
        let coverage = self.geometry.coverage(column, row);
        if coverage == 0.0 {
            return Pixel { radiance: Rgb::ZERO, coverage, error: None };
        }
        // An image in memory never has more than `u32::MAX` columns or rows.
        let place = [column, row].map(|n| u32::try_from(n).unwrap_or(u32::MAX));
        let half = |samples: u32, half: u64| {
            let Self { geometry, light, .. } = *self;
            let seed = key(&[STAGE, self.seed, half]);
            Integrator { geometry, light, samples, seed }.pixel(place, self.reflectance)
        };
        let (first, second) = (self.samples - self.samples / 2, self.samples / 2);
        if second == 0 {
            return Pixel { radiance: half(first, 0), coverage, error: None };
        }
        let (a, b) = (half(first, 0), half(second, 1));
        let share = f64::from(first) / f64::from(self.samples);
        Pixel { radiance: a * share + b * (1.0 - share), coverage, error: Some((a - b) * 0.5) }
    }
}

/// A rendered pixel.
#[derive(Debug, Clone, Copy)]
struct Pixel {
    /// Mean over the covered part.
    radiance: Rgb,
    coverage: f32,
    /// Half the difference of two estimates: its mean square is the variance of their mean.
    error: Option<Rgb>,
}

fn noise(pixels: &[Pixel], mean_radiance: Rgb) -> Option<Noise> {
    let full = || pixels.iter().filter(|p| p.coverage == 1.0).filter_map(|p| Some((p.radiance, p.error?)));
    let (sum, count) = full().fold((0.0, 0.0), |(sum, count), (_, error)| (sum + error.length_squared(), count + 3.0));
    let lit = full().map(|(radiance, error)| (luminance(radiance), luminance(error).abs())).filter(|&(l, _)| l > 0.0);
    let mut relative: Vec<f64> = lit.map(|(luminance, error)| error / luminance).collect();
    relative.sort_by(f64::total_cmp);
    let median = relative.get(relative.len() / 2)?;
    Some(Noise {
        typical: median / HALF_NORMAL_MEDIAN,
        rms: (sum / count).sqrt() / (mean_radiance.element_sum() / 3.0),
    })
}

/// The median of |x| for a normal x of standard deviation 1.
const HALF_NORMAL_MEDIAN: f64 = 0.674_489_750_196_081_7;

/// Part of the key of the random numbers, so that they differ from those of other users of the integrator.
const STAGE: u64 = 0x1_3A6E;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        brdf::{CookTorrance, Ggx, Material},
        light::Environment,
        scene::{Camera, Circle},
    };
    use std::sync::{
        Arc,
        atomic::{AtomicUsize, Ordering},
    };

    fn scene(texel: impl Fn(usize) -> [f32; 3]) -> (Geometry, LightDistribution) {
        let map = Image::from_pixels(16, 8, (0..128).map(texel).collect());
        let geometry = Geometry::sphere(24, 20, Circle::inscribed(24, 20), Camera::Orthographic).unwrap();
        (geometry, LightDistribution::new(Arc::new(Environment::new(map).unwrap())))
    }

    #[test]
    fn a_diffuse_sphere_in_constant_light_shows_its_albedo_times_coverage() {
        let (geometry, light) = scene(|_| [2.0; 3]);
        let parameters = vec![0.5, 0.25, 0.125, 0.0, 0.0, 0.0, 0.0, 0.3];
        let paint = Material::new(&CookTorrance, parameters).unwrap();
        let rows = AtomicUsize::new(0);
        let shot = Shot { geometry: &geometry, light: &light, reflectance: &paint, samples: 1024, seed: 3 };
        let rendering = shot.render(|| _ = rows.fetch_add(1, Ordering::Relaxed));
        assert_eq!(rows.into_inner(), 20);
        let noise = rendering.noise.unwrap().rms;
        assert!(noise > 0.0 && noise < 0.02, "{noise}");
        let expected = Rgb::new(1.0, 0.5, 0.25);
        // Independent errors of some 300 pixels; three standard errors of their mean.
        assert!((rendering.mean_radiance / expected - 1.0).abs().max_element() < noise, "{}", rendering.mean_radiance);
        for (pixel, &coverage) in rendering.image.pixels().iter().zip(&rendering.coverage) {
            let error = f64::from(pixel[0]) - f64::from(coverage);
            assert!(error.abs() < 0.1 && (coverage > 0.0 || *pixel == [0.0; 3]), "{pixel:?} {coverage}");
        }
    }

    #[test]
    fn the_estimated_noise_is_the_error_against_a_finer_rendering() {
        let (geometry, light) = scene(|i| [if i == 37 { 40.0 } else { 0.3 }; 3]);
        let paint = Material::new(&Ggx, vec![0.3, 0.3, 0.3, 0.5, 0.5, 0.5, 1.0, 0.2]).unwrap();
        let shot = Shot { geometry: &geometry, light: &light, reflectance: &paint, samples: 64, seed: 0 };
        let (coarse, fine) = (shot.render(|| ()), Shot { samples: 4096, ..shot }.render(|| ()));
        let (mut square, mut count, mut relative) = (0.0, 0.0, Vec::new());
        for ((a, b), &c) in coarse.image.pixels().iter().zip(fine.image.pixels()).zip(&coarse.coverage) {
            if c == 1.0 {
                let error = f64::from(a[0] - b[0]);
                (square, count) = (square + error * error, count + 1.0);
                relative.push(error.abs() / f64::from(b[0]));
            }
        }
        let error = (square / count).sqrt() / fine.mean_radiance.x;
        relative.sort_by(f64::total_cmp);
        let typical = relative[relative.len() / 2] / HALF_NORMAL_MEDIAN;
        let noise = coarse.noise.unwrap();
        println!("estimated {noise:?}, found rms {error:.4}, typical {typical:.4}");
        // Some 260 pixels estimate a root mean square or a median to a few per cent, tails to a few more.
        assert!(error > 0.6 * noise.rms && error < 1.6 * noise.rms);
        assert!(typical > 0.7 * noise.typical && typical < 1.4 * noise.typical);
    }

    #[test]
    fn one_sample_has_no_noise_estimate_and_seeds_differ() {
        let (geometry, light) = scene(|i| [i as f32 + 0.1; 3]);
        let paint = Material::new(&Ggx, vec![0.3, 0.3, 0.3, 0.5, 0.5, 0.5, 1.0, 0.2]).unwrap();
        let shot = Shot { geometry: &geometry, light: &light, reflectance: &paint, samples: 1, seed: 0 };
        let single = shot.render(|| ());
        assert_eq!(single.noise, None);
        assert_eq!(single, shot.render(|| ()));
        assert_ne!(single.image, Shot { seed: 1, ..shot }.render(|| ()).image);
    }
}
