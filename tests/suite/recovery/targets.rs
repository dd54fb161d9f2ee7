//! Materials whose parameters must be recovered.

use lookalike::brdf::{CookTorrance, Ggx, Model};

/// A class of material, as parameters of every model.
#[derive(Debug)]
pub(super) struct Target {
    pub(super) name: &'static str,
    kd: [f64; 3],
    /// Specular colour at normal incidence.
    specular: [f64; 3],
    /// Scalar `f0` of models that have one in addition to a colour.
    f0: f64,
    width: f64,
}

pub(super) const METAL: Target =
    Target { name: "metal", kd: [0.0; 3], specular: [0.9, 0.6, 0.3], f0: 0.8, width: 0.15 };

pub(super) const PLASTIC: Target =
    Target { name: "plastic", kd: [0.4, 0.15, 0.08], specular: [0.04; 3], f0: 0.05, width: 0.08 };

#[cfg(feature = "slow")]
pub(super) const ROUGH: Target =
    Target { name: "rough", kd: [0.3, 0.25, 0.2], specular: [0.06, 0.06, 0.05], f0: 0.1, width: 0.45 };

pub(super) const NEAR_MIRROR: Target =
    Target { name: "near-mirror", kd: [0.02, 0.02, 0.03], specular: [0.7, 0.72, 0.75], f0: 0.6, width: 0.02 };

#[cfg(feature = "slow")]
pub(super) const MIRROR: Target =
    Target { name: "mirror", kd: [0.01; 3], specular: [0.85, 0.8, 0.7], f0: 0.7, width: 0.01 };

impl Target {
    /// Every model with its flat parameter vector.
    pub(super) fn parameters(&self) -> [(&'static dyn Model, Vec<f64>); 2] {
        let Self { kd, specular, f0, width, .. } = *self;
        let ks = specular.map(|s| s / f0);
        [(&Ggx, [&kd[..], &specular, &[1.0, width]].concat()), (&CookTorrance, [&kd[..], &ks, &[f0, width]].concat())]
    }
}
