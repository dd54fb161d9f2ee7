//! Tables written by the test from functions whose values are known.

use super::*;
use crate::{
    brdf::{Ggx, Material},
    math::{
        elementary::sin_cos,
        sampling::{key, uniform},
    },
};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// A file whose cell holds `value(cell)` in 1/sr; `None` is outside.
fn file(value: impl Fn([usize; 3]) -> Option<[f64; 3]>) -> Vec<u8> {
    let mut bytes: Vec<u8> = DIMENSIONS.iter().flat_map(|&n| i32::try_from(n).unwrap().to_le_bytes()).collect();
    bytes.resize(HEADER + 24 * CELLS, 0);
    for index in 0..CELLS {
        let cell = value(cell_of(index));
        for channel in 0..3 {
            let stored = cell.map_or(-1.0, |f| f[channel] / SCALE[channel]);
            bytes[HEADER + 8 * (channel * CELLS + index)..][..8].copy_from_slice(&stored.to_le_bytes());
        }
    }
    bytes
}

/// Light and view (unit, local, normal +Z) of a cell's centre, the cell given along `theta_h`, `theta_d`, `phi_d`. Either may
/// lie below the surface.
fn cell_directions([theta_h, theta_d, phi_d]: [usize; 3]) -> (Vec3, Vec3) {
    let centre = |index: usize, axis: usize| (index as f64 + 0.5) / DIMENSIONS[axis] as f64;
    let root = centre(theta_h, 0);
    let (sin_h, cos_h) = sin_cos(root * root * FRAC_PI_2);
    let (sin_d, cos_d) = sin_cos(centre(theta_d, 1) * FRAC_PI_2);
    let (sin_phi, cos_phi) = sin_cos(centre(phi_d, 2) * PI);
    let along = Vec3::new(sin_h, 0.0, cos_h) * cos_d;
    let across = Vec3::new(cos_h * cos_phi, sin_phi, -sin_h * cos_phi) * sin_d;
    (along + across, along - across)
}

/// A table of a function of directions, -1 below the horizon as in the real files.
fn table(brdf: impl Fn(Vec3, Vec3) -> Rgb) -> MerlTable {
    let bytes = file(|cell| {
        let (wi, wo) = cell_directions(cell);
        (wi.z > 0.0 && wo.z > 0.0).then(|| brdf(wi, wo).to_array())
    });
    MerlTable::read("test", &bytes).unwrap()
}

fn direction(n: u64, least_cos: f64) -> Vec3 {
    let z = least_cos + (1.0 - least_cos) * uniform(key(&[n, 1]));
    let (s, c) = sin_cos(TAU * uniform(key(&[n, 2])));
    let r = (1.0 - z * z).sqrt();
    Vec3::new(r * c, r * s, z)
}

fn pairs(count: u64, least_cos: f64) -> impl Iterator<Item = (Vec3, Vec3)> {
    (0..count).map(move |n| (direction(2 * n, least_cos), direction(2 * n + 1, least_cos)))
}

#[test]
fn cells_are_found_at_their_centres_in_the_order_of_the_file() {
    let bytes = file(|cell| Some(cell.map(|i| i as f64)));
    let table = MerlTable::read("test", &bytes).unwrap();
    let mut seen = 0;
    for index in (0..CELLS).step_by(97) {
        let cell = cell_of(index);
        let (wi, wo) = cell_directions(cell);
        if wi.z > 0.0 && wo.z > 0.0 {
            let found = table.eval(wi, wo);
            // Single precision, and the rounding of the angles times the slope of 1 per cell.
            assert!((found - Rgb::from_array(cell.map(|i| i as f64))).abs().max_element() < 1e-4, "{cell:?} {found}");
            seen += 1;
        }
    }
    assert!(seen > 5000);
}

