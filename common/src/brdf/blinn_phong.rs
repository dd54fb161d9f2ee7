//! `blinn-phong`: diffuse plus Blinn's lobe, the cosine of the half vector's angle to a power.
//!
//! `f = kd/pi + ks D / (4 max(n.l, n.v))`, `D = (n + 2)/(2 pi) (n.h)^n`
//!
//! (Blinn 1977; `D` is normalised as a distribution of microfacets, and the division by the larger cosine is that of Neumann, Neumann &
//! Szirmay-Kalos 1999.) There is no Fresnel term: the lobe has one weight, `ks`. The lobe reflects no more than it receives: a sharp one
//! all of it at normal incidence and, as it lacks the `1/(v.h)` of microfacets, `n.v` of it at any other angle.
//!
//! The lobe gets narrower as `n` grows: its width is `alpha = sqrt(2/(n + 2))`, for which `D` has the peak of GGX and Beckmann,
//! `1/(pi alpha^2)`; from 0.0045 to 0.82 within the bounds. Searches move `n` by its logarithm.
//!
//! | parameter | meaning | bounds |
//! |---|---|---|
//! | `kd` | diffuse albedo, linear Rec. 709 | [0, 1] |
//! | `ks` | specular colour, linear Rec. 709: about the albedo of a sharp lobe | [0, 1] |
//! | `n` | exponent of the cosine between normal and half vector | [1, 1e5] |

use super::{
    Angles, BasisLobe, Channels, Incident, Lambert, Lobe, Model, Parameter, Role, Scale, Split, Spread,
    lobe::accumulate, power,
};
use crate::math::Rgb;
use std::f64::consts::PI;

/// The model `blinn-phong`.
#[derive(Debug, Clone, Copy)]
pub struct BlinnPhong;

const KD: usize = 0;
const KS: usize = 3;
const N: usize = 6;

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
        name: "ks",
        meaning: "specular colour, linear Rec. 709: about the albedo of a sharp lobe",
        channels: Channels::Rgb,
        lower: 0.0,
        upper: 1.0,
        start: 0.3,
        role: Role::Linear,
        scale: Scale::Linear,
    },
    Parameter {
        name: "n",
        meaning: "exponent of the cosine between normal and half vector",
        channels: Channels::Scalar,
        lower: 1.0,
        upper: 1e5,
        start: 20.0,
        role: Role::Width,
        scale: Scale::Logarithmic,
    },
];

static LOBES: [BasisLobe; 2] =
    [BasisLobe { lobe: &Lambert, width: None }, BasisLobe { lobe: &BlinnPhongLobe, width: Some(power::width(N)) }];

impl Model for BlinnPhong {
    fn name(&self) -> &'static str {
        "blinn-phong"
    }

    fn summary(&self) -> &'static str {
        "Lambert + Blinn 1977, normalised as microfacets, over the larger cosine (Neumann et al. 1999); no Fresnel term"
    }

    fn parameters(&self) -> &'static [Parameter] {
        &PARAMETERS
    }

    fn lobes(&self) -> &'static [BasisLobe] {
        &LOBES
    }

    fn weights(&self, p: &[f64], weights: &mut [Rgb]) {
        weights[0] = Rgb::from_slice(&p[KD..]);
        weights[1] = Rgb::from_slice(&p[KS..]);
    }

    fn weight_derivatives(&self, _p: &[f64], push: &mut dyn FnMut(usize, usize, usize, f64)) {
        for c in 0..3 {
            push(0, c, KD + c, 1.0);
            push(1, c, KS + c, 1.0);
        }
    }

    fn diffuse_albedo(&self, p: &[f64]) -> Rgb {
        Rgb::from_slice(&p[KD..])
    }

    fn normal_incidence_specular(&self, p: &[f64]) -> Rgb {
        Rgb::from_slice(&p[KS..])
    }
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

    fn eval(&self, angles: &Angles, width: f64) -> f64 {
        kernel(angles, &Spread::default(), width)
    }

    fn accumulate(&self, incident: &[Incident], cos_o: f64, widths: &[f64], sums: &mut [f64]) {
        accumulate(self.split(), incident, cos_o, widths, sums, kernel);
    }
}

/// Zero below the horizon of the light.
#[inline(always)]
fn kernel(g: &Angles, spread: &Spread, alpha: f64) -> f64 {
    let cos_i = g.cos_i.max(0.0);
    let (lobe, blur) = power::cosine(g, spread, alpha);
    lobe * blur * cos_i / (4.0 * PI * alpha * alpha * g.cos_o.max(cos_i))
}
