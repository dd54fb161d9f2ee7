//! The proof of the rendering: transport tables against the direct integrator, and both against what is known exactly.

mod limits;
#[cfg(feature = "slow")]
mod probes;
mod tables;

use lookalike::{
    brdf::MODELS,
    math::Rgb,
    render::{
        knots::{Knots, PER_OCTAVE},
        transport::Accuracy,
    },
};
use lookalike_tests::scene::{
    Scene,
    agreement::{Agreement, References, mid_knots},
    reference::Effort,
    spread,
};

/// Largest root mean square deviation of tables of stage one, as a share of mean radiance (design section 5).
const TOLERANCE: f64 = 2e-3;

/// Largest standard error of the reference, as a share of mean radiance: a quarter of the tolerance.
const STANDARD_ERROR: f64 = 5e-4;

/// Enough for [`STANDARD_ERROR`]: in a root mean square over the pixels most are far better than the worst.
const EFFORT: Effort = Effort { first: 1 << 13, standard_error: 7e-4, level: Rgb::ONE, most: 1 << 22 };

fn knots(per_octave: f64) -> Knots {
    Knots::covering(0.005, 1.0, per_octave)
}

/// One comparison of every lobe of every model.
struct Case<'a> {
    /// For the print.
    name: &'a str,
    /// Widths; the nearest mid-knots are taken.
    alphas: &'a [f64],
    /// Pixels of full coverage, spread over the object.
    pixels: usize,
    /// Of the tables.
    accuracy: Accuracy,
    /// Largest root mean square deviation of any part of any lobe.
    tolerance: f64,
}

impl Case<'_> {
    /// Asserts and prints.
    #[track_caller]
    fn check(&self, scene: &Scene) {
        let pixels = spread(&scene.interior(), self.pixels, 1);
        let widths = mid_knots(&knots(PER_OCTAVE), self.alphas);
        for model in MODELS {
            let references = References::new(scene, *model, &pixels, &widths, EFFORT);
            let agreements = references.compare(scene, knots(PER_OCTAVE), self.accuracy);
            for agreement in &agreements {
                println!("{}, {}: {agreement}", self.name, model.name());
                self.judge(agreement);
            }
        }
    }

    #[track_caller]
    fn judge(&self, agreement: &Agreement) {
        assert!(agreement.standard_error < STANDARD_ERROR, "{}: the reference is too noisy: {agreement}", self.name);
        assert!(agreement.rms < self.tolerance, "{}: {agreement}", self.name);
    }
}
