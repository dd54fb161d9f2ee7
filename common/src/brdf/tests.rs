//! Physics of every model in the registry.

use super::*;
use crate::math::{
    Rgb, Vec3,
    elementary::sin_cos,
    sampling::{PointStream, key, uniform},
    simd, warp,
};
use std::{
    collections::BTreeSet,
    f64::consts::{PI, TAU},
};

fn random_parameters(model: &dyn Model, n: u64) -> Vec<f64> {
    let (lower, upper) = flat_bounds(model.parameters());
    let at = |i: usize| lower[i] + (upper[i] - lower[i]) * uniform(key(&[n, i as u64]));
    (0..lower.len()).map(at).collect()
}

fn direction(n: u64) -> Vec3 {
    let z = 0.02 + 0.97 * uniform(key(&[n, 100]));
    let (s, c) = sin_cos(TAU * uniform(key(&[n, 101])));
    let r = (1.0 - z * z).sqrt();
    Vec3::new(r * c, r * s, z)
}

#[test]
fn every_model_is_reciprocal() {
    const TOLERANCE: f64 = 1e-12; // a few roundings; a swapped angle would show in the first digit
    for model in MODELS {
        for n in 0..2000 {
            let material = Material::new(*model, random_parameters(*model, n)).unwrap();
            let (a, b) = (direction(2 * n), direction(2 * n + 1));
            let (there, back) = (material.eval_cos(a, b) / a.z, material.eval_cos(b, a) / b.z);
            assert!((there - back).abs().max_element() <= TOLERANCE * there.max_element(), "{} {n}", model.name());
        }
    }
}

/// A direction whose half vector is drawn from `D n.h` of the long-tailed distribution (Burley 2012, section B.2.3), and its density.
fn long_tailed(wo: Vec3, width: f64, [u, v]: [f64; 2]) -> (Vec3, f64) {
    let a2 = width * width;
    let sin2 = (a2.powf(1.0 - u) - a2) / (1.0 - a2);
    let (sin_phi, cos_phi) = sin_cos(TAU * v);
    let sin = sin2.max(0.0).sqrt();
    let h = Vec3::new(sin * cos_phi, sin * sin_phi, (1.0 - sin2).max(0.0).sqrt());
    let density = (1.0 - a2) / (-PI * a2.ln() * (a2 + (1.0 - a2) * sin2)) * h.z;
    let cos_d = wo.dot(h);
    (2.0 * cos_d * h - wo, if cos_d > 0.0 { density / (4.0 * cos_d) } else { 0.0 })
}

/// Directional albedo of a lobe (all terms, F = 1), by importance sampling with its equivalent GGX lobe.
fn albedo(lobe: &dyn Lobe, width: f64, cos_o: f64) -> f64 {
    let wo = Vec3::new((1.0 - cos_o * cos_o).sqrt(), 0.0, cos_o);
    let stream = PointStream::new(17);
    let n = 1 << 14;
    let mut sum = 0.0;
    for i in 0..n {
        let [u, v, ..] = stream.point(i);
        let (wi, pdf) = match lobe.equivalent_alpha(width) {
            None => {
                let wi = warp::cosine_hemisphere([u, v]);
                (wi, warp::cosine_hemisphere_pdf(wi.z))
            }
            Some(alpha) if lobe.tail() == Tail::Long => long_tailed(wo, alpha, [u, v]),
            Some(alpha) => {
                let h = warp::ggx_visible_normal(wo, alpha, [u, v]);
                (2.0 * wo.dot(h) * h - wo, warp::ggx_reflection_pdf(cos_o, h.z, alpha))
            }
        };
        if wi.z > 0.0 && pdf > 0.0 {
            sum += lobe.eval(&Angles::new(Vec3::Z, wi, wo), width) / pdf;
        }
    }
    sum / f64::from(n)
}

#[test]
fn no_lobe_reflects_more_than_it_receives() {
    const NOISE: f64 = 2e-3; // of 16k Sobol points
    for (model, basis) in MODELS.iter().flat_map(|m| m.lobes().iter().map(move |basis| (m, basis))) {
        let all: &[f64] = if basis.width.is_some() { &[0.005, 0.02, 0.1, 0.3, 0.6, 1.0] } else { &[0.0] };
        let (least, most) = basis.width.map_or((0.0, 0.0), |width| width.span(model.parameters()));
        for &width in all.iter().filter(|width| (least..=most * (1.0 + 1e-9)).contains(*width)) {
            for cos_o in [0.05, 0.2, 0.5, 0.8, 0.99] {
                let value = albedo(basis.lobe, width, cos_o);
                assert!(
                    value <= basis.lobe.expected().most_albedo + NOISE,
                    "{} width {width} cos {cos_o}: {value}",
                    basis.lobe.name()
                );
                if width <= 0.02 && basis.width.is_some() && cos_o >= 0.5 {
                    let (mirror, loss) = (basis.lobe.expected().sharp_albedo)(width, cos_o);
                    assert!((mirror - loss..=mirror + NOISE).contains(&value), "{}: {value}", basis.lobe.name());
                }
            }
        }
    }
}

