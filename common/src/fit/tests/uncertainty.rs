//! Parameters that the photo does not determine are reported as such.

use super::scene::{Bench, capture, method};
use crate::{
    fit::{Method, Uncertainty},
    plan::{FitOutcome, FitPlanner},
};

fn outcome(name: &str, material: &[f64], noise: f64) -> FitOutcome {
    let method = Method { polish: false, ..method(name) };
    let planner = FitPlanner::new(capture(name, material, noise), method, 1.0).unwrap();
    Bench::default().run(planner, |_| 0, |_, output| output).unwrap().into_outcome().unwrap()
}

#[test]
fn width_and_fresnel_of_a_material_without_highlights_are_not_determined() {
    let outcome = outcome("cook-torrance", &[0.3, 0.2, 0.1, 0.0, 0.0, 0.0, 0.3, 0.2], 0.02);
    let won = &outcome.judged[outcome.winner];
    assert_eq!(outcome.uncertainty[7], Uncertainty::Undetermined, "m: {won:?} {:?}", outcome.uncertainty);
    assert_eq!(outcome.uncertainty[6], Uncertainty::Undetermined, "f0: {won:?} {:?}", outcome.uncertainty);
    for colour in &outcome.uncertainty[..3] {
        assert!(matches!(colour, Uncertainty::StandardError(e) if *e < 0.02), "{:?}", outcome.uncertainty);
    }
}

#[test]
fn parameters_of_a_glossy_material_are_determined_and_within_their_errors() {
    let material = [0.3, 0.2, 0.1, 0.05, 0.05, 0.05, 1.0, 0.2];
    for noise in [0.0, 0.02] {
        let outcome = outcome("ggx", &material, noise);
        let errors = outcome.uncertainty.iter().map(|u| match u {
            Uncertainty::StandardError(error) => *error,
            other => panic!("{other:?}: {:?}", outcome.uncertainty),
        });
        let found = &outcome.judged[outcome.winner].candidate.parameters;
        for ((error, found), known) in errors.zip(found).zip(&material) {
            // Beside the noise there is the difference of two quadratures, below 0.01 in every parameter here.
            assert!((found - known).abs() < 4.0 * error + 0.01, "{found} +- {error} of {known}");
        }
    }
}
