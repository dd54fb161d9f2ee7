//! `disney`: Burley's principled BRDF of 2012, isotropic and without tints.
//!
//! `f = (1 - metallic) (base_color ((1 - subsurface) f_d + subsurface f_ss) + sheen F5) + F D G / (4 n.l n.v) + clearcoat/4 F_c D_c G_c / (4 n.l n.v)`
//! with `F5 = (1 - v.h)^5` (Schlick 1994) and
//! - `f_d`, `f_ss`: a diffuse lobe whose rim follows the roughness, and an approximation of subsurface scattering after Hanrahan & Krueger
//!   1993 (`disney/diffuse.rs`),
//! - `D`: GGX of `alpha = roughness^2`; `G`: separable Smith masking of the wider `alpha_g = (0.5 + roughness/2)^2`;
//!   `F = c + (1 - c) F5`, `c = (1 - metallic) 0.08 specular + metallic base_color`,
//! - `D_c`: the distribution with the long tail, `1/(a^2 + tan^2)` to the first power (GTR 1), `a = 0.1 - 0.099 clearcoat_gloss`; `G_c`
//!   Smith's masking of width 0.25; `F_c = 0.04 + 0.96 F5` (`disney/specular.rs`).
//!
//! (Burley 2012 \[B12\], sections 5.3 to 5.6 and the reference implementation, `disney.brdf`; its `specularTint`, `sheenTint` and `anisotropic`
//! are 0.) The Fresnel term is split as in `ggx`. The diffuse lobes are polynomials of the second degree in the roughness, so each is three
//! basis lobes without a grid of widths.
//!
//! | parameter | meaning | bounds |
//! |---|---|---|
//! | `base_color` | colour of the surface, linear Rec. 709: diffuse, and specular where it is metallic | [0, 1] |
//! | `subsurface` | from the diffuse lobe to the subsurface lobe | [0, 1] |
//! | `metallic` | from a dielectric to a metal | [0, 1] |
//! | `specular` | of the dielectric: its reflectance at normal incidence is 0.08 times this | [0, 1] |
//! | `roughness` | square root of the width of the specular lobe | [0.071, 1] |
//! | `sheen` | weight of a white rim | [0, 1] |
//! | `clearcoat` | weight of the coat | [0, 1] |
//! | `clearcoat_gloss` | from a satin coat to a glossy one | [0, 0.9595] |
//!
//! Burley's roughness reaches 0 and his gloss 1; here both lobes end at a width of 0.005, as in `ggx`. At grazing views the published
//! subsurface lobe and satin coat have an albedo of up to 1.25.

mod diffuse;
mod specular;

use super::{BasisLobe, Model, Parameter, Role};
use crate::math::Rgb;
use diffuse::{Diffuse, Sheen, Subsurface};
use specular::{Clearcoat, Specular};

/// The model `disney`.
#[derive(Debug, Clone, Copy)]
pub struct Disney;

const BASE: usize = 0;
const SUBSURFACE: usize = 3;
const METALLIC: usize = 4;
const SPECULAR: usize = 5;
const ROUGHNESS: usize = 6;
const SHEEN: usize = 7;
const CLEARCOAT: usize = 8;
const GLOSS: usize = 9;

/// Reflectance at normal incidence of a dielectric of `specular` 1.
const MOST_DIELECTRIC: f64 = 0.08;

/// Share of the coat's lobe in the sum where `clearcoat` is 1.
const COAT: f64 = 0.25;

/// Reflectance of the coat at normal incidence: polyurethane, index 1.5.
const COAT_F0: f64 = 0.04;

/// First terms of sheen, specular lobe and coat, after three terms each of the diffuse and the subsurface lobe.
const SHEEN_TERM: usize = 6;
const SPECULAR_TERM: usize = 7;
const COAT_TERM: usize = 9;

static PARAMETERS: [Parameter; 8] = [
    Parameter::colour("base_color", "colour of the surface, linear Rec. 709: diffuse, and specular of a metal"),
    Parameter::blend("subsurface", "from the diffuse lobe to the subsurface lobe", &[0.0, 1.0]),
    Parameter::blend("metallic", "from a dielectric to a metal", &[0.0, 0.5, 1.0]),
    Parameter::scalar(
        "specular",
        "of a dielectric: 0.08 times this is its reflectance at normal incidence",
        Role::Linear,
    ),
    Parameter {
        lower: specular::LEAST_ROUGHNESS,
        ..Parameter::scalar("roughness", "square root of the width of the specular lobe", Role::Width)
    },
    Parameter::scalar("sheen", "weight of a white rim", Role::Linear),
    Parameter::scalar("clearcoat", "weight of the clear coat", Role::Linear),
    Parameter {
        upper: specular::MOST_GLOSS,
        ..Parameter::scalar("clearcoat_gloss", "from a satin coat to a glossy one", Role::Scanned(&[0.0, 0.5, 0.9]))
    },
];

