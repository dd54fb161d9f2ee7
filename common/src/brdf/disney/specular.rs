//! The lobes of `disney` with a width: the specular lobe and the clear coat (Burley 2012, sections 5.4 to 5.6).
//!
//! Both are `D G / (4 n.l n.v)` with separable Smith masking, `G1(c) / (2 c) = 1/(c + sqrt(g^2 + (1 - g^2) c^2))`.

use super::super::{
    Expected, Lobe, Split, Tail, Width,
    single::{Formula, Seen, by_formula, second_order},
};
use crate::math::real::Real;
use std::f64::consts::FRAC_1_PI;

/// Smallest roughness, for a width of 0.005.
pub(super) const LEAST_ROUGHNESS: f64 = 0.071;

/// Largest gloss of the coat, for a width of 0.005.
pub(super) const MOST_GLOSS: f64 = 0.9595;

/// Width of a coat of gloss 0, and the difference to that of gloss 1.
const SATIN: f64 = 0.1;
const GLOSS_RANGE: f64 = 0.099;

/// `alpha = roughness^2`.
pub(super) const fn roughness(entry: usize) -> Width {
    Width { entry, of: |r| r * r, inverse: f64::sqrt, derivative: |r| 2.0 * r, widened_by: None }
}

/// `a = 0.1 - 0.099 gloss`.
pub(super) const fn gloss(entry: usize) -> Width {
    Width {
        entry,
        of: |g| SATIN - GLOSS_RANGE * g,
        inverse: |a| (SATIN - a) / GLOSS_RANGE,
        derivative: |_| -GLOSS_RANGE,
        widened_by: None,
    }
}

/// `G1(c) / (2 c)` of Smith's masking with the squared width `g2`.
#[inline(always)]
fn masked<T: Real>(cos: T, g2: T) -> T {
    let one = T::of(1.0);
    one / (cos + (g2 + (one - g2) * cos * cos).sqrt())
}

/// The specular lobe without Fresnel.
#[derive(Debug, Clone, Copy)]
pub(super) struct Specular;

impl Lobe for Specular {
    fn name(&self) -> &'static str {
        "disney specular"
    }

    fn split(&self) -> Split {
        Split::Schlick
    }

    fn equivalent_alpha(&self, width: f64) -> Option<f64> {
        Some(width)
    }

    /// The masking is that of a wider distribution.
    fn expected(&self) -> Expected {
        Expected { sharp_albedo: |_, _| (1.0, 0.15), ..Expected::default() }
    }

    by_formula!();
}

impl Formula for Specular {
    /// `D` and its mean over the spread of light are those of `ggx`.
    #[inline(always)]
    fn value<T: Real>(g: &Seen<T>, alpha: T) -> T {
        let a2 = alpha * alpha;
        let k = T::of(1.0) - a2;
        let d = a2 + k * g.sin2_h;
        let cos_i = g.cos_i.max(T::of(0.0));
        let wider = T::of(0.5) + T::of(0.5) * alpha.sqrt();
        let g2 = wider * wider * wider * wider;
        let inverse = T::of(1.0) / (d * d);
        let excess = k * (T::of(3.0) * k * g.du2 - T::of(2.0) * d * g.du);
        T::of(FRAC_1_PI)
            * a2
            * inverse
            * second_order(excess * inverse)
            * cos_i
            * masked(cos_i, g2)
            * masked(g.cos_o, g2)
    }
}

/// The clear coat without Fresnel and weight.
#[derive(Debug, Clone, Copy)]
pub(super) struct Clearcoat;

/// Squared width of the coat's masking.
const COAT_MASKING: f64 = 0.25 * 0.25;

impl Lobe for Clearcoat {
    fn name(&self) -> &'static str {
        "disney clearcoat"
    }

    fn split(&self) -> Split {
        Split::Schlick
    }

    fn equivalent_alpha(&self, width: f64) -> Option<f64> {
        Some(width)
    }

    fn tail(&self) -> Tail {
        Tail::Long
    }

    /// Its weight is at most a quarter, but its long tail gathers the errors of many nodes.
    fn care(&self) -> f64 {
        0.8
    }

    /// The formula has an albedo of up to 1.251 (computed in NumPy). The horizon cuts the long tail of a sharp coat.
    fn expected(&self) -> Expected {
        Expected { most_albedo: 1.255, sharp_albedo: |_, _| (1.0, 0.13), ..Expected::default() }
    }

    by_formula!();
}

impl Formula for Clearcoat {
    /// `D = (1 - a^2) / (-pi ln(a^2)) / d`, `d = a^2 + (1 - a^2) u`, `u = sin^2(th)`. Spread: with `k = 1 - a^2`, `D'/D = -k/d` and
    /// `D''/D = 2 k^2/d^2`.
    #[inline(always)]
    fn value<T: Real>(g: &Seen<T>, width: T) -> T {
        let a2 = width * width;
        let k = T::of(1.0) - a2;
        let inverse = T::of(1.0) / (a2 + k * g.sin2_h);
        let cos_i = g.cos_i.max(T::of(0.0));
        let slope = k * inverse;
        let blur = second_order(slope * (slope * g.du2 - g.du));
        let peak = T::of(-0.5 * FRAC_1_PI) * k / width.ln_positive();
        let masking = T::of(COAT_MASKING);
        peak * inverse * blur * cos_i * masked(cos_i, masking) * masked(g.cos_o, masking)
    }
}
