//! `cook-torrance`: diffuse plus Cook & Torrance's microfacet lobe, the paper's model.
//!
//! `f = kd/pi + ks (f0 + (1 - f0) F5) D G / (4 n.l n.v)` with
//! - `D = exp(-tan^2(th) / m^2) / (pi m^2 cos^4(th))` (Beckmann),
//! - `G = min(1, 2 n.h n.v / v.h, 2 n.h n.l / v.h)` (V-cavities)
//!
//! (Cook & Torrance 1982, in the form used by Bieron & Peers, EGSR 2020, and Ngan et al. 2005: Schlick's Fresnel term and
//! the factor 4 of microfacet theory.) Split: the weights are `kd`, `ks f0` and `ks`.
//!
//! | parameter | meaning | bounds |
//! |---|---|---|
//! | `kd` | diffuse albedo, linear Rec. 709 | [0, 1] |
//! | `ks` | specular colour, linear Rec. 709 | [0, 2] |
//! | `f0` | Fresnel reflectance at normal incidence, one for all channels | [0, 1] |
//! | `m` | root mean square slope of the microfacets (Beckmann's width) | [0.005, 1] |
//!
//! `ks` and `f0` trade against each other: only `ks f0`, the specular colour at normal incidence, is well determined.

use super::{
    Angles, BasisLobe, Channels, Incident, Lambert, Lobe, Model, Parameter, Role, Scale, Split, Spread, Width,
    beckmann::beckmann, lobe::accumulate,
};
use crate::math::Rgb;

/// The model `cook-torrance`.
#[derive(Debug, Clone, Copy)]
pub struct CookTorrance;

const KD: usize = 0;
const KS: usize = 3;
const F0: usize = 6;
const M: usize = 7;

static PARAMETERS: [Parameter; 4] = [
    Parameter {
        name: "kd",
        meaning: "diffuse albedo, linear Rec. 709",
        channels: Channels::Rgb,
        lower: 0.0,
        upper: 1.0,
        start: 0.3,
        role: Role::Linear,
        scale: Scale::Linear,
    },
    Parameter {
        name: "ks",
        meaning: "specular colour, linear Rec. 709",
        channels: Channels::Rgb,
        lower: 0.0,
        upper: 2.0,
        start: 0.3,
        role: Role::Linear,
        scale: Scale::Linear,
    },
    Parameter {
        name: "f0",
        meaning: "Fresnel reflectance at normal incidence, one for all channels",
        channels: Channels::Scalar,
        lower: 0.0,
        upper: 1.0,
        start: 0.3,
        role: Role::Scanned(&[0.02, 0.04, 0.1, 0.3, 0.6, 0.95]),
        scale: Scale::Linear,
    },
    Parameter {
        name: "m",
        meaning: "root mean square slope of the microfacets (Beckmann's width)",
        channels: Channels::Scalar,
        lower: 0.005,
        upper: 1.0,
        start: 0.3,
        role: Role::Width,
        scale: Scale::Linear,
    },
];

static LOBES: [BasisLobe; 2] =
    [BasisLobe { lobe: &Lambert, width: None }, BasisLobe { lobe: &CookTorranceLobe, width: Some(Width::itself(M)) }];

impl Model for CookTorrance {
    fn name(&self) -> &'static str {
        "cook-torrance"
    }

    fn summary(&self) -> &'static str {
        "Lambert + Cook & Torrance 1982: Beckmann distribution, V-cavity masking-shadowing, Schlick Fresnel"
    }

    fn parameters(&self) -> &'static [Parameter] {
        &PARAMETERS
    }

    fn lobes(&self) -> &'static [BasisLobe] {
        &LOBES
    }

    fn weights(&self, p: &[f64], weights: &mut [Rgb]) {
        weights[0] = Rgb::from_slice(&p[KD..]);
        weights[2] = Rgb::from_slice(&p[KS..]);
        weights[1] = weights[2] * p[F0];
    }

    fn weight_derivatives(&self, p: &[f64], push: &mut dyn FnMut(usize, usize, usize, f64)) {
        for c in 0..3 {
            push(0, c, KD + c, 1.0);
            push(1, c, KS + c, p[F0]);
            push(1, c, F0, p[KS + c]);
            push(2, c, KS + c, 1.0);
        }
    }

    fn diffuse_albedo(&self, p: &[f64]) -> Rgb {
        Rgb::from_slice(&p[KD..])
    }

    fn normal_incidence_specular(&self, p: &[f64]) -> Rgb {
        Rgb::from_slice(&p[KS..]) * p[F0]
    }
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

    /// Beckmann and GGX of equal width have the same curvature at their peak up to a factor of two; GGX has the longer tail, which
    /// is the safe side for sampling and refinement.
    fn equivalent_alpha(&self, width: f64) -> Option<f64> {
        Some(width)
    }

    fn eval(&self, angles: &Angles, width: f64) -> f64 {
        kernel(angles, &Spread::default(), width)
    }

    fn accumulate(&self, incident: &[Incident], cos_o: f64, widths: &[f64], sums: &mut [f64]) {
        accumulate(self.split(), incident, cos_o, widths, sums, kernel);
    }
}

/// `D G / (4 n.v)`; zero below the horizon of the light and for half vectors below the surface.
#[inline(always)]
fn kernel(g: &Angles, spread: &Spread, m: f64) -> f64 {
    let cos_i = g.cos_i.max(0.0);
    let (distribution, blur) = beckmann(g, spread, m);
    let masking = (2.0 * g.cos_h.max(0.0) * g.cos_o.min(cos_i) / g.cos_d).min(1.0);
    distribution * masking * blur / (4.0 * g.cos_o)
}
