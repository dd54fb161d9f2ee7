//! The pixels of stage one by the direct integrator, as in the paper: each evaluation of Eq. 1 is a rendering. This is thousands of
//! times slower than a transport table (docs/accuracy.md), and independent of it.

use crate::{
    brdf::{Material, Model, flat_bounds},
    light::LightDistribution,
    render::{integrator::Integrator, table::Planes, transport::Pixel},
    scene::Geometry,
};

/// Renders the pixels of a subset by the direct integrator.
#[derive(Debug, Clone, Copy)]
pub struct DirectPixels<'a> {
    /// The object and the camera.
    pub geometry: &'a Geometry,
    /// The light with its sampling density.
    pub light: &'a LightDistribution,
    /// The pixels, in the subset's order.
    pub pixels: &'a [Pixel],
    /// Samples per pixel. They are the same in every evaluation, so the cost is a function of the parameters alone.
    pub samples: u32,
    /// Seed of the run.
    pub seed: u64,
}

impl DirectPixels<'_> {
    /// The radiance of every pixel at a flat parameter vector: three channels of one value per pixel, linear Rec. 709. Values
    /// beyond a bound are clamped to it.
    pub(super) fn radiance(&self, model: &'static dyn Model, parameters: &[f64], out: &mut Planes) {
        let (lower, upper) = flat_bounds(model.parameters());
        let inside = parameters.iter().zip(lower.iter().zip(&upper)).map(|(x, (l, u))| x.clamp(*l, *u)).collect();
        let Ok(material) = Material::new(model, inside) else {
            // A parameter is not a number. Then the cost is not a number either, and the search reports it.
            out.iter_mut().for_each(|plane| plane.fill(f64::NAN));
            return;
        };
        let Self { geometry, light, samples, seed, .. } = *self;
        let integrator = Integrator { geometry, light, samples, seed };
        for (p, pixel) in self.pixels.iter().enumerate() {
            let rgb = integrator.pixel(*pixel, &material);
            for (c, plane) in out.iter_mut().enumerate() {
                plane[p] = rgb[c];
            }
        }
    }
}
