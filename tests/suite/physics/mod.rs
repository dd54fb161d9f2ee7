//! The proof of the rendering: transport tables against the direct integrator, and both against what is known exactly.

mod limits;
#[cfg(feature = "slow")]
mod probes;
mod tables;

use lookalike::{
    brdf::Model,
    math::Rgb,
    render::{
        knots::{Knots, PER_OCTAVE},
        transport::Accuracy,
    },
};
use lookalike_tests::scene::{
    Scene,
    agreement::{References, mid_knots},
    reference::Effort,
    spread,
};

/// Largest root mean square deviation of tables of stage one, as a share of mean radiance (design section 5).
const TOLERANCE: f64 = 2e-3;

/// How good the reference has to be.
#[derive(Debug, Clone, Copy)]
struct Rigour {
    effort: Effort,
    /// Largest standard error, root mean square over the pixels, as a share of mean radiance.
    standard_error: f64,
}

/// In seconds: half of [`TOLERANCE`], which then holds a table to 0.17 %.
const QUICK: Rigour =
    Rigour { effort: Effort { first: 1 << 12, standard_error: 1.5e-3, ..EFFORT }, standard_error: 1e-3 };

/// In minutes: a quarter of [`TOLERANCE`] (design section 5).
#[cfg(feature = "slow")]
const THOROUGH: Rigour =
    Rigour { effort: Effort { first: 1 << 13, standard_error: 7e-4, ..EFFORT }, standard_error: 5e-4 };

const EFFORT: Effort = Effort { first: 1 << 13, standard_error: 1e-3, level: Rgb::ONE, most: 1 << 22 };

fn knots(per_octave: f64) -> Knots {
    Knots::covering(0.005, 1.0, per_octave)
}

/// One comparison of every lobe of some models.
struct Case<'a> {
    /// For the print.
    name: &'a str,
    /// Whose lobes.
    models: &'a [&'static dyn Model],
    /// Widths; the nearest mid-knots are taken.
    alphas: &'a [f64],
    /// Pixels of full coverage, spread over the object.
    pixels: usize,
    /// Accuracies of tables, each with the largest root mean square deviation of any part of any lobe.
    accuracies: &'a [(Accuracy, f64)],
    /// Of the reference.
    rigour: Rigour,
}

impl Case<'_> {
    /// Prints every deviation, then asserts.
    #[track_caller]
    fn check(&self, scene: &Scene) {
        let pixels = spread(&scene.interior(), self.pixels, 1);
        let widths = mid_knots(&knots(PER_OCTAVE), self.alphas);
        let mut failures = Vec::new();
        let mut seen: Vec<&str> = Vec::new();
        for model in self.models {
            // A lobe that several models share is integrated once.
            let is_new = |name: &str| !seen.contains(&name);
            let references =
                References::new(scene, *model, &pixels, (knots(PER_OCTAVE), &widths), self.rigour.effort, is_new);
            seen.extend(model.lobes().iter().map(|basis| basis.lobe.name()));
            for &(accuracy, tolerance) in self.accuracies {
                for agreement in references.compare(scene, knots(PER_OCTAVE), accuracy) {
                    let line = format!("{}, {}, {:e}: {agreement}", self.name, model.name(), accuracy.tolerance);
                    println!("{line}");
                    if agreement.rms > tolerance || agreement.standard_error > self.rigour.standard_error {
                        failures.push(line);
                    }
                }
            }
        }
        assert!(failures.is_empty(), "{failures:#?}");
    }
}
