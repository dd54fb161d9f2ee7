//! The direct integrator, the slow reference: one pixel of any reflectance by Monte Carlo integration.
//!
//! Each sample has its own position inside the pixel, and therefore its own normal. Directions come from one mixture, half from the
//! environment's density and half from the lobes of the reflectance (visible GGX normals), weighted by the balance heuristic
//! (Veach 1997): every sample counts with `1 / sum_j n_j p_j(d)`. Points are scrambled Sobol points, a pure function of (seed, pixel,
//! technique, index).

use crate::{
    brdf::Reflectance,
    light::{LightDistribution, LightSample},
    math::{
        Rgb, Vec3,
        frame::Frame,
        sampling::{PointStream, key},
        warp,
    },
    scene::Geometry,
};

/// Renders pixels of one scene.
#[derive(Debug, Clone, Copy)]
pub struct Integrator<'a> {
    /// The object and the camera.
    pub geometry: &'a Geometry,
    /// The light with its sampling density.
    pub light: &'a LightDistribution,
    /// Samples per pixel, split among the techniques.
    pub samples: u32,
    /// Seed of the run.
    pub seed: u64,
}

/// A technique that proposes directions.
#[derive(Debug, Clone, Copy)]
enum Technique {
    Environment,
    Lobe(f64),
    Cosine,
}

/// Directions for lobes at least this wide are drawn from the cosine density instead.
const WIDE: f64 = 0.7;

impl Integrator<'_> {
    /// Mean radiance over the part of a pixel that sees the object; zero when it sees none.
    #[must_use]
    pub fn pixel(&self, [column, row]: [u32; 2], reflectance: &dyn Reflectance) -> Rgb {
        let techniques = self.techniques(reflectance);
        let (mut sum, mut hits) = (Rgb::ZERO, 0u32);
        for (t, &(technique, count)) in techniques.iter().enumerate() {
            let stream = PointStream::new(key(&[self.seed, u64::from(row), u64::from(column), t as u64]));
            for index in 0..count {
                let [u, v, x, y] = stream.point(index);
                let position = (f64::from(column) + x, f64::from(row) + y);
                let Some(surface) = self.geometry.point(position.0, position.1) else { continue };
                hits += 1;
                let frame = Frame::from_normal(surface.normal);
                let wo = frame.to_local(surface.view);
                if wo.z > 0.0 {
                    sum += self.sample(technique, [u, v], &frame, wo, &techniques, reflectance);
                }
            }
        }
        let drawn: u32 = techniques.iter().map(|(_, n)| n).sum();
        // Each technique's sum estimates the mean over the pixel; samples that miss the object add 0.
        if hits == 0 { Rgb::ZERO } else { sum * (f64::from(drawn) / f64::from(hits)) }
    }

    fn techniques(&self, reflectance: &dyn Reflectance) -> Vec<(Technique, u32)> {
        let lobes = reflectance.sampling_alphas();
        let mut list: Vec<Technique> = vec![Technique::Environment];
        for alpha in lobes {
            let technique = if alpha >= WIDE { Technique::Cosine } else { Technique::Lobe(alpha) };
            list.push(technique);
        }
        let others = u32::try_from(list.len() - 1).unwrap_or(1).max(1);
        let each = (self.samples / 2 / others).max(1);
        let environment = self.samples.saturating_sub(each * others).max(1);
        list.into_iter().enumerate().map(|(i, t)| (t, if i == 0 { environment } else { each })).collect()
    }

    fn sample(
        &self,
        technique: Technique,
        u: [f64; 2],
        frame: &Frame,
        wo: Vec3,
        techniques: &[(Technique, u32)],
        reflectance: &dyn Reflectance,
    ) -> Rgb {
        // Radiance and density of the map are looked up once, and only for directions above the surface.
        let (wi, radiance, light_pdf) = match technique {
            Technique::Environment => {
                let LightSample { direction, radiance, pdf } = self.light.sample(u);
                (frame.to_local(direction), radiance, pdf)
            }
            Technique::Cosine | Technique::Lobe(_) => {
                let wi = proposal(technique, wo, u);
                if wi.z <= 0.0 {
                    return Rgb::ZERO;
                }
                let (radiance, pdf) = self.light.radiance_and_pdf(frame.to_world(wi));
                (wi, radiance, pdf)
            }
        };
        if wi.z <= 0.0 {
            return Rgb::ZERO;
        }
        let cos_h = (wi + wo).normalize().z;
        let density: f64 = techniques
            .iter()
            .map(|&(technique, count)| {
                f64::from(count)
                    * match technique {
                        Technique::Environment => light_pdf,
                        Technique::Cosine => warp::cosine_hemisphere_pdf(wi.z),
                        Technique::Lobe(alpha) => warp::ggx_reflection_pdf(wo.z, cos_h, alpha),
                    }
            })
            .sum();
        if density > 0.0 { radiance * reflectance.eval_cos(wi, wo) / density } else { Rgb::ZERO }
    }
}

/// A direction drawn by a technique of the reflectance, in local coordinates; it may lie below the surface.
fn proposal(technique: Technique, wo: Vec3, u: [f64; 2]) -> Vec3 {
    match technique {
        Technique::Lobe(alpha) => {
            let h = warp::ggx_visible_normal(wo, alpha, u);
            (2.0 * wo.dot(h) * h - wo).normalize()
        }
        _ => warp::cosine_hemisphere(u),
    }
}