#[test]
fn a_constant_is_constant_everywhere_above_the_horizon() {
    let lambert = table(|_, _| Rgb::new(0.1, 0.2, 0.3));
    for (wi, wo) in pairs(20_000, 1e-3) {
        let f = lambert.eval(wi, wo);
        assert!(f == Rgb::ZERO || (f - Rgb::new(0.1, 0.2, 0.3)).abs().max_element() < 1e-7, "{wi} {wo} {f}");
        // Within half a cell of the horizon all neighbours may be outside.
        assert!(f != Rgb::ZERO || wi.z.min(wo.z) < 0.02, "{wi} {wo}");
    }
    assert_eq!(lambert.eval(Vec3::new(0.6, 0.0, -0.8), Vec3::Z), Rgb::ZERO);
    assert_eq!(lambert.eval_cos(Vec3::Z, Vec3::new(1.0, 0.0, 0.0)), Rgb::ZERO);
    assert_eq!(lambert.sampling_alphas(), [1.0]);
}

fn ggx(alpha: f64) -> Material {
    Material::new(&Ggx, vec![0.2, 0.1, 0.05, 0.5, 0.6, 0.7, 1.0, alpha]).unwrap()
}

#[test]
fn a_table_of_ggx_is_ggx_up_to_interpolation() {
    // Trilinear interpolation errs by an eighth of the second difference: largest on the flanks of the sharper lobe.
    for (alpha, tolerance) in [(0.3, 0.01), (0.08, 0.03)] {
        let material = ggx(alpha);
        let measured = table(|wi, wo| material.eval_cos(wi, wo) / wi.z);
        let mut worst = 0.0_f64;
        for (n, (wi, wo)) in pairs(20_000, 0.15).enumerate() {
            // Every second light near the mirror direction, where the lobe is.
            let mirrored = Vec3::new(-wo.x, -wo.y, wo.z) + 0.3 * alpha * wi;
            let wi = if n % 2 == 0 { wi } else { mirrored.normalize() };
            let (found, expected) = (measured.eval_cos(wi, wo), material.eval_cos(wi, wo));
            worst = worst.max(((found - expected) / expected).abs().max_element());
        }
        println!("alpha {alpha}: largest relative error {worst:.4}");
        assert!(worst < tolerance, "alpha {alpha}: {worst}");
    }
}

#[test]
fn lobes_of_a_table_are_sampled_about_as_wide_as_they_are() {
    for alpha in [0.01, 0.05, 0.2, 0.3] {
        let material = ggx(alpha);
        let alphas = table(|wi, wo| material.eval_cos(wi, wo) / wi.z).sampling_alphas();
        println!("alpha {alpha}: {alphas:?}");
        assert!(alphas.len() == 2 && alphas[1] == 1.0, "one lobe and the cosine: {alphas:?}");
        assert!((alphas[0] / alpha - 1.0).abs() < 0.2, "alpha {alpha}: {alphas:?}");
    }
}

#[test]
fn a_core_with_tails_is_sampled_from_the_one_to_the_other() {
    // The core is fifty times as high, the tails have seven times its energy.
    let (core, tails) = (ggx(0.01), ggx(0.2));
    let both = table(|wi, wo| (core.eval_cos(wi, wo) / 7.0 + tails.eval_cos(wi, wo)) / wi.z);
    let alphas = both.sampling_alphas();
    assert!(alphas[0] < 0.015 && alphas[alphas.len() - 2] > 0.13, "{alphas:?}");
    assert!(alphas[..alphas.len() - 1].windows(2).all(|pair| pair[1] / pair[0] < 6.6), "{alphas:?}");
}

#[test]
fn exchanging_the_directions_gives_the_same_bits() {
    let material = ggx(0.1);
    let table = table(|wi, wo| material.eval_cos(wi, wo) / wi.z);
    for (wi, wo) in pairs(20_000, 1e-3) {
        assert_eq!(table.eval(wi, wo), table.eval(wo, wi));
    }
}

#[test]
fn turning_both_directions_about_the_normal_changes_nothing() {
    let material = ggx(0.1);
    let table = table(|wi, wo| material.eval_cos(wi, wo) / wi.z);
    for (n, (wi, wo)) in pairs(2000, 0.05).enumerate() {
        let turn = crate::math::Mat3::from_rotation_z(n as f64);
        let (here, there) = (table.eval(wi, wo), table.eval(turn * wi, turn * wo));
        assert!((here - there).abs().max_element() <= 1e-9 * here.max_element(), "{here} {there}");
    }
}

