//! The target material: a pearl paint under lacquer, which no model that is fitted can express exactly.
//!
//! ```text
//! f = coat(l, v) + T(n.l) T(n.v) base(l, v)                         T(c) = 1 - F(COAT_F0, c)
//! base = sum_k PIGMENT_k F(f0_k, v.h) D(alpha_k) V(alpha_k)          two GGX lobes of different width
//!      + kd/pi (1 - F5(n.l)) (1 - F5(n.v)) (1 + RETRO ((1 + l.v)/2)^8)
//! ```
//! with D and V of design section 4, F Schlick's Fresnel term and F5(c) = (1 - c)^5. The last factor brightens the
//! material towards the light, as rough pigments do. Every factor is symmetric in l and v, so f is reciprocal.
//!
//! Energy: the coat reflects at most F. The transmitted light reaches a base whose albedo is below 1 for these constants, and
//! is attenuated by T on the way in and on the way out (a test integrates the whole: at most 0.69).

use lookalike::{
    brdf::Reflectance,
    math::{Rgb, Vec3, elementary::fifth_power},
};
use std::f64::consts::PI;

/// A description of the material in one line.
pub const DESCRIPTION: &str = "pearl paint under lacquer: two GGX lobes, a clear coat, a retro-reflective diffuse part";

/// The material as something to render.
#[derive(Debug, Clone, Copy)]
pub struct Target;

impl Reflectance for Target {
    #[inline(always)]
    fn eval_cos(&self, wi_local: Vec3, wo_local: Vec3) -> Rgb {
        eval(wi_local, wo_local) * wi_local.z.max(0.0)
    }

    fn sampling_alphas(&self) -> Vec<f64> {
        [COAT_ALPHA].into_iter().chain(PIGMENT.iter().map(|p| p.alpha)).chain([1.0]).collect()
    }
}

/// The BRDF in 1/sr, without the cosine, for unit directions that point away from the surface, in the frame whose +Z is the
/// normal. Zero if either direction lies at or below the surface. In straight-line code, for loops over directions.
#[must_use]
#[inline(always)]
pub fn eval(wi_local: Vec3, wo_local: Vec3) -> Rgb {
    let (cos_i, cos_o) = (wi_local.z, wo_local.z);
    let sum = wi_local + wo_local;
    let half = sum.normalize();
    let cos_d = wo_local.dot(half).clamp(0.0, 1.0);
    let lobe = |alpha: f64, f0: Rgb| fresnel(f0, cos_d) * microfacets(alpha, half.z, cos_i, cos_o);

    let pigment = PIGMENT.iter().fold(Rgb::ZERO, |total, p| total + p.weight * lobe(p.alpha, p.f0));
    let passed = (1.0 - fresnel(COAT_F0, cos_i)) * (1.0 - fresnel(COAT_F0, cos_o));
    let value = lobe(COAT_ALPHA, COAT_F0) + passed * (pigment + diffuse(cos_i, cos_o, wi_local.dot(wo_local)));
    if cos_i > 0.0 && cos_o > 0.0 { value } else { Rgb::ZERO }
}

/// One of the lobes below the lacquer.
struct Pigment {
    weight: f64,
    alpha: f64,
    f0: Rgb,
}

/// The coloured diffuse part, with its retro-reflection.
#[inline(always)]
fn diffuse(cos_i: f64, cos_o: f64, cos_between: f64) -> Rgb {
    let towards = (0.5 * (1.0 + cos_between)).max(0.0);
    let squared = towards * towards;
    let fourth = squared * squared;
    let transmitted = (1.0 - fifth_power(1.0 - cos_i)) * (1.0 - fifth_power(1.0 - cos_o));
    DIFFUSE * (transmitted * (1.0 + RETRO * fourth * fourth) / PI)
}

/// D V of GGX with height-correlated Smith masking.
#[inline(always)]
fn microfacets(alpha: f64, cos_h: f64, cos_i: f64, cos_o: f64) -> f64 {
    let a2 = alpha * alpha;
    let d = (1.0 - cos_h) * (1.0 + cos_h) + a2 * cos_h * cos_h;
    let ndf = a2 / (PI * d * d);
    let masked = |a: f64, b: f64| a * (a2 + (1.0 - a2) * b * b).sqrt();
    ndf * 0.5 / (masked(cos_i, cos_o) + masked(cos_o, cos_i))
}

