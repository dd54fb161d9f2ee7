//! Tables against the direct integrator under real light: takes minutes, so it needs `--features slow`.

use super::{ACCURACIES, Case, THOROUGH};
use lookalike::{brdf::MODELS, scene::Camera};
use lookalike_tests::scene::{
    Scene,
    probes::{GRACE, NOON_GRASS, Probe, RNL, STUDIO, UFFIZI},
};

/// Half-way between knots, over the widths of common materials.
const ALPHAS: [f64; 6] = [0.01, 0.025, 0.06, 0.15, 0.4, 0.95];

fn agree(probe: Probe) {
    let Some(environment) = probe.load() else { return };
    let scene = Scene::sphere(256, Camera::Orthographic, environment).unwrap();
    let case = Case {
        name: probe.0,
        scene,
        models: MODELS.to_vec(),
        alphas: &ALPHAS,
        pixels: 64,
        accuracies: ACCURACIES,
        rigour: THOROUGH,
    };
    case.check(&case.integrate());
}

#[test]
fn tables_agree_under_grace_cathedral() {
    agree(GRACE);
}

#[test]
fn tables_agree_under_eucalyptus_grove() {
    agree(RNL);
}

#[test]
fn tables_agree_under_the_uffizi_gallery() {
    agree(UFFIZI);
}

#[test]
fn tables_agree_in_a_studio() {
    agree(STUDIO);
}

#[test]
fn tables_agree_under_a_real_sun() {
    agree(NOON_GRASS);
}