#[test]
fn lambert_reflects_its_albedo() {
    assert!((albedo(&Lambert, 0.0, 0.7) - 1.0).abs() < 1e-12);
}

/// D and V of design section 4, written out naively.
fn ggx_by_the_book(g: &Angles, a: f64) -> (f64, f64) {
    let d = a * a / (PI * (g.cos_h * g.cos_h * (a * a - 1.0) + 1.0).powi(2));
    let lambda = |c: f64| 0.5 * ((1.0 + a * a * (1.0 / (c * c) - 1.0)).sqrt() - 1.0);
    (d, 1.0 / (1.0 + lambda(g.cos_o) + lambda(g.cos_i)) / (4.0 * g.cos_i * g.cos_o))
}

#[test]
fn the_ggx_lobe_is_d_v_cos() {
    let lobe = Ggx.lobes()[1].lobe;
    for n in 0..500 {
        let g = Angles::new(Vec3::Z, direction(2 * n), direction(2 * n + 1));
        for alpha in [0.05, 0.3, 1.0] {
            let (d, v) = ggx_by_the_book(&g, alpha);
            assert!((lobe.eval(&g, alpha) / (d * v * g.cos_i) - 1.0).abs() < 1e-9);
        }
    }
}

/// Weak white furnace (Heitz 2014, eq. 85): masked by G1 alone, the distribution has an albedo of exactly 1.
#[test]
fn ggx_passes_the_weak_white_furnace() {
    for alpha in [0.02_f64, 0.1, 0.3, 0.6, 1.0] {
        for cos_o in [0.1_f64, 0.4, 0.9] {
            let wo = Vec3::new((1.0 - cos_o * cos_o).sqrt(), 0.0, cos_o);
            let lambda = 0.5 * ((1.0 + alpha * alpha * (1.0 / (cos_o * cos_o) - 1.0)).sqrt() - 1.0);
            let (n, m) = (4000, 400);
            let mut sum = 0.0;
            for i in 0..n {
                // Stretch tan(theta_h) so that the quadrature follows the peak; D by the book.
                let s = (f64::from(i) + 0.5) / f64::from(n);
                let rest = (1.0 - s) * (1.0 - s) * (1.0 - s);
                let u = 1.0 - rest;
                let tan2 = alpha * alpha * u / rest;
                let cos_h = 1.0 / (1.0 + tan2).sqrt();
                let d = alpha * alpha / (PI * (cos_h * cos_h * (alpha * alpha - 1.0) + 1.0).powi(2));
                // d(solid angle) = sin dtheta dphi; sin dtheta = cos^3/2 d(tan2)
                let measure =
                    0.5 * cos_h.powi(3) * alpha * alpha / (rest * rest) * 3.0 * (1.0 - s) * (1.0 - s) / f64::from(n);
                for j in 0..m {
                    let (s, c) = sin_cos(TAU * (f64::from(j) + 0.5) / f64::from(m));
                    let sin_h = (1.0 - cos_h * cos_h).max(0.0).sqrt();
                    let dot = wo.dot(Vec3::new(sin_h * c, sin_h * s, cos_h)).max(0.0);
                    sum += d * dot / cos_o / (1.0 + lambda) * measure * TAU / f64::from(m);
                }
            }
            assert!((sum - 1.0).abs() < 1e-3, "alpha {alpha} cos {cos_o}: {sum}");
        }
    }
}

#[test]
fn weight_derivatives_are_derivatives() {
    for model in MODELS {
        let terms = term_count(*model);
        for n in 0..50 {
            let p = random_parameters(*model, n);
            let mut analytic = vec![vec![[0.0; 3]; terms]; p.len()];
            model.weight_derivatives(&p, &mut |term, channel, entry, value| analytic[entry][term][channel] += value);
            for entry in 0..p.len() {
                let shifted = |h: f64| {
                    let mut q = p.clone();
                    q[entry] += h;
                    let mut weights = vec![Rgb::ZERO; terms];
                    model.weights(&q, &mut weights);
                    weights
                };
                let (up, down) = (shifted(1e-5), shifted(-1e-5));
                for term in 0..terms {
                    for channel in 0..3 {
                        let numeric = (up[term][channel] - down[term][channel]) / 2e-5;
                        let error = (numeric - analytic[entry][term][channel]).abs();
                        assert!(error < 1e-8, "{} entry {entry} term {term} channel {channel}", model.name());
                    }
                }
            }
        }
    }
}

