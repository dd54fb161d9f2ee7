//! `ggx`: diffuse plus a GGX microfacet lobe. The default model.
//!
//! `f = kd/pi + F D V` with
//! - `D = a^2 / (pi ((n.h)^2 (a^2 - 1) + 1)^2)` (Walter et al. 2007; Trowbridge & Reitz 1975),
//! - `V` the height-correlated Smith masking-shadowing with `1/(4 n.l n.v)` inside (Heitz 2014, eq. 99),
//! - `F = f0 + (1 - f0) F5`, `F5 = (1 - v.h)^5` (Schlick 1994).
//!
//! Split: `F = f0 (1 - F5) + F5`, so the weights are `kd`, `f0` and 1.
//!
//! | parameter | meaning | bounds |
//! |---|---|---|
//! | `kd` | diffuse albedo, linear Rec. 709 | [0, 1] |
//! | `f0` | specular reflectance at normal incidence, linear Rec. 709 | [0, 1] |
//! | `alpha` | microfacet width (an artist's roughness is its square root) | [0.005, 1] |

use super::{
    Angles, BasisLobe, Channels, Incident, Lambert, Lobe, Model, Parameter, Role, Scale, Split, Spread, Width,
    lobe::{accumulate, second_order},
};
use crate::math::Rgb;
use std::f64::consts::FRAC_1_PI;

/// The model `ggx`.
#[derive(Debug, Clone, Copy)]
pub struct Ggx;

const KD: usize = 0;
const F0: usize = 3;
const ALPHA: usize = 6;

static PARAMETERS: [Parameter; 3] = [
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
        name: "f0",
        meaning: "specular reflectance at normal incidence, linear Rec. 709",
        channels: Channels::Rgb,
        lower: 0.0,
        upper: 1.0,
        start: 0.3,
        role: Role::Linear,
        scale: Scale::Linear,
    },
    Parameter {
        name: "alpha",
        meaning: "microfacet width of GGX; an artist's roughness is its square root",
        channels: Channels::Scalar,
        lower: 0.005,
        upper: 1.0,
        start: 0.3,
        role: Role::Width,
        scale: Scale::Linear,
    },
];

static LOBES: [BasisLobe; 2] =
    [BasisLobe { lobe: &Lambert, width: None }, BasisLobe { lobe: &GgxLobe, width: Some(Width::itself(ALPHA)) }];

impl Model for Ggx {
    fn name(&self) -> &'static str {
        "ggx"
    }

    fn summary(&self) -> &'static str {
        "Lambert + GGX microfacets, height-correlated Smith masking-shadowing (Heitz 2014), Schlick Fresnel"
    }

    fn parameters(&self) -> &'static [Parameter] {
        &PARAMETERS
    }

    fn lobes(&self) -> &'static [BasisLobe] {
        &LOBES
    }

    fn weights(&self, p: &[f64], weights: &mut [Rgb]) {
        weights[0] = Rgb::from_slice(&p[KD..]);
        weights[1] = Rgb::from_slice(&p[F0..]);
        weights[2] = Rgb::ONE;
    }

    fn weight_derivatives(&self, _p: &[f64], push: &mut dyn FnMut(usize, usize, usize, f64)) {
        for c in 0..3 {
            push(0, c, KD + c, 1.0);
            push(1, c, F0 + c, 1.0);
        }
    }

    fn diffuse_albedo(&self, p: &[f64]) -> Rgb {
        Rgb::from_slice(&p[KD..])
    }

    fn normal_incidence_specular(&self, p: &[f64]) -> Rgb {
        Rgb::from_slice(&p[F0..])
    }
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

    fn eval(&self, angles: &Angles, width: f64) -> f64 {
        kernel(angles, &Spread::default(), width)
    }

    fn accumulate(&self, incident: &[Incident], cos_o: f64, widths: &[f64], sums: &mut [f64]) {
        accumulate(self.split(), incident, cos_o, widths, sums, kernel);
    }
}

/// `D V n.l`: with `d = sin^2(th) + a^2 cos^2(th)` the distribution is `a^2 / (pi d^2)`, and
/// `V n.l = n.l / (2 (n.l s(n.v) + n.v s(n.l)))`, `s(c) = sqrt(a^2 + (1 - a^2) c^2)`.
///
/// Spread: with `u = sin^2(th)` and `k = 1 - a^2`, `d = a^2 + k u`, so that `D'/D = -2 k / d` and `D''/D = 6 k^2 / d^2`.
#[inline(always)]
fn kernel(g: &Angles, spread: &Spread, alpha: f64) -> f64 {
    let a2 = alpha * alpha;
    let k = 1.0 - a2;
    let d = a2 + k * g.sin2_h;
    let cos_i = g.cos_i.max(0.0);
    let s_o = (a2 + k * g.cos_o * g.cos_o).sqrt();
    let s_i = (a2 + k * cos_i * cos_i).sqrt();
    // One division for both quotients: by d^2, and by d^2 times the denominator of V.
    let visibility = cos_i * s_o + g.cos_o * s_i;
    let inverse = 1.0 / (d * d * visibility);
    let excess = k * (3.0 * k * spread.du2 - 2.0 * d * spread.du);
    a2 * cos_i * second_order(excess * visibility * inverse) * inverse * (0.5 * FRAC_1_PI)
}