#[test]
fn phi_d_is_periodic_by_pi_without_a_seam() {
    let bytes = file(|[_, _, phi]| {
        let (sin, _) = sin_cos(2.0 * PI * (phi as f64 + 0.5) / 180.0);
        Some([1.0 + 0.5 * sin; 3])
    });
    let table = MerlTable::read("test", &bytes).unwrap();
    for degrees in [-1.0, -0.3, 0.0, 0.2, 0.49, 0.51, 45.0, 179.4, 179.7, 180.0, 181.0] {
        let (sin_phi, cos_phi) = sin_cos(f64::to_radians(degrees));
        let ((sin_h, cos_h), (sin_d, cos_d)) = (sin_cos(0.4), sin_cos(0.5));
        let along = Vec3::new(sin_h, 0.0, cos_h) * cos_d;
        let across = Vec3::new(cos_h * cos_phi, sin_phi, -sin_h * cos_phi) * sin_d;
        let expected = 1.0 + 0.5 * sin_cos(2.0 * f64::to_radians(degrees)).0;
        let found = table.eval(along + across, along - across).x;
        // An eighth of the second difference, 0.5 (2 pi/180)^2 / 8.
        assert!((found - expected).abs() < 1e-4, "{degrees}: {found} {expected}");
    }
}

#[test]
fn negative_neighbours_are_dropped_and_a_hole_is_black() {
    // A checkerboard of holes, and a band without measurements.
    let bytes = file(|[h, d, phi]| ((h + d + phi) % 2 == 0 && !(40..44).contains(&d)).then_some([0.5; 3]));
    let table = MerlTable::read("test", &bytes).unwrap();
    for (wi, wo) in pairs(20_000, 0.01) {
        let position = 90.0 * HalfDifference::new(wi, wo).theta_d / FRAC_PI_2 - 0.5;
        let expected = if (40.0..43.0).contains(&position) { 0.0 } else { 0.5 };
        assert!((table.eval(wi, wo).y - expected).abs() < 1e-7, "{position}");
    }
    // One negative channel puts the whole cell outside.
    let mut bytes = file(|_| Some([0.5; 3]));
    for index in 0..CELLS {
        bytes[HEADER + 8 * (CELLS + index)..][..8].copy_from_slice(&(-0.25_f64).to_le_bytes());
    }
    assert!(matches!(MerlTable::read("green", &bytes), Err(MerlError::Empty { .. })));
}

#[test]
fn bad_files_are_refused_with_the_reason() {
    let good = file(|_| Some([0.5; 3]));
    let message = |bytes: &[u8]| MerlTable::read("gold.binary", bytes).unwrap_err().to_string();
    for cut in [0, 3, 11, 12, 1000, good.len() - 1] {
        let text = message(&good[..cut]);
        assert!(text.contains("gold.binary: expected a MERL table of 34992012 bytes, found"), "{cut}: {text}");
    }
    let mut longer = good.clone();
    longer.push(0);
    assert!(message(&longer).contains("found 34992013"));
    let mut swapped = good.clone();
    swapped[..12].reverse();
    assert!(
        message(&swapped).contains("90, 90, 180, found -1275068416, 1509949440, 1509949440"),
        "{}",
        message(&swapped)
    );
    assert!(message(b"\x89PNG\r\n\x1a\n0000").contains("an isotropic .binary file"));
    for bad in [f64::NAN, f64::INFINITY, 1e300] {
        let mut bytes = good.clone();
        let index = (3 * 90 + 2) * 180 + 179;
        bytes[HEADER + 8 * (CELLS + index)..][..8].copy_from_slice(&bad.to_le_bytes());
        let text = message(&bytes);
        assert!(text.contains("in channel 1 at theta_h 3, theta_d 2, phi_d 179"), "{text}");
    }
    assert!(message(&file(|_| None)).contains("only negative cells"));
}
