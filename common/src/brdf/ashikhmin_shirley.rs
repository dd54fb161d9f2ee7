//! `ashikhmin-shirley`: Ashikhmin & Shirley's coupled diffuse and specular lobes, isotropic.
//!
//! `f = 28/(23 pi) kd (1 - f0) (1 - (1 - n.l/2)^5) (1 - (1 - n.v/2)^5) + F (n + 1)/(8 pi) (n.h)^n / (v.h max(n.l, n.v))` with
//! `F = f0 + (1 - f0) F5`, `F5 = (1 - v.h)^5`
//!
//! (Ashikhmin & Shirley 2000 \[AS00\], with both exponents equal; Fresnel term of Schlick 1994.) The diffuse lobe loses what the specular lobe
//! reflects, so that both together conserve energy. Split: the weights are `kd (1 - f0)`, `f0` and 1. The first is a product of two
//! parameters; the scan solves for the product instead of `kd`.
//!
//! The lobe gets narrower as `n` grows: its width is `alpha = sqrt(2/(n + 2))`, from 0.0045 to 0.82 within the bounds. Searches move
//! `n` by its logarithm.
//!
//! | parameter | meaning | bounds |
//! |---|---|---|
//! | `kd` | diffuse colour, linear Rec. 709: the albedo of what is not reflected specularly | [0, 1] |
//! | `f0` | specular reflectance at normal incidence, linear Rec. 709 | [0, 1] |
//! | `n` | exponent of the cosine between normal and half vector | [1, 1e5] |

use super::{Angles, BasisLobe, Expected, Factor, LinearModel, Lobe, Parameter, Split, Spread, Weight, power};
use crate::math::elementary::fifth_power;
use std::f64::consts::PI;

/// The model `ashikhmin-shirley`.
#[derive(Debug, Clone, Copy)]
pub struct AshikhminShirley;

const KD: usize = 0;
const F0: usize = 3;
const N: usize = 6;

impl LinearModel for AshikhminShirley {
    const NAME: &'static str = "ashikhmin-shirley";
    const SUMMARY: &'static str =
        "Ashikhmin & Shirley 2000, isotropic: coupled diffuse and specular lobes, Schlick Fresnel";
    const PARAMETERS: &'static [Parameter] = &[
        Parameter::colour("kd", "diffuse colour, linear Rec. 709: the albedo of what is not reflected specularly"),
        Parameter::colour("f0", "specular reflectance at normal incidence, linear Rec. 709"),
        power::EXPONENT,
    ];
    const LOBES: &'static [BasisLobe] =
        &[BasisLobe::fixed(&DiffuseLobe), BasisLobe::with_width(&SpecularLobe, power::width(N))];
    const WEIGHTS: &'static [Weight] = &[&[Factor::Colour(KD), Factor::RestOfColour(F0)], &[Factor::Colour(F0)], &[]];
    /// `1 - (1 - n.v/2)^5` at `n.v = 1`.
    const DIFFUSE_ALBEDO: f64 = 1.0 - 1.0 / 32.0;
}

/// The diffuse lobe of unit weight; its albedo is `1 - (1 - n.v/2)^5`.
#[derive(Debug, Clone, Copy)]
struct DiffuseLobe;

impl Lobe for DiffuseLobe {
    fn name(&self) -> &'static str {
        "ashikhmin-shirley diffuse"
    }

    fn split(&self) -> Split {
        Split::Whole
    }

    fn equivalent_alpha(&self, _width: f64) -> Option<f64> {
        None
    }

    /// Its curvature has one sign from the normal to the horizon, so the errors of a cut add up.
    fn care(&self) -> f64 {
        4.0
    }

    /// The second derivative of `28/23 (1 - (1 - n.l/2)^5) (1 - (1 - n.v/2)^5) n.l` is largest at the horizon: 5 times 28/23.
    fn bend(&self) -> f64 {
        6.1
    }

    #[inline(always)]
    fn kernel(&self, g: &Angles, _spread: &Spread, _width: f64) -> f64 {
        let cos_i = g.cos_i.max(0.0);
        let transmitted = |cos: f64| 1.0 - fifth_power(1.0 - 0.5 * cos);
        28.0 / (23.0 * PI) * transmitted(cos_i) * transmitted(g.cos_o) * cos_i
    }
}

/// The specular lobe without Fresnel.
#[derive(Debug, Clone, Copy)]
struct SpecularLobe;

impl Lobe for SpecularLobe {
    fn name(&self) -> &'static str {
        "ashikhmin-shirley"
    }

    fn split(&self) -> Split {
        Split::Schlick
    }

    fn equivalent_alpha(&self, width: f64) -> Option<f64> {
        Some(width)
    }

    /// Off the mirror direction `1/(v.h)` and the larger cosine vary as much as the distribution of a wide lobe.
    fn care(&self) -> f64 {
        2.0
    }

    fn footprint(&self, width: f64) -> f64 {
        power::footprint(width)
    }

    fn expected(&self) -> Expected {
        let sharp_albedo = |width, cos_o| (1.0, power::beyond_kink(width, cos_o));
        Expected { sharp_albedo, is_kinked: true, ..Expected::default() }
    }

    /// Zero for light below the horizon, where `v.h` may be 0.
    #[inline(always)]
    fn kernel(&self, g: &Angles, spread: &Spread, alpha: f64) -> f64 {
        let cos_i = g.cos_i.max(0.0);
        let (lobe, blur) = power::cosine(g, spread, alpha);
        let cos_d = g.cos_d.max(f64::MIN_POSITIVE);
        lobe * blur * (power::exponent(alpha) + 1.0) * cos_i / (8.0 * PI * cos_d * g.cos_o.max(cos_i))
    }
}
