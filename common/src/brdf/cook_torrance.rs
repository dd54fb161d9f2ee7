//! `cook-torrance`: diffuse plus Cook & Torrance's microfacet lobe, the model of the papers.
//!
//! `f = kd/pi + ks (f0 + (1 - f0) F5) D G / (4 n.l n.v)` with
//! - `D = exp(-tan^2(th) / m^2) / (pi m^2 cos^4(th))` (Beckmann),
//! - `G = min(1, 2 n.h n.v / v.h, 2 n.h n.l / v.h)` (V-cavities)
//!
//! (Cook & Torrance 1982 \[CT82\], in the form used by Bieron & Peers 2020 \[BP20a\] and Ngan et al. 2005 \[NDM05\]: Schlick's Fresnel
//! term and the factor 4 of microfacet theory.) Split: the weights are `kd`, `ks f0` and `ks`.
//!
//! | parameter | meaning | bounds |
//! |---|---|---|
//! | `kd` | diffuse albedo, linear Rec. 709 | [0, 1] |
//! | `ks` | specular colour, linear Rec. 709 | [0, 2] |
//! | `f0` | Fresnel reflectance at normal incidence, one for all channels | [0, 1] |
//! | `m` | root mean square slope of the microfacets (Beckmann's width) | [0.005, 1] |
//!
//! A photo determines the product `ks f0`, the specular colour at normal incidence, well, and its factors poorly.

use super::{
    BasisLobe, Factor, Lambert, LinearModel, Lobe, Parameter, Role, Split, Weight, Width,
    beckmann::beckmann,
    single::{Formula, Seen, by_formula},
};
use crate::math::real::Real;

/// The model `cook-torrance`.
#[derive(Debug, Clone, Copy)]
pub struct CookTorrance;

const KD: usize = 0;
const KS: usize = 3;
const F0: usize = 6;
const M: usize = 7;

impl LinearModel for CookTorrance {
    const NAME: &'static str = "cook-torrance";
    const SUMMARY: &'static str =
        "Lambert + Cook & Torrance 1982: Beckmann distribution, V-cavity masking-shadowing, Schlick Fresnel";
    const PARAMETERS: &'static [Parameter] = &[
        Parameter::colour("kd", "diffuse albedo, linear Rec. 709"),
        Parameter { upper: 2.0, ..Parameter::colour("ks", "specular colour, linear Rec. 709") },
        Parameter::scalar(
            "f0",
            "Fresnel reflectance at normal incidence, one for all channels",
            Role::Scanned(&[0.02, 0.04, 0.1, 0.3, 0.6, 0.95]),
        ),
        Parameter::width("m", "root mean square slope of the microfacets (Beckmann's width)"),
    ];
    const LOBES: &'static [BasisLobe] =
        &[BasisLobe::fixed(&Lambert), BasisLobe::with_width(&CookTorranceLobe, Width::itself(M))];
    const WEIGHTS: &'static [Weight] =
        &[&[Factor::Colour(KD)], &[Factor::Colour(KS), Factor::Scalar(F0)], &[Factor::Colour(KS)]];
}

/// The lobe `D G n.l / (4 n.l n.v)` without Fresnel.
#[derive(Debug, Clone, Copy)]
pub(super) struct CookTorranceLobe;

impl Lobe for CookTorranceLobe {
    fn name(&self) -> &'static str {
        "cook-torrance"
    }

    fn split(&self) -> Split {
        Split::Schlick
    }

    /// At equal width the curvatures of Beckmann and GGX at the peak differ by at most a factor of two. The longer tail of GGX is safe for
    /// sampling and refinement.
    fn equivalent_alpha(&self, width: f64) -> Option<f64> {
        Some(width)
    }

    by_formula!();
}

impl Formula for CookTorranceLobe {
    /// `D G / (4 n.v)`; zero for light below the horizon and for half vectors below the surface.
    #[inline(always)]
    fn value<T: Real>(g: &Seen<T>, m: T) -> T {
        let zero = T::of(0.0);
        let cos_i = g.cos_i.max(zero);
        let (distribution, blur) = beckmann(g, m);
        let cos_d = g.cos_d.max(T::of(LEAST_DIVISOR));
        let masking = (T::of(2.0) * g.cos_h.max(zero) * g.cos_o.min(cos_i) / cos_d).min(T::of(1.0));
        distribution * masking * blur / (T::of(4.0) * g.cos_o)
    }
}

/// Least `v.h` by which the masking divides: light opposite to the view.
const LEAST_DIVISOR: f64 = 1e-9;