/// Schlick's Fresnel term.
#[inline(always)]
fn fresnel(f0: Rgb, cos: f64) -> Rgb {
    f0 + (Rgb::ONE - f0) * fifth_power(1.0 - cos)
}

const COAT_ALPHA: f64 = 0.03;
/// Lacquer of refractive index 1.5.
const COAT_F0: Rgb = Rgb::splat(0.04);
/// A narrow golden lobe (flakes) and a broad magenta one.
const PIGMENT: [Pigment; 2] = [
    Pigment { weight: 0.40, alpha: 0.07, f0: Rgb::new(0.80, 0.46, 0.17) },
    Pigment { weight: 0.50, alpha: 0.40, f0: Rgb::new(0.34, 0.07, 0.13) },
];
const DIFFUSE: Rgb = Rgb::new(0.17, 0.025, 0.03);
const RETRO: f64 = 1.5;

#[cfg(test)]
mod tests {
    use super::*;
    use lookalike::math::{
        elementary::sin_cos,
        sampling::PointStream,
        warp::{cosine_hemisphere, ggx_reflection_pdf, ggx_visible_normal},
    };

    fn direction(cos: f64, phi: f64) -> Vec3 {
        let (s, c) = sin_cos(phi);
        let r = (1.0 - cos * cos).sqrt();
        Vec3::new(r * c, r * s, cos)
    }

    #[test]
    fn the_material_is_reciprocal_and_not_negative() {
        // The products are formed in a different order, so the values differ by a few roundings.
        const TOLERANCE: f64 = 1e-13;
        let stream = PointStream::new(1);
        for i in 0..2000 {
            let u = stream.point(i);
            let (a, b) = (cosine_hemisphere([u[0], u[1]]), cosine_hemisphere([u[2], u[3]]));
            let (forth, back) = (eval(a, b), eval(b, a));
            assert!((forth - back).length() <= TOLERANCE * forth.length(), "{a} {b}");
            assert!(forth.min_element() >= 0.0 && forth.is_finite());
        }
        assert_eq!(eval(direction(-0.1, 0.0), direction(0.5, 0.0)), Rgb::ZERO);
        assert_eq!(eval(direction(0.5, 0.0), direction(0.0, 0.0)), Rgb::ZERO);
    }

    #[test]
    fn no_direction_reflects_more_than_arrives() {
        // One third of the samples each from the diffuse density, the coat's lobe and the broad lobe; balance heuristic.
        let n = 30_000;
        for cos_o in [1.0, 0.9, 0.7, 0.5, 0.3, 0.15, 0.05, 0.01] {
            let (wo, stream) = (direction(cos_o, 0.4), PointStream::new(2));
            let mut albedo = Rgb::ZERO;
            for i in 0..n {
                let u = stream.point(i);
                let alpha = if i % 3 == 1 { COAT_ALPHA } else { 0.3 };
                let mirrored = |h: Vec3| 2.0 * wo.dot(h) * h - wo;
                let wi = match i % 3 {
                    0 => cosine_hemisphere([u[0], u[1]]),
                    _ => mirrored(ggx_visible_normal(wo, alpha, [u[0], u[1]])),
                };
                if wi.z <= 0.0 {
                    continue;
                }
                let cos_h = (wi + wo).normalize().z;
                let lobes = ggx_reflection_pdf(cos_o, cos_h, COAT_ALPHA) + ggx_reflection_pdf(cos_o, cos_h, 0.3);
                albedo += eval(wi, wo) * (wi.z * 3.0 / (wi.z / PI + lobes));
            }
            albedo /= f64::from(n);
            // Measured: at most 0.69; a coat that does not attenuate the base reaches 1.10 at cos 0.05.
            assert!(albedo.max_element() < 1.0 && albedo.min_element() > 0.05, "cos {cos_o}: {albedo}");
        }
    }

    #[test]
    fn the_material_is_brighter_seen_from_the_light_than_from_beside_it() {
        // Equal angles to the normal, far from the mirror direction in both views.
        let (wi, beside) = (direction(0.5, 0.0), direction(0.5, PI / 2.0));
        assert!(diffuse(wi.z, wi.z, 1.0).x > 1.5 * diffuse(wi.z, beside.z, wi.dot(beside)).x);
    }
}
