use super::*;
use crate::{
    brdf::{Material, Reflectance, Width, flat_bounds},
    math::{
        Vec3,
        sampling::{key, uniform},
    },
};
use std::f64::consts::PI;

/// Burley's reference implementation (`disney.brdf`, with the masking of the paper's section on the specular G), line by line.
fn by_the_book(p: &[f64], wi: Vec3, wo: Vec3) -> Rgb {
    let mix = |a: f64, b: f64, t: f64| a * (1.0 - t) + b * t;
    let schlick = |u: f64| (1.0 - u).clamp(0.0, 1.0).powi(5);
    let smith = |c: f64, g: f64| 1.0 / (c + (g * g + c * c - g * g * c * c).sqrt());
    let (l, v) = (wi.z, wo.z);
    let h = (wi + wo).normalize();
    let (nh, lh) = (h.z, wi.dot(h));
    let roughness = p[ROUGHNESS];
    let (fl, fv, fh) = (schlick(l), schlick(v), schlick(lh));
    let fd90 = 0.5 + 2.0 * lh * lh * roughness;
    let fd = mix(1.0, fd90, fl) * mix(1.0, fd90, fv);
    let fss90 = lh * lh * roughness;
    let fss = mix(1.0, fss90, fl) * mix(1.0, fss90, fv);
    let ss = 1.25 * (fss * (1.0 / (l + v) - 0.5) + 0.5);
    let a = roughness * roughness;
    let t = 1.0 + (a * a - 1.0) * nh * nh;
    let ds = a * a / (PI * t * t);
    let wide = (0.5 + roughness / 2.0).powi(2);
    let gs = smith(l, wide) * smith(v, wide);
    let coat = mix(0.1, 0.001, p[GLOSS]);
    let dr = (coat * coat - 1.0) / (PI * (coat * coat).ln() * (1.0 + (coat * coat - 1.0) * nh * nh));
    let (fr, gr) = (mix(0.04, 1.0, fh), smith(l, 0.25) * smith(v, 0.25));
    let channel = |c: usize| {
        let base = p[BASE + c];
        let f0 = mix(p[SPECULAR] * 0.08, base, p[METALLIC]);
        let diffuse = mix(fd, ss, p[SUBSURFACE]) * base / PI + fh * p[SHEEN];
        diffuse * (1.0 - p[METALLIC]) + gs * mix(f0, 1.0, fh) * ds + 0.25 * p[CLEARCOAT] * gr * fr * dr
    };
    Rgb::new(channel(0), channel(1), channel(2)) * l
}

#[test]
fn the_sum_of_the_lobes_is_the_reference_implementation() {
    let (lower, upper) = flat_bounds(Disney.parameters());
    for n in 0..500 {
        let at = |i: usize| uniform(key(&[n, i as u64]));
        let p: Vec<f64> = (0..lower.len()).map(|i| lower[i] + (upper[i] - lower[i]) * at(i)).collect();
        let direction = |k: usize| {
            let (z, phi) = (0.02 + 0.98 * at(20 + k), 2.0 * PI * at(30 + k));
            let r = (1.0 - z * z).max(0.0).sqrt();
            Vec3::new(r * phi.cos(), r * phi.sin(), z)
        };
        let (wi, wo) = (direction(0), direction(1));
        let (found, expected) = (Material::new(&Disney, p.clone()).unwrap().eval_cos(wi, wo), by_the_book(&p, wi, wo));
        assert!((found / expected - Rgb::ONE).abs().max_element() < 1e-9, "{p:?}: {found} {expected}");
    }
}

#[test]
fn both_lobes_end_at_the_same_width() {
    let (lower, upper) = flat_bounds(Disney.parameters());
    let widths: Vec<Width> = LOBES.iter().filter_map(|basis| basis.width).collect();
    let [roughness, gloss] = widths[..] else { panic!("{widths:?}") };
    // 0.005 up to the rounding of the bounds.
    assert!((roughness.at(&lower) - 0.005_041).abs() < 1e-15 && (gloss.at(&upper) - 0.005_009_5).abs() < 1e-15);
    for (width, x) in [(roughness, 0.3), (gloss, 0.7)] {
        assert!(((width.inverse)((width.of)(x)) - x).abs() < 1e-14);
        let difference = ((width.of)(x + 1e-6) - (width.of)(x - 1e-6)) / 2e-6;
        assert!((difference - (width.derivative)(x)).abs() < 1e-9);
    }
}

/// The integral of `D n.h` over the hemisphere is 1.
#[test]
fn the_distribution_of_the_coat_is_normalised() {
    for a in [0.005_f64, 0.03, 0.1] {
        let n = 200_000;
        // Steps are even in the logarithm of a^2 + u.
        let span = ((1.0 + a * a) / (a * a)).ln();
        let sum: f64 = (0..n)
            .map(|i| {
                let q = a * a * (span * (f64::from(i) + 0.5) / f64::from(n)).exp();
                let u = q - a * a;
                let d = (1.0 - a * a) / (-PI * (a * a).ln()) / (a * a + (1.0 - a * a) * u);
                // Solid angle times n.h is pi du.
                d * PI * q * span / f64::from(n)
            })
            .sum();
        assert!((sum - 1.0).abs() < 1e-6, "{a}: {sum}");
    }
}