/// All entries of linear parameters.
fn linear_entries(model: &dyn Model) -> Vec<usize> {
    let roles = model.parameters().iter().flat_map(|p| std::iter::repeat_n(p.role, p.channels.count()));
    roles.enumerate().filter(|(_, role)| *role == Role::Linear).map(|(entry, _)| entry).collect()
}

#[test]
fn parameters_called_linear_are_affine_in_the_weights() {
    for model in MODELS {
        let entries = linear_entries(*model);
        let base = random_parameters(*model, 1);
        let at = |scan: bool, x: &dyn Fn(usize) -> f64| {
            let mut q = base.clone();
            entries.iter().for_each(|&entry| q[entry] = x(entry));
            let mut weights = vec![Rgb::ZERO; term_count(*model)];
            if scan {
                model.scan_weights(&q, &mut weights)
            } else {
                model.weights(&q, &mut weights)
            }
            weights
        };
        let affine = |scan: bool, a: &dyn Fn(usize) -> f64, b: &dyn Fn(usize) -> f64| {
            let (zero, half, one) = (at(scan, a), at(scan, &|e| 0.5 * (a(e) + b(e))), at(scan, b));
            for t in 0..zero.len() {
                assert!((half[t] - (zero[t] + one[t]) * 0.5).length() < 1e-12, "{} scan {scan}", model.name());
            }
        };
        // One entry at a time with all others held; in the coordinates of the scan all entries at once.
        for &one in &entries {
            affine(false, &|e| if e == one { 0.0 } else { base[e] }, &|e| if e == one { 1.0 } else { base[e] });
        }
        for n in 2..20 {
            let other = random_parameters(*model, n);
            affine(true, &|e| base[e], &|e| other[e]);
        }
    }
}

#[test]
fn the_scan_ends_at_parameters_of_the_weights_that_it_found() {
    for model in MODELS {
        let (lower, upper) = flat_bounds(model.parameters());
        let (mut within, mut outside, mut has_coordinates) = (0, 0, false);
        for n in 0..200 {
            let solution = random_parameters(*model, n);
            let mut p = solution.clone();
            model.parameters_of_scan(&mut p);
            has_coordinates |= p != solution;
            assert!((0..p.len()).all(|i| (lower[i]..=upper[i]).contains(&p[i])), "{} {p:?}", model.name());
            let [mut scanned, mut mapped] = [(); 2].map(|()| vec![Rgb::ZERO; term_count(*model)]);
            model.scan_weights(&solution, &mut scanned);
            model.weights(&p, &mut mapped);
            let same = scanned.iter().zip(&mapped).all(|(a, b)| (*a - *b).length() < 1e-12);
            // Where the weights differ, a parameter is at a bound.
            let at_bound = linear_entries(*model).iter().any(|&i| p[i] == lower[i] || p[i] == upper[i]);
            assert!(same || at_bound, "{} {solution:?} {p:?}", model.name());
            if same { within += 1 } else { outside += 1 }
        }
        // Only a model with separate coordinates of the scan may end at a bound.
        assert!(within > 0 && (outside == 0 || has_coordinates), "{}", model.name());
    }
}

/// Sums over lights against those of `kernel`, for the narrowest and the widest lobes: at the mirror direction and around it, at the horizon,
/// opposite to the view, and with a view along the surface. Exactly for lobes in double precision.
#[test]
fn accumulation_is_the_sum_over_lights() {
    // Single precision rounds each of about thirty operations by up to 6e-8, and the distribution of the narrowest lobe changes as
    // the fourth power of a small difference.
    const TOLERANCE: f64 = 1e-5;
    for wo in [direction(999), Vec3::Z, Vec3::new((1.0_f64 - 1e-4).sqrt(), 0.0, 1e-2)] {
        let special = [
            Vec3::new(-wo.x, -wo.y, wo.z),
            Vec3::new(-wo.x + 0.01, -wo.y, wo.z).normalize(),
            Vec3::new(-wo.x, -wo.y + 0.003, wo.z).normalize(),
            Vec3::new(-wo.x, -wo.y, 1e-3).normalize(),
            Vec3::new(0.0, 1.0, 0.0),
            Vec3::new(0.0, (1.0_f64 - 1e-8).sqrt(), 1e-4),
        ];
        // Not a multiple of the lights of a block.
        let directions = special.into_iter().chain((0..71).map(direction));
        let light = |(n, wi)| Incident {
            angles: Angles::new(Vec3::Z, wi, wo),
            energy: [0.1 * n as f64, 1.0, 3.0 / (1.0 + n as f64)],
            spread: Spread { du: 1e-7 * n as f64, du2: 1e-10 },
        };
        let lights: Lights = directions.enumerate().map(light).collect();
        for basis in MODELS.iter().flat_map(|m| m.lobes()) {
            let mut widths: Vec<f64> = (0..19).map(|k| 0.01 * (1.0 + f64::from(k))).collect();
            widths.extend([0.005, 0.999]);
            let terms = lobe_terms(basis.lobe);
            let mut sums = vec![0.0; terms * 3 * widths.len()];
            basis.lobe.accumulate(&lights, wo.z, 0.5, &widths, &mut sums);
            for (k, &width) in widths.iter().enumerate() {
                for (t, c) in (0..terms).flat_map(|t| (0..3).map(move |c| (t, c))) {
                    let mut expected = 0.0;
                    for n in (0..lights.len()).filter(|&n| lights.cos_i[n] > 0.0) {
                        let (angles, spread) = lights.at(n, wo.z);
                        let f5 = angles.f5();
                        let part = if terms == 1 { 1.0 } else { [1.0 - f5, f5][t] };
                        expected += part * f64::from(lights.energy[c][n]) * basis.lobe.kernel(&angles, &spread, width);
                    }
                    let (found, expected) = (sums[(t * 3 + c) * widths.len() + k], 0.5 * expected);
                    let name = basis.lobe.name();
                    let tolerance = if is_single(name) { TOLERANCE * expected } else { 0.0 };
                    assert!((found - expected).abs() <= tolerance, "{name} width {width} {wo}: {found} {expected}");
                }
            }
        }
    }
}

