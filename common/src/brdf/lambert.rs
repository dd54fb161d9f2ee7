//! Lambert's diffuse lobe, `1/pi`.

use super::{Angles, Incident, Lobe, Split, lobe::Spread, lobe::accumulate};
use std::f64::consts::FRAC_1_PI;

/// `f = 1/pi`, so that a weight is the diffuse albedo.
#[derive(Debug, Clone, Copy)]
pub struct Lambert;

impl Lobe for Lambert {
    fn name(&self) -> &'static str {
        "lambert"
    }

    fn split(&self) -> Split {
        Split::Whole
    }

    fn equivalent_alpha(&self, _width: f64) -> Option<f64> {
        None
    }

    fn eval(&self, angles: &Angles, _width: f64) -> f64 {
        kernel(angles, &Spread::default(), 0.0)
    }

    fn accumulate(&self, incident: &[Incident], cos_o: f64, widths: &[f64], sums: &mut [f64]) {
        accumulate(self.split(), incident, cos_o, widths, sums, kernel);
    }
}

#[inline(always)]
fn kernel(angles: &Angles, _spread: &Spread, _width: f64) -> f64 {
    FRAC_1_PI * angles.cos_i.max(0.0)
}
