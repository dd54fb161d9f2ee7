//! `blinn-phong`: diffuse plus Blinn's lobe, the cosine of the half vector's angle to a power.
//!
//! `f = kd/pi + ks D / (4 max(n.l, n.v))`, `D = (n + 2)/(2 pi) (n.h)^n`
//!
//! (Blinn 1977 \[B77\]; `D` is normalised as a distribution of microfacets, and the division by the larger cosine is that of Neumann,
//! Neumann & Szirmay-Kalos 1999 \[NNS99\].) There is no Fresnel term: the lobe has one weight, `ks`. The albedo of the lobe is at most 1.
//! That of a sharp lobe is `n.v`, because the `1/(v.h)` of microfacets is missing.
//!
//! The lobe gets narrower as `n` grows: its width is `alpha = sqrt(2/(n + 2))`, for which `D` has the peak of GGX and Beckmann,
//! `1/(pi alpha^2)`; from 0.0045 to 0.82 within the bounds. Searches move `n` by its logarithm.
//!
//! | parameter | meaning | bounds |
//! |---|---|---|
//! | `kd` | diffuse albedo, linear Rec. 709 | [0, 1] |
//! | `ks` | specular colour, linear Rec. 709: about the albedo of a sharp lobe | [0, 1] |
//! | `n` | exponent of the cosine between normal and half vector | [1, 1e5] |

use super::{Angles, BasisLobe, Expected, Factor, Lambert, LinearModel, Lobe, Parameter, Split, Spread, Weight, power};
use std::f64::consts::PI;

/// The model `blinn-phong`.
#[derive(Debug, Clone, Copy)]
pub struct BlinnPhong;

const KD: usize = 0;
const KS: usize = 3;
const N: usize = 6;

impl LinearModel for BlinnPhong {
    const NAME: &'static str = "blinn-phong";
    const SUMMARY: &'static str = "Lambert + Blinn 1977, normalised as microfacets, over the larger cosine (Neumann et al. 1999); no Fresnel term";
    const PARAMETERS: &'static [Parameter] = &[
        Parameter::colour("kd", "diffuse albedo, linear Rec. 709"),
        Parameter::colour("ks", "specular colour, linear Rec. 709: about the albedo of a sharp lobe"),
        power::EXPONENT,
    ];
    const LOBES: &'static [BasisLobe] =
        &[BasisLobe::fixed(&Lambert), BasisLobe::with_width(&BlinnPhongLobe, power::width(N))];
    const WEIGHTS: &'static [Weight] = &[&[Factor::Colour(KD)], &[Factor::Colour(KS)]];
}

/// The lobe `D n.l / (4 max(n.l, n.v))`.
#[derive(Debug, Clone, Copy)]
pub(super) struct BlinnPhongLobe;

impl Lobe for BlinnPhongLobe {
    fn name(&self) -> &'static str {
        "blinn-phong"
    }

    fn split(&self) -> Split {
        Split::Whole
    }

    fn equivalent_alpha(&self, width: f64) -> Option<f64> {
        Some(width)
    }

    /// Its kink near the mirror direction varies as much as the distribution of a wide lobe.
    fn care(&self) -> f64 {
        2.0
    }

    fn footprint(&self, width: f64) -> f64 {
        power::footprint(width)
    }

    /// The albedo of a sharp lobe is `n.v`, because the `1/(v.h)` of microfacets is missing.
    fn expected(&self) -> Expected {
        let sharp_albedo = |width, cos_o| (cos_o, power::beyond_kink(width, cos_o));
        Expected { sharp_albedo, is_kinked: true, ..Expected::default() }
    }

    /// Zero for light below the horizon.
    #[inline(always)]
    fn kernel(&self, g: &Angles, spread: &Spread, alpha: f64) -> f64 {
        let cos_i = g.cos_i.max(0.0);
        let (lobe, blur) = power::cosine(g, spread, alpha);
        lobe * blur * cos_i / (4.0 * PI * alpha * alpha * g.cos_o.max(cos_i))
    }
}
