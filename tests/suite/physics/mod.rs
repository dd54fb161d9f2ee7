//! Tests of rendering: transport tables against the direct integrator, and both against exactly known values.

mod limits;
#[cfg(feature = "slow")]
mod probes;
mod stored;
mod tables;

use lookalike::{
    brdf::Model,
    math::Rgb,
    render::{
        knots::{Knots, PER_OCTAVE},
        transport::{Accuracy, Pixel},
    },
};
use lookalike_tests::scene::{
    Scene,
    agreement::{References, mid_knots},
    reference::Effort,
    spread,
};
use std::collections::BTreeSet;

/// Largest root mean square deviation of tables of stage one, as a share of mean radiance (design section 5).
const TOLERANCE: f64 = 2e-3;

/// The same of full-resolution tables: stage two and polish rank images that differ by far more.
const FULL_TOLERANCE: f64 = 5e-3;

/// The accuracies of tables that are compared, and what each must keep.
const ACCURACIES: &[(Accuracy, f64)] = &[(Accuracy::SUBSET, TOLERANCE), (Accuracy::FULL, FULL_TOLERANCE)];

/// The target accuracy of a reference.
#[derive(Debug, Clone, Copy)]
struct Rigour {
    effort: Effort,
    /// Largest standard error, root mean square over the pixels, as a share of mean radiance.
    standard_error: f64,
}

/// Takes seconds: half of [`TOLERANCE`], with which a table is held to 0.17 %.
const QUICK: Rigour =
    Rigour { effort: Effort { first: 1 << 12, standard_error: 1.5e-3, ..EFFORT }, standard_error: 1e-3 };

/// Takes minutes: a quarter of [`TOLERANCE`] (design section 5).
const THOROUGH: Rigour =
    Rigour { effort: Effort { first: 1 << 13, standard_error: 7e-4, ..EFFORT }, standard_error: 5e-4 };

const EFFORT: Effort = Effort { first: 1 << 13, standard_error: 1e-3, level: Rgb::ONE, most: 1 << 22 };

fn knots(per_octave: f64) -> Knots {
    Knots::covering(0.005, 1.0, per_octave)
}

/// One comparison of every lobe of some models.
struct Case {
    /// A name for the output.
    name: &'static str,
    scene: Scene,
    /// The models whose lobes are compared.
    models: Vec<&'static dyn Model>,
    /// Widths; the nearest mid-knots are used.
    alphas: &'static [f64],
    /// Pixels of full coverage, spread over the object.
    pixels: usize,
    /// Accuracies of tables, each with the largest root mean square deviation of any part of any lobe.
    accuracies: &'static [(Accuracy, f64)],
    /// Accuracy of the reference.
    rigour: Rigour,
}

impl Case {
    /// Prints every deviation, then asserts the largest ones.
    #[track_caller]
    fn check(&self, references: &[References]) {
        let mut failures = Vec::new();
        for references in references {
            for &(accuracy, tolerance) in self.accuracies {
                for agreement in references.compare(&self.scene, knots(PER_OCTAVE), accuracy) {
                    let model = references.model().name();
                    let line = format!("{}, {model}, {:e}: {agreement}", self.name, accuracy.tolerance);
                    println!("{line}");
                    if agreement.rms > tolerance || agreement.standard_error > self.rigour.standard_error {
                        failures.push(line);
                    }
                }
            }
        }
        assert!(failures.is_empty(), "{failures:#?}");
    }

    /// References of every lobe by the direct integrator.
    fn integrate(&self) -> Vec<References> {
        let (pixels, widths) = (self.pixels(), mid_knots(&knots(PER_OCTAVE), self.alphas));
        let of_model = |(model, lobes): (&'static dyn Model, Vec<&str>)| {
            let (grid, effort) = ((knots(PER_OCTAVE), &widths[..]), self.rigour.effort);
            References::new(&self.scene, model, &pixels, grid, effort, |name| lobes.contains(&name))
        };
        self.lobes().into_iter().map(of_model).collect()
    }

    fn pixels(&self) -> Vec<Pixel> {
        spread(&self.scene.interior(), self.pixels, 1)
    }

    /// The lobes of each model. A lobe shared by several models is compared once.
    fn lobes(&self) -> Vec<(&'static dyn Model, Vec<&'static str>)> {
        let mut seen = BTreeSet::new();
        let mut of_model = |model: &'static dyn Model| {
            let names = model.lobes().iter().map(|basis| basis.lobe.name());
            names.filter(|name| seen.insert(*name)).collect()
        };
        self.models.iter().map(|&model| (model, of_model(model))).collect()
    }
}