static LOBES: [BasisLobe; 9] = [
    BasisLobe::fixed(&Diffuse::<0>),
    BasisLobe::fixed(&Diffuse::<1>),
    BasisLobe::fixed(&Diffuse::<2>),
    BasisLobe::fixed(&Subsurface::<0>),
    BasisLobe::fixed(&Subsurface::<1>),
    BasisLobe::fixed(&Subsurface::<2>),
    BasisLobe::fixed(&Sheen),
    BasisLobe::with_width(&Specular, specular::roughness(ROUGHNESS)),
    BasisLobe::with_width(&Clearcoat, specular::gloss(GLOSS)),
];

impl Model for Disney {
    fn name(&self) -> &'static str {
        "disney"
    }

    fn summary(&self) -> &'static str {
        "Burley 2012, isotropic, without tints: diffuse, subsurface, sheen, GGX metal or dielectric, clear coat"
    }

    fn parameters(&self) -> &'static [Parameter] {
        &PARAMETERS
    }

    fn lobes(&self) -> &'static [BasisLobe] {
        &LOBES
    }

    fn weights(&self, p: &[f64], weights: &mut [Rgb]) {
        let base = Rgb::from_slice(&p[BASE..]);
        let (dielectric, below) = (1.0 - p[METALLIC], p[SUBSURFACE]);
        let mut power = 1.0;
        for t in 0..3 {
            weights[t] = base * (dielectric * (1.0 - below) * power);
            weights[3 + t] = base * (dielectric * below * power);
            power *= p[ROUGHNESS];
        }
        weights[SHEEN_TERM] = Rgb::splat(dielectric * p[SHEEN]);
        weights[SPECULAR_TERM] = self.normal_incidence_specular(p);
        weights[SPECULAR_TERM + 1] = Rgb::ONE;
        weights[COAT_TERM] = Rgb::splat(COAT * COAT_F0 * p[CLEARCOAT]);
        weights[COAT_TERM + 1] = Rgb::splat(COAT * p[CLEARCOAT]);
    }

    fn weight_derivatives(&self, p: &[f64], push: &mut dyn FnMut(usize, usize, usize, f64)) {
        let (dielectric, below, roughness) = (1.0 - p[METALLIC], p[SUBSURFACE], p[ROUGHNESS]);
        let powers = [(1.0, 0.0), (roughness, 1.0), (roughness * roughness, 2.0 * roughness)];
        for c in 0..3 {
            let base = p[BASE + c];
            for (t, (power, slope)) in powers.into_iter().enumerate() {
                for (term, share, sign) in [(t, 1.0 - below, -1.0), (3 + t, below, 1.0)] {
                    push(term, c, BASE + c, dielectric * share * power);
                    push(term, c, SUBSURFACE, sign * dielectric * base * power);
                    push(term, c, METALLIC, -share * base * power);
                    push(term, c, ROUGHNESS, dielectric * share * base * slope);
                }
            }
            push(SHEEN_TERM, c, METALLIC, -p[SHEEN]);
            push(SHEEN_TERM, c, SHEEN, dielectric);
            push(SPECULAR_TERM, c, BASE + c, p[METALLIC]);
            push(SPECULAR_TERM, c, METALLIC, base - MOST_DIELECTRIC * p[SPECULAR]);
            push(SPECULAR_TERM, c, SPECULAR, MOST_DIELECTRIC * dielectric);
            push(COAT_TERM, c, CLEARCOAT, COAT * COAT_F0);
            push(COAT_TERM + 1, c, CLEARCOAT, COAT);
        }
    }

    fn normal_incidence_specular(&self, p: &[f64]) -> Rgb {
        let dielectric = (1.0 - p[METALLIC]) * MOST_DIELECTRIC * p[SPECULAR];
        Rgb::splat(dielectric) + Rgb::from_slice(&p[BASE..]) * p[METALLIC]
    }

    /// The albedo of the subsurface lobe is about three quarters of that of the diffuse lobe.
    fn diffuse_albedo(&self, p: &[f64]) -> Rgb {
        Rgb::from_slice(&p[BASE..]) * ((1.0 - p[METALLIC]) * (1.0 - 0.25 * p[SUBSURFACE]))
    }
}

#[cfg(test)]
mod tests;
