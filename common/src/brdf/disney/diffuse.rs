//! The lobes of `disney` without a width: diffuse, subsurface and sheen.
//!
//! With `FL = (1 - n.l)^5`, `FV = (1 - n.v)^5`, `c = v.h` and the roughness `r`
//! - `f_d = 1/pi (1 + (F90 - 1) FL) (1 + (F90 - 1) FV)`, `F90 = 0.5 + 2 c^2 r`,
//! - `f_ss = 1.25/pi (F (1/(n.l + n.v) - 0.5) + 0.5)`, `F` as above with `F90 = c^2 r`
//!
//! (Burley 2012, section 5.3). Each factor is `(1 - s FL) + e r FL`, so both lobes are polynomials in `r`.

use super::super::{Angles, Expected, Lobe, Split, Spread};
use crate::math::elementary::fifth_power;
use std::f64::consts::FRAC_1_PI;

/// The coefficient of `roughness^POWER` in the diffuse lobe.
#[derive(Debug, Clone, Copy)]
pub(super) struct Diffuse<const POWER: u8>;

/// The coefficient of `roughness^POWER` in the subsurface lobe.
#[derive(Debug, Clone, Copy)]
pub(super) struct Subsurface<const POWER: u8>;

/// The sheen, `F5`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sheen;

/// Coefficient of `r^POWER` in `((1 - s FL) + e r FL) ((1 - s FV) + e r FV)`.
#[inline(always)]
fn coefficient<const POWER: u8>(fl: f64, fv: f64, s: f64, e: f64) -> f64 {
    match POWER {
        0 => (1.0 - s * fl) * (1.0 - s * fv),
        1 => e * (fl * (1.0 - s * fv) + fv * (1.0 - s * fl)),
        _ => e * e * (fl * fv),
    }
}

/// `n.l`, `FL` and `FV`.
#[inline(always)]
fn rims(g: &Angles) -> (f64, f64, f64) {
    let cos_i = g.cos_i.max(0.0);
    (cos_i, fifth_power(1.0 - cos_i.min(1.0)), fifth_power(1.0 - g.cos_o.min(1.0)))
}

/// Names of the lobes at roughness 0; the others of each family adjust them.
const DIFFUSE: &str = "disney diffuse";
const SUBSURFACE: &str = "disney subsurface";

/// The errors of a cut have one sign from the normal to the rim, so they add up.
const CARE: f64 = 4.0;

impl<const POWER: u8> Lobe for Diffuse<POWER> {
    fn name(&self) -> &'static str {
        [DIFFUSE, "disney diffuse, by roughness", "disney diffuse, by its square"][usize::from(POWER)]
    }

    fn split(&self) -> Split {
        Split::Whole
    }

    fn equivalent_alpha(&self, _width: f64) -> Option<f64> {
        None
    }

    fn care(&self) -> f64 {
        CARE
    }

    /// The second derivative of `g(x) x` at the horizon is `2 g'`: 5 for `1 - FL/2`, 10 for `FL`.
    fn bend(&self) -> f64 {
        [5.0, 20.0, 40.0][usize::from(POWER)]
    }

    fn expected(&self) -> Expected {
        Expected { adjusts: (POWER > 0).then_some(DIFFUSE), ..Expected::default() }
    }

    #[inline(always)]
    fn kernel(&self, g: &Angles, _spread: &Spread, _width: f64) -> f64 {
        let (cos_i, fl, fv) = rims(g);
        FRAC_1_PI * coefficient::<POWER>(fl, fv, 0.5, 2.0 * g.cos_d * g.cos_d) * cos_i
    }
}

impl<const POWER: u8> Lobe for Subsurface<POWER> {
    fn name(&self) -> &'static str {
        [SUBSURFACE, "disney subsurface, by roughness", "disney subsurface, by its square"][usize::from(POWER)]
    }

    fn split(&self) -> Split {
        Split::Whole
    }

    fn equivalent_alpha(&self, _width: f64) -> Option<f64> {
        None
    }

    fn care(&self) -> f64 {
        CARE
    }

    /// At grazing views it is that of `1/(n.l + n.v)`, over a few times `n.v`.
    fn bend(&self) -> f64 {
        60.0
    }

    /// The formula has an albedo of up to 1.205 (computed in NumPy).
    fn expected(&self) -> Expected {
        let most_albedo = if POWER == 0 { 1.21 } else { 1.0 };
        Expected { most_albedo, adjusts: (POWER > 0).then_some(SUBSURFACE), ..Expected::default() }
    }

    #[inline(always)]
    fn kernel(&self, g: &Angles, _spread: &Spread, _width: f64) -> f64 {
        let (cos_i, fl, fv) = rims(g);
        let scale = 1.0 / (cos_i + g.cos_o) - 0.5;
        let constant = if POWER == 0 { 0.5 } else { 0.0 };
        1.25 * FRAC_1_PI * (coefficient::<POWER>(fl, fv, 1.0, g.cos_d * g.cos_d) * scale + constant) * cos_i
    }
}

impl Lobe for Sheen {
    fn name(&self) -> &'static str {
        "disney sheen"
    }

    fn split(&self) -> Split {
        Split::Whole
    }

    fn equivalent_alpha(&self, _width: f64) -> Option<f64> {
        None
    }

    fn care(&self) -> f64 {
        12.0 * CARE
    }

    fn bend(&self) -> f64 {
        20.0
    }

    #[inline(always)]
    fn kernel(&self, g: &Angles, _spread: &Spread, _width: f64) -> f64 {
        g.f5() * g.cos_i.max(0.0)
    }
}