/// Whether a lobe is integrated in single precision.
fn is_single(lobe: &str) -> bool {
    ["ggx", "cook-torrance", "disney specular", "disney clearcoat"].contains(&lobe)
}

#[test]
fn every_simd_level_accumulates_the_same_bits() {
    let wo = direction(999);
    let light = |n: u64| Incident {
        angles: Angles::new(Vec3::Z, direction(n), wo),
        energy: [1.0, 0.3 * n as f64, 2.0],
        spread: Spread { du: 1e-4, du2: 1e-5 },
    };
    let lights: Lights = (0..77).map(light).collect();
    for basis in MODELS.iter().flat_map(|m| m.lobes()) {
        let widths: Vec<f64> = (0..21).map(|k| 0.01 * (1.0 + f64::from(k))).collect();
        let sums = || {
            let mut sums = vec![0.0; lobe_terms(basis.lobe) * 3 * widths.len()];
            basis.lobe.accumulate(&lights, wo.z, 1.0, &widths, &mut sums);
            sums.into_iter().map(f64::to_bits).collect::<Vec<_>>()
        };
        let detected = sums();
        simd::limit(simd::Level::Baseline);
        let baseline = sums();
        simd::limit(simd::Level::Detected);
        assert_eq!(detected, baseline, "{}", basis.lobe.name());
    }
}

/// A table has one grid per lobe, found by the lobe's name; of two widths of one lobe, the second is a widened first.
#[test]
fn lobes_of_one_name_are_one_function_and_widths_are_their_own() {
    let mut known: Vec<(&str, String)> = Vec::new();
    for model in MODELS {
        for basis in model.lobes() {
            let (name, function) = (basis.lobe.name(), format!("{:?}", basis.lobe));
            assert_eq!(format!("{:?}", lobe(name).unwrap()), function);
            known.push((name, function));
        }
        let own = |b: &BasisLobe| b.width.filter(|width| width.widened_by.is_none()).map(|width| width.entry);
        let entries: Vec<usize> = model.lobes().iter().filter_map(own).collect();
        let distinct: BTreeSet<&usize> = entries.iter().collect();
        assert_eq!(entries.len(), distinct.len(), "{}", model.name());
        for basis in model.lobes().iter().filter(|b| b.width.is_some_and(|width| width.widened_by.is_some())) {
            let (main, width) = main_lobe(*model).unwrap();
            assert!(basis.lobe.name() == main.lobe.name() && basis.width.unwrap().entry == width.entry);
        }
    }
    assert!(known.iter().all(|(a, f)| known.iter().all(|(b, g)| a != b || f == g)), "{known:?}");
    assert!(lobe("phong").is_none());
}

#[test]
fn bad_parameters_are_named() {
    let message = |p: Vec<f64>| Material::new(&Ggx, p).unwrap_err().to_string();
    assert_eq!(
        message(vec![0.1, 0.1, 0.1, 0.5, 2.5, 0.5, 1.0, 0.1]),
        "parameter 'f0' is 2.5: expected a value in [0, 2]"
    );
    assert!(message(vec![0.1, 0.1, 0.1, 0.5, 0.5, 0.5, 1.0, f64::NAN]).contains("'alpha' is NaN"));
    let unknown = model("phong").unwrap_err().to_string();
    assert!(MODELS.iter().all(|model| unknown.contains(model.name())), "{unknown}");
    let renamed = model("ggx-f90").unwrap_err().to_string();
    assert!(renamed.starts_with("the model 'ggx-f90' is now ggx, which has the parameter f90"), "{renamed}");
}
