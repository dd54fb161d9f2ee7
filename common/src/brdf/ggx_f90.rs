//! `ggx-f90`: `ggx` whose reflectance at grazing incidence is a parameter.
//!
//! `f = kd/pi + F D V` with `D` and `V` of `ggx` and `F = f0 + (f90 - f0) F5`, `F5 = (1 - v.h)^5`: Schlick (1994) with `f90` instead of 1.
//!
//! A smooth interface reflects all light at grazing incidence, and so does `ggx`. The specular lobe of the measured materials of
//! docs/results.md is weaker at every angle (docs/method.md), so the rim of their `ggx` renderings is too bright.
//! MaterialX has this model as the generalized Schlick BSDF with a grey `color90`.
//!
//! Split: `F = f0 (1 - F5) + f90 F5`, so the weights are `kd`, `f0` and `f90`.
//!
//! | parameter | meaning | bounds |
//! |---|---|---|
//! | `kd` | diffuse albedo, linear Rec. 709 | [0, 1] |
//! | `f0` | specular reflectance at normal incidence, linear Rec. 709 | [0, 1] |
//! | `f90` | specular reflectance at grazing incidence, the same in all channels | [0, 1] |
//! | `alpha` | microfacet width (an artist's roughness is its square root) | [0.005, 1] |

use super::{BasisLobe, Lambert, LinearModel, Parameter, Role, Weight, Width, ggx::GgxLobe};

/// The model `ggx-f90`.
#[derive(Debug, Clone, Copy)]
pub struct GgxF90;

const KD: usize = 0;
const F0: usize = 3;
const F90: usize = 6;
const ALPHA: usize = 7;

impl LinearModel for GgxF90 {
    const NAME: &'static str = "ggx-f90";
    const SUMMARY: &'static str = "ggx with its reflectance at grazing incidence as a parameter (Schlick's 1 replaced)";
    const PARAMETERS: &'static [Parameter] = &[
        Parameter::colour("kd", "diffuse albedo, linear Rec. 709"),
        Parameter::colour("f0", "specular reflectance at normal incidence, linear Rec. 709"),
        // 1 is a smooth interface.
        Parameter {
            upper_is_kind: true,
            ..Parameter::scalar("f90", "specular reflectance at grazing incidence, of all colours", Role::Linear)
        },
        Parameter::width("alpha", "microfacet width of GGX; an artist's roughness is its square root"),
    ];
    const LOBES: &'static [BasisLobe] =
        &[BasisLobe::fixed(&Lambert), BasisLobe::with_width(&GgxLobe, Width::itself(ALPHA))];
    const WEIGHTS: &'static [Weight] = &[Weight::Colour(KD), Weight::Colour(F0), Weight::Scalar(F90)];
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        brdf::{Ggx, Material, Reflectance},
        math::Vec3,
    };

    #[test]
    fn at_f90_of_1_it_is_ggx_and_at_0_it_has_no_rim() {
        let (wi, wo) = (Vec3::new(0.9, 0.1, 0.2).normalize(), Vec3::new(-0.95, 0.0, 0.15).normalize());
        let value = |model, parameters: &[f64]| Material::new(model, parameters.to_vec()).unwrap().eval_cos(wi, wo);
        let ggx = value(&Ggx, &[0.1, 0.2, 0.3, 0.04, 0.05, 0.06, 0.2]);
        let with = |f90: f64| value(&GgxF90, &[0.1, 0.2, 0.3, 0.04, 0.05, 0.06, f90, 0.2]);
        assert_eq!(with(1.0), ggx);
        assert!(with(0.0).max_element() < 0.2 * ggx.max_element(), "{} {ggx}", with(0.0));
    }
}
