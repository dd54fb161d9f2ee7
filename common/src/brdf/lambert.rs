//! Lambert's diffuse lobe, `1/pi`.

use super::{Angles, Lobe, Split, Spread};
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

    #[inline(always)]
    fn kernel(&self, angles: &Angles, _spread: &Spread, _width: f64) -> f64 {
        FRAC_1_PI * angles.cos_i.max(0.0)
    }
}
