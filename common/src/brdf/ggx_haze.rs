//! `ggx-haze`: [`ggx`](super::ggx) with two widths, a sharp core and a wide tail under one Fresnel term.
//!
//! `f = kd/pi + F ((1 - haze) D V(alpha) + haze D V(alpha_haze))` with `F`, `D` and `V` of `ggx` and `alpha_haze = alpha^(1 - t)`. Two
//! lobes of this kind describe the haze around highlights of polished surfaces (Barla, Pacanowski & Vangorp 2018, "A Composite BRDF
//! Model for Hazy Gloss"), and distributions with a longer tail than that of GGX.
//!
//! | parameter | meaning | bounds |
//! |---|---|---|
//! | `kd` | diffuse albedo, linear Rec. 709 | [0, 1] |
//! | `f0` | specular reflectance at normal incidence, linear Rec. 709 | [0, 2] |
//! | `f90` | specular reflectance at grazing incidence, the same in all channels | [0, 2] |
//! | `alpha` | microfacet width of the core | [0.005, 1] |
//! | `haze` | share of the tail in the specular lobe | [0, 1] |
//! | `t` | from a tail as wide as the core (0) to one of width 1 | [0, 1] |

use super::{
    BasisLobe, Factor, Lambert, LinearModel, Parameter, Remark, Weight, Width,
    ggx::{Ggx, GgxLobe},
};

/// The model `ggx-haze`.
#[derive(Debug, Clone, Copy)]
pub struct GgxHaze;

const KD: usize = 0;
const F0: usize = 3;
const F90: usize = 6;
const ALPHA: usize = 7;
const HAZE: usize = 8;
const T: usize = 9;

impl LinearModel for GgxHaze {
    const NAME: &'static str = "ggx-haze";
    const SUMMARY: &'static str =
        "ggx with a second, wider lobe under the same Fresnel term: a core with haze around it";
    const PARAMETERS: &'static [Parameter] = &[
        Ggx::PARAMETERS[0],
        Ggx::PARAMETERS[1],
        Ggx::PARAMETERS[2],
        Parameter::width("alpha", "microfacet width of the core; an artist's roughness is its square root"),
        Parameter::blend("haze", "share of the wide lobe in the specular reflection", &[0.15, 0.5]),
        Parameter::blend("t", "width of the wide lobe, which is alpha^(1-t)", &[0.4, 0.7]),
    ];
    const LOBES: &'static [BasisLobe] = &[
        BasisLobe::fixed(&Lambert),
        BasisLobe::with_width(&GgxLobe, Width::itself(ALPHA)),
        BasisLobe::with_width(&GgxLobe, Width::itself(ALPHA).widened(T)),
    ];
    const WEIGHTS: &'static [Weight] = &[
        &[Factor::Colour(KD)],
        &[Factor::Colour(F0), Factor::RestOfScalar(HAZE)],
        &[Factor::Scalar(F90), Factor::RestOfScalar(HAZE)],
        &[Factor::Colour(F0), Factor::Scalar(HAZE)],
        &[Factor::Scalar(F90), Factor::Scalar(HAZE)],
    ];
    const SPECULAR: Weight = &[Factor::Colour(F0)];
    const REMARK: Option<Remark> = Ggx::REMARK;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        brdf::{Material, Reflectance},
        math::Vec3,
    };

    #[test]
    fn without_haze_and_with_a_tail_as_wide_as_the_core_it_is_ggx() {
        let (wi, wo) = (Vec3::new(0.5, 0.1, 0.7).normalize(), Vec3::new(-0.35, 0.0, 0.75).normalize());
        let core = [0.1, 0.2, 0.3, 0.04, 0.05, 0.06, 0.9, 0.2];
        let ggx = |alpha: f64| {
            let parameters = [&core[..7], &[alpha]].concat();
            Material::new(&Ggx, parameters).unwrap().eval_cos(wi, wo)
        };
        let with = |haze: f64, t: f64| {
            let parameters = [&core[..], &[haze, t]].concat();
            Material::new(&GgxHaze, parameters).unwrap().eval_cos(wi, wo)
        };
        let near = |a: crate::math::Rgb, b: crate::math::Rgb| (a - b).abs().max_element() < 1e-14;
        assert!(near(with(0.0, 0.7), ggx(0.2)) && near(with(0.6, 0.0), ggx(0.2)));
        // All in the tail, of width .2^(1/2).
        assert!(near(with(1.0, 0.5), ggx(0.2_f64.sqrt())));
        assert!(near(with(0.25, 0.5), ggx(0.2) * 0.75 + ggx(0.2_f64.sqrt()) * 0.25));
    }
}
