//! Parameters that the photo does not determine are reported as such.

use super::scene::{Bench, capture_of, method};
use crate::{
    fit::{Known, Method, Standing},
    plan::{FitOutcome, FitPlanner},
    scene::Circle,
};

const SIZE: usize = 64;

fn outcome(name: &str, material: &[f64], noise: f64) -> FitOutcome {
    let method = Method { gammas: vec![1.0, 2.0], ..method(name) };
    // On fewer pixels the rim, whose coverage two quadratures see differently, would count for too much.
    let capture = capture_of(name, material, noise, (SIZE, SIZE), Circle::inscribed(SIZE, SIZE));
    let planner = FitPlanner::new(capture, method, 1.0).unwrap();
    Bench::default().run(planner, |_| 0, |_, output| output).unwrap().into_outcome().unwrap()
}

#[test]
fn width_and_fresnel_of_a_material_without_highlights_are_not_determined() {
    let outcome = outcome("cook-torrance", &[0.3, 0.2, 0.1, 0.0, 0.0, 0.0, 0.3, 0.2], 0.02);
    let entries = &outcome.uncertainty.entries;
    assert_eq!(
        (entries[7].standing, entries[6].standing),
        (Standing::Undetermined, Standing::Undetermined),
        "{entries:?}"
    );
    for Known { low, high, standing } in &entries[..3] {
        assert!(*standing == Standing::Determined && high - low < 0.06, "{entries:?}");
    }
}

#[test]
fn parameters_of_a_glossy_material_are_determined_and_within_their_ranges() {
    let material = [0.3, 0.2, 0.1, 0.05, 0.05, 0.05, 1.0, 0.2];
    let mut widths = Vec::new();
    for noise in [0.005, 0.05] {
        let outcome = outcome("ggx", &material, noise);
        let entries = &outcome.uncertainty.entries;
        for (Known { low, high, standing }, known) in entries.iter().zip(&material) {
            assert_eq!(*standing, Standing::Determined, "{entries:?}");
            // The difference of two quadratures is below 0.01 in every parameter here.
            assert!((low - 0.01..=high + 0.01).contains(known), "{low} to {high} of {known}");
        }
        widths.push(entries[7].high - entries[7].low);
    }
    assert!(widths[1] > 1.5 * widths[0], "noise makes a width less certain: {widths:?}");
}
