//! `ggx-f90`: `ggx` whose reflectance at grazing incidence is a parameter.
//!
//! `f = kd/pi + F D V` with `D` and `V` of `ggx` and `F = f0 + (f90 - f0) F5`, `F5 = (1 - v.h)^5` (Schlick 1994, with his 1 replaced).
//!
//! A smooth interface reflects everything at grazing incidence. The measured materials of docs/results.md do not: they darken towards the
//! rim, whether by their roughness or by how they were measured and fitted, and `ggx` must give them a rim that they have not.
//! In MaterialX it is the generalized Schlick BSDF with a grey `color90`.
//!
//! Split: `F = f0 (1 - F5) + f90 F5`, so the weights are `kd`, `f0` and `f90`.
//!
//! | parameter | meaning | bounds |
//! |---|---|---|
//! | `kd` | diffuse albedo, linear Rec. 709 | [0, 1] |
//! | `f0` | specular reflectance at normal incidence, linear Rec. 709 | [0, 1] |
//! | `f90` | specular reflectance at grazing incidence, of all colours | [0, 1] |
//! | `alpha` | microfacet width (an artist's roughness is its square root) | [0.005, 1] |

use super::{BasisLobe, Channels, Lambert, Model, Parameter, Role, Scale, Width, ggx::GgxLobe};
use crate::math::Rgb;

/// The model `ggx-f90`.
#[derive(Debug, Clone, Copy)]
pub struct GgxF90;

const KD: usize = 0;
const F0: usize = 3;
const F90: usize = 6;
const ALPHA: usize = 7;

const fn parameter(name: &'static str, meaning: &'static str, channels: Channels, role: Role) -> Parameter {
    Parameter { name, meaning, channels, lower: 0.0, upper: 1.0, start: 0.3, role, scale: Scale::Linear }
}

static PARAMETERS: [Parameter; 4] = [
    parameter("kd", "diffuse albedo, linear Rec. 709", Channels::Rgb, Role::Linear),
    parameter("f0", "specular reflectance at normal incidence, linear Rec. 709", Channels::Rgb, Role::Linear),
    parameter("f90", "specular reflectance at grazing incidence, of all colours", Channels::Scalar, Role::Linear),
    Parameter {
        lower: 0.005,
        ..parameter(
            "alpha",
            "microfacet width of GGX; an artist's roughness is its square root",
            Channels::Scalar,
            Role::Width,
        )
    },
];

static LOBES: [BasisLobe; 2] =
    [BasisLobe { lobe: &Lambert, width: None }, BasisLobe { lobe: &GgxLobe, width: Some(Width::itself(ALPHA)) }];

impl Model for GgxF90 {
    fn name(&self) -> &'static str {
        "ggx-f90"
    }

    fn summary(&self) -> &'static str {
        "ggx with its reflectance at grazing incidence as a parameter (Schlick's 1 replaced)"
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
        weights[2] = Rgb::splat(p[F90]);
    }

    fn weight_derivatives(&self, _p: &[f64], push: &mut dyn FnMut(usize, usize, usize, f64)) {
        for c in 0..3 {
            push(0, c, KD + c, 1.0);
            push(1, c, F0 + c, 1.0);
            push(2, c, F90, 1.0);
        }
    }

    fn diffuse_albedo(&self, p: &[f64]) -> Rgb {
        Rgb::from_slice(&p[KD..])
    }

    fn normal_incidence_specular(&self, p: &[f64]) -> Rgb {
        Rgb::from_slice(&p[F0..])
    }
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
