//! Renders the built-in sphere with the direct integrator, for comparison with another renderer
//! (`experiments/mitsuba_compare.py`).
//!
//! `render_sphere MAP OUT.exr MAP_OUT.exr SIZE SAMPLES diffuse ALBEDO | correlated ALPHA | separable ALPHA`
//!
//! `correlated` is this project's `ggx` at F = 1. `separable` differs from it only in the masking term, `G1(l) G1(v)`, as
//! in Mitsuba's `roughconductor`. `MAP_OUT.exr` receives the map that the rendering uses, converted to lat-long.

use lookalike::{
    brdf::{Angles, Ggx, Material, Reflectance},
    image::{Image, decode, openexr},
    light::{LightDistribution, Mapping, to_lat_long},
    math::{Rgb, Vec3, narrow},
    render::integrator::Integrator,
    scene::{Camera, Circle, Geometry},
};
use rayon::prelude::*;
use std::{error::Error, f64::consts::PI, sync::Arc};

/// GGX at F = 1 with separable Smith masking.
#[derive(Debug)]
struct Separable {
    alpha: f64,
}

impl Reflectance for Separable {
    fn eval_cos(&self, wi_local: Vec3, wo_local: Vec3) -> Rgb {
        if wi_local.z <= 0.0 || wo_local.z <= 0.0 {
            return Rgb::ZERO;
        }
        let g = Angles::new(Vec3::Z, wi_local, wo_local);
        let a2 = self.alpha * self.alpha;
        let d = g.sin2_h + a2 * g.cos_h * g.cos_h;
        let distribution = a2 / (PI * d * d);
        let masking = |cos: f64| 2.0 * cos / (cos + (a2 + (1.0 - a2) * cos * cos).sqrt());
        Rgb::splat(distribution * masking(g.cos_i) * masking(g.cos_o) / (4.0 * g.cos_o))
    }

    fn sampling_alphas(&self) -> Vec<f64> {
        vec![self.alpha]
    }
}

#[derive(Debug)]
struct Diffuse {
    albedo: f64,
}

impl Reflectance for Diffuse {
    fn eval_cos(&self, wi_local: Vec3, wo_local: Vec3) -> Rgb {
        let lit = wi_local.z > 0.0 && wo_local.z > 0.0;
        Rgb::splat(if lit { self.albedo * wi_local.z / PI } else { 0.0 })
    }

    fn sampling_alphas(&self) -> Vec<f64> {
        vec![1.0]
    }
}

fn surface(kind: &str, value: f64) -> Result<Box<dyn Reflectance>, Box<dyn Error>> {
    Ok(match kind {
        "diffuse" => Box::new(Diffuse { albedo: value }),
        "separable" => Box::new(Separable { alpha: value }),
        "correlated" => Box::new(Material::new(&Ggx, vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0, value])?),
        other => return Err(format!("unknown surface '{other}': expected diffuse, correlated or separable").into()),
    })
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [map, out, map_out, size, samples, kind, value] = &arguments[..] else {
        return Err("expected MAP OUT.exr MAP_OUT.exr SIZE SAMPLES SURFACE VALUE".into());
    };
    let (size, samples, value) = (size.parse::<usize>()?, samples.parse::<u32>()?, value.parse::<f64>()?);
    let image = decode(map, &std::fs::read(map)?)?.image;
    let mapping = Mapping::recognise(image.width(), image.height())?;
    let environment = to_lat_long(image, mapping)?;
    std::fs::write(map_out, openexr::write(&environment.to_image(), None, &[])?)?;
    let light = LightDistribution::new(Arc::new(environment));
    let geometry = Geometry::sphere(size, size, Circle::inscribed(size, size), Camera::Orthographic)?;
    let reflectance = surface(kind, value)?;
    let integrator = Integrator { geometry: &geometry, light: &light, samples, seed: 1 };
    let pixel = |k: usize| {
        let (column, row) = (k % size, k / size);
        let index = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
        let radiance = integrator.pixel([index(column), index(row)], reflectance.as_ref());
        narrow(radiance * f64::from(geometry.coverage(column, row)))
    };
    let pixels: Vec<[f32; 3]> = (0..size * size).into_par_iter().map(pixel).collect();
    std::fs::write(out, openexr::write(&Image::from_pixels(size, size, pixels), None, &[])?)?;
    Ok(())
}
