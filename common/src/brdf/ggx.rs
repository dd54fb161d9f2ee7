//! `ggx`: diffuse plus a GGX microfacet lobe.
//!
//! `f = kd/pi + F D V` with
//! - `D = a^2 / (pi ((n.h)^2 (a^2 - 1) + 1)^2)` (Walter et al. 2007 \[WMLT07\]; Trowbridge & Reitz 1975 \[TR75\]),
//! - `V` the height-correlated Smith masking-shadowing with `1/(4 n.l n.v)` inside (Heitz 2014 \[H14\], eq. 99),
//! - `F = f0 + (1 - f0) F5`, `F5 = (1 - v.h)^5` (Schlick 1994 \[S94\]).
//!
//! Split: `F = f0 (1 - F5) + F5`, so the weights are `kd`, `f0` and 1.
//!
//! | parameter | meaning | bounds |
//! |---|---|---|
//! | `kd` | diffuse albedo, linear Rec. 709 | [0, 1] |
//! | `f0` | specular reflectance at normal incidence, linear Rec. 709 | [0, 1] |
//! | `alpha` | microfacet width (an artist's roughness is its square root) | [0.005, 1] |

use super::{
    BasisLobe, Lambert, LinearModel, Lobe, Parameter, Split, Weight, Width,
    single::{Formula, Seen, by_formula, second_order},
};
use crate::math::real::Real;
use std::f64::consts::FRAC_1_PI;

/// The model `ggx`.
#[derive(Debug, Clone, Copy)]
pub struct Ggx;

const KD: usize = 0;
const F0: usize = 3;
const ALPHA: usize = 6;

impl LinearModel for Ggx {
    const NAME: &'static str = "ggx";
    const SUMMARY: &'static str =
        "Lambert + GGX microfacets, height-correlated Smith masking-shadowing (Heitz 2014), Schlick Fresnel";
    const PARAMETERS: &'static [Parameter] = &[
        Parameter::colour("kd", "diffuse albedo, linear Rec. 709"),
        Parameter::colour("f0", "specular reflectance at normal incidence, linear Rec. 709"),
        Parameter::width("alpha", "microfacet width of GGX; an artist's roughness is its square root"),
    ];
    const LOBES: &'static [BasisLobe] =
        &[BasisLobe::fixed(&Lambert), BasisLobe::with_width(&GgxLobe, Width::itself(ALPHA))];
    const WEIGHTS: &'static [Weight] = &[Weight::Colour(KD), Weight::Colour(F0), Weight::One];
}

/// The GGX lobe `D V n.l` without Fresnel.
#[derive(Debug, Clone, Copy)]
pub(super) struct GgxLobe;

impl Lobe for GgxLobe {
    fn name(&self) -> &'static str {
        "ggx"
    }

    fn split(&self) -> Split {
        Split::Schlick
    }

    fn equivalent_alpha(&self, width: f64) -> Option<f64> {
        Some(width)
    }

    by_formula!();
}

impl Formula for GgxLobe {
    /// `D V n.l`: with `d = sin^2(th) + a^2 cos^2(th)` the distribution is `a^2 / (pi d^2)`, and
    /// `V n.l = n.l / (2 (n.l s(n.v) + n.v s(n.l)))`, `s(c) = sqrt(a^2 + (1 - a^2) c^2)`.
    ///
    /// Spread: with `u = sin^2(th)` and `k = 1 - a^2`, `d = a^2 + k u`, so that `D'/D = -2 k / d` and `D''/D = 6 k^2 / d^2`.
    #[inline(always)]
    fn value<T: Real>(g: &Seen<T>, alpha: T) -> T {
        let one = T::of(1.0);
        let a2 = alpha * alpha;
        let k = one - a2;
        let d = a2 + k * g.sin2_h;
        let cos_i = g.cos_i.max(T::of(0.0));
        let s_o = (a2 + k * g.cos_o * g.cos_o).sqrt();
        let s_i = (a2 + k * cos_i * cos_i).sqrt();
        // One division for both quotients: by d^2, and by d^2 times the denominator of V.
        let visibility = cos_i * s_o + g.cos_o * s_i;
        let inverse = one / (d * d * visibility);
        let excess = k * (T::of(3.0) * k * g.du2 - T::of(2.0) * d * g.du);
        a2 * cos_i * second_order(excess * visibility * inverse) * inverse * T::of(0.5 * FRAC_1_PI)
    }
}
