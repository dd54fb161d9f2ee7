//! Scenes, references by the slow integrator, and the deviations of transport tables from them.

pub mod agreement;
pub mod photograph;
pub mod prediction;
pub mod probes;
pub mod reference;
pub mod synthetic;

use lookalike::{
    light::{Environment, LightDistribution},
    math::{
        cell,
        sampling::{key, uniform},
    },
    render::{pyramid::LightPyramid, transport::Pixel},
    scene::{Camera, Circle, Geometry, SceneError},
};
use std::sync::Arc;

/// A shape under a light, with the light prepared for both integrators.
#[derive(Debug)]
pub struct Scene {
    /// The shape and the camera.
    pub geometry: Geometry,
    /// The light for tables.
    pub pyramid: LightPyramid,
    /// The light for the direct integrator.
    pub light: LightDistribution,
}

impl Scene {
    /// A shape under a light.
    #[must_use]
    pub fn new(geometry: Geometry, environment: Environment) -> Self {
        let light = LightDistribution::new(Arc::new(environment.clone()));
        Self { geometry, pyramid: LightPyramid::new(environment), light }
    }

    /// The sphere that fills a photo of `size` x `size` pixels.
    ///
    /// # Errors
    /// Those of [`Geometry::sphere`].
    pub fn sphere(size: usize, camera: Camera, environment: Environment) -> Result<Self, SceneError> {
        Ok(Self::new(Geometry::sphere(size, size, Circle::inscribed(size, size), camera)?, environment))
    }

    /// Every pixel of full coverage, in rows.
    #[must_use]
    pub fn interior(&self) -> Vec<Pixel> {
        covered(&self.geometry, |coverage| coverage >= 1.0)
    }

    /// Every pixel that the silhouette cuts.
    #[must_use]
    pub fn silhouette(&self) -> Vec<Pixel> {
        covered(&self.geometry, |coverage| coverage > 0.0 && coverage < 1.0)
    }
}

/// The pixels whose coverage passes `keep`, in rows.
pub fn covered(geometry: &Geometry, keep: impl Fn(f32) -> bool) -> Vec<Pixel> {
    let index = |n: usize| u32::try_from(n).expect("photos have fewer than 2^32 columns and rows");
    let all = (0..geometry.height()).flat_map(|r| (0..geometry.width()).map(move |c| (c, r)));
    all.filter(|&(c, r)| keep(geometry.coverage(c, r))).map(|(c, r)| [index(c), index(r)]).collect()
}

/// `count` of the pixels, one from each of as many equal parts of the list, a pure function of the seed.
#[must_use]
pub fn spread(pixels: &[Pixel], count: usize, seed: u64) -> Vec<Pixel> {
    let part = pixels.len() as f64 / count as f64;
    let at = |i: usize| cell((i as f64 + uniform(key(&[seed, i as u64]))) * part, pixels.len());
    (0..count).map(|i| pixels[at(i)]).collect()
}
