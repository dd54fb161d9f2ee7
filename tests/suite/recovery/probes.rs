//! All materials under real light: takes minutes, so it needs `--features slow`.

use super::{EXPOSURE, GAMMAS, Session, targets::*, unrecovered};
use lookalike::{
    fit::{SearchKind, Start},
    scene::Camera,
};
use lookalike_tests::scene::{
    Scene,
    probes::{GRACE, Probe, RNL, UFFIZI},
};

fn recover(probe: Probe) {
    let Some(environment) = probe.load() else { return };
    let scene = Scene::sphere(256, Camera::Orthographic, environment).unwrap();
    let targets = [METAL, PLASTIC, ROUGH, NEAR_MIRROR];
    let failures: Vec<String> = targets.iter().flat_map(|t| unrecovered(&scene, probe.0, t, EXPOSURE)).collect();
    for report in unrecovered(&scene, probe.0, &MIRROR, EXPOSURE) {
        println!("reported only: {report}");
    }
    assert!(failures.is_empty(), "{failures:#?}");
}

#[test]
fn known_materials_are_recovered_under_grace_cathedral() {
    recover(GRACE);
}

#[test]
fn known_materials_are_recovered_under_eucalyptus_grove() {
    recover(RNL);
}

#[test]
fn known_materials_are_recovered_under_the_uffizi_gallery() {
    recover(UFFIZI);
}

/// Prints a table of what the paper's search reaches from the paper's start; asserts nothing.
#[test]
fn what_pattern_search_reaches_from_the_papers_start() {
    for probe in [GRACE, RNL, UFFIZI] {
        let Some(environment) = probe.load() else { return };
        let scene = Scene::sphere(256, Camera::Orthographic, environment).unwrap();
        for target in [METAL, PLASTIC, ROUGH, NEAR_MIRROR, MIRROR] {
            for (model, truth) in target.parameters() {
                let width = truth[truth.len() - 1];
                let session = Session::new(&scene, model, truth, EXPOSURE);
                for gamma in GAMMAS {
                    let ours = session.search(gamma, SearchKind::LeastSquares, Start::Scan);
                    let paper = session.search(gamma, SearchKind::Pattern, Start::Paper);
                    let last = |p: &[f64]| 100.0 * (p[p.len() - 1] / width - 1.0);
                    println!(
                        "{}, {} {}, gamma {gamma}: cost {:.3} of pattern's, width {:+.2} % against {:+.2} %, \
                         evaluations {} against {}",
                        probe.0,
                        model.name(),
                        target.name,
                        ours.cost / paper.cost,
                        last(&ours.parameters),
                        last(&paper.parameters),
                        ours.evaluations,
                        paper.evaluations
                    );
                }
            }
        }
    }
}
