//! `ggx`: diffuse plus a GGX microfacet lobe.
//!
//! `f = kd/pi + F D V` with
//! - `D = a^2 / (pi ((n.h)^2 (a^2 - 1) + 1)^2)` (Walter et al. 2007 \[WMLT07\]; Trowbridge & Reitz 1975 \[TR75\]),
//! - `V` the height-correlated Smith masking-shadowing with `1/(4 n.l n.v)` inside (Heitz 2014 \[H14\], eq. 99),
//! - `F = f0 + (f90 - f0) F5`, `F5 = (1 - v.h)^5` (Schlick 1994 \[S94\], whose 1 is `f90` here).
//!
//! `f90` is the reflectance at grazing incidence. `F` is `f90` times Schlick's term of `f0/f90`, so `f90` is also a scale of the specular
//! lobe: 1 for a smooth interface photographed with the exposure of the map, .8 if the photo is 20 % darker than the map says. The
//! specular lobe of measured materials is weaker at every angle (docs/method.md). Reflectances may exceed 1, for photos that are
//! brighter than the map says. MaterialX has this model as the generalized Schlick BSDF with a grey `color90`.
//!
//! Split: `F = f0 (1 - F5) + f90 F5`, so the weights are `kd`, `f0` and `f90`.
//!
//! | parameter | meaning | bounds |
//! |---|---|---|
//! | `kd` | diffuse albedo, linear Rec. 709 | [0, 1] |
//! | `f0` | specular reflectance at normal incidence, linear Rec. 709 | [0, 2] |
//! | `f90` | specular reflectance at grazing incidence, the same in all channels | [0, 2] |
//! | `alpha` | microfacet width (an artist's roughness is its square root) | [0.005, 1] |

use super::{
    BasisLobe, Factor, Lambert, LinearModel, Lobe, Parameter, Role, Split, Weight, Width,
    single::{Formula, Seen, by_formula, second_order},
};
use crate::math::real::Real;
use std::f64::consts::FRAC_1_PI;

/// The model `ggx`.
#[derive(Debug, Clone, Copy)]
pub struct Ggx;

/// An `f90` that is no further from 1 needs no explanation: exposures of photo and map seldom agree better.
const USUAL_F90: f64 = 0.1;

const KD: usize = 0;
const F0: usize = 3;
const F90: usize = 6;
const ALPHA: usize = 7;

impl LinearModel for Ggx {
    const NAME: &'static str = "ggx";
    const SUMMARY: &'static str = "Lambert + GGX microfacets, height-correlated Smith masking-shadowing (Heitz 2014), Schlick Fresnel from f0 to f90";
    const PARAMETERS: &'static [Parameter] = &[
        Parameter::colour("kd", "diffuse albedo, linear Rec. 709"),
        Parameter::colour("f0", "specular reflectance at normal incidence, linear Rec. 709").up_to(2.0),
        Parameter::scalar("f90", "specular reflectance at grazing incidence, of all colours", Role::Linear)
            .up_to(2.0)
            .usually(1.0),
        Parameter::width("alpha", "microfacet width of GGX; an artist's roughness is its square root"),
    ];
    const LOBES: &'static [BasisLobe] =
        &[BasisLobe::fixed(&Lambert), BasisLobe::with_width(&GgxLobe, Width::itself(ALPHA))];
    const REMARK: Option<super::Remark> = Some(|parameters, is_determined| {
        let f90 = parameters[F90];
        let is_usual = (f90 - 1.0).abs() <= USUAL_F90;
        (!is_usual && is_determined(F90)).then(|| match f90 < 1.0 {
            true => format!(
                "f90 = {f90:.2}, where a smooth surface has 1: the highlight is weak, as that of most measured materials is, or the \
                 photo is darker than the map says, by up to this factor, and all colours with it"
            ),
            false => format!(
                "f90 = {f90:.2}, where a smooth surface has 1: the photo is brighter than the map says, by about this factor, and all \
                 colours with it"
            ),
        })
    });
    const WEIGHTS: &'static [Weight] = &[&[Factor::Colour(KD)], &[Factor::Colour(F0)], &[Factor::Scalar(F90)]];
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        brdf::{Material, Model, Reflectance},
        math::Vec3,
    };

    #[test]
    fn f90_is_the_reflectance_at_grazing_incidence() {
        let (wi, wo) = (Vec3::new(0.9, 0.1, 0.2).normalize(), Vec3::new(-0.95, 0.0, 0.15).normalize());
        let value = |f0: f64, f90: f64| {
            let parameters = vec![0.0, 0.0, 0.0, f0, f0, f0, f90, 0.2];
            Material::new(&Ggx, parameters).unwrap().eval_cos(wi, wo).x
        };
        let half = (wi + wo).normalize();
        let f5 = (1.0 - wi.dot(half)).powi(5);
        assert!((value(0.04, 1.0) / value(1.0, 1.0) - (0.04 + 0.96 * f5)).abs() < 1e-12);
        assert!((value(0.04, 0.3) / value(1.0, 1.0) - (0.04 + 0.26 * f5)).abs() < 1e-12);
    }

    #[test]
    fn unusual_f90_is_explained_if_the_photo_determines_it() {
        let remark = |f90: f64, is_known: bool| Ggx.remark(&[0.1, 0.1, 0.1, 0.04, 0.04, 0.04, f90, 0.1], &|_| is_known);
        assert!(
            remark(0.21, true).unwrap().starts_with("f90 = 0.21, where a smooth surface has 1: the highlight is weak")
        );
        assert!(remark(1.3, true).unwrap().contains("the photo is brighter than the map says"));
        assert_eq!((remark(0.95, true), remark(0.21, false)), (None, None));
    }
}
