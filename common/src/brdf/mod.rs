//! Reflectance models, one file each, and the registry that names them.
//!
//! A model is a sum of *basis lobes* with weights. For fixed lobe widths the radiance of a pixel is linear in the
//! weights, so a transport table per lobe replaces rendering (design section 5):
//!
//! `f(wi, wo) cos(theta_i) = sum_t weight_t(parameters) * basis_t(wi, wo; width)`
//!
//! A [`Model`] therefore declares its [`Parameter`]s, its [`BasisLobe`]s, and the map (with derivative) from parameters to
//! weights of lobes. A new model is one file and its three lines here; help, tests of physics, agreement and recovery iterate
//! [`MODELS`].
//!
//! Conventions: directions point away from the surface; `f` is in 1/sr; `alpha` is the microfacet width, not an artist's
//! roughness.

mod angles;
mod ashikhmin_shirley;
mod beckmann;
mod blinn_phong;
mod cook_torrance;
mod disney;
mod ggx;
mod ggx_haze;
mod lambert;
mod lights;
mod linear;
mod lobe;
pub mod merl;
mod model;
mod parameter;
mod power;
mod reflectance;
mod single;
mod ward;
mod width;

pub use angles::Angles;
pub use ashikhmin_shirley::AshikhminShirley;
pub use blinn_phong::BlinnPhong;
pub use cook_torrance::CookTorrance;
pub use disney::Disney;
pub use ggx::Ggx;
pub use ggx_haze::GgxHaze;
pub use lambert::Lambert;
#[cfg(test)]
pub(crate) use lights::Incident;
pub use lights::{BLOCK, Lights, Spread};
pub use linear::{Factor, LinearModel, Remark, Weight};
pub use lobe::{Expected, Lobe, Split, Tail};
pub use model::{BasisLobe, Model, lit_lobes, lobe_terms, main_lobe, parameter, term_count};
pub use parameter::{Channels, Parameter, ParameterError, Role, Scale, flat_bounds, flat_len, flat_names, offset_of};
pub use reflectance::{Material, Reflectance};
pub use ward::Ward;
pub use width::Width;

/// Every model, in the order in which lists show them.
pub static MODELS: &[&dyn Model] = &[&Ggx, &GgxHaze, &CookTorrance, &Ward, &BlinnPhong, &AshikhminShirley, &Disney];

/// The default model.
pub static DEFAULT_MODEL: &dyn Model = &Ggx;

/// A model with the values of parameters that are held.
pub type HeldModel = (&'static dyn Model, &'static [(&'static str, f64)]);

/// The models of `--model auto`, from simple to rich.
pub static AUTO: &[HeldModel] = &[(&Ggx, &[("f90", 1.0)]), (&Ggx, &[]), (&GgxHaze, &[])];

/// The model of the papers' results and of `--preset paper`.
pub static PAPER_MODEL: &dyn Model = &CookTorrance;

/// Names of earlier versions, and what to use instead.
const RENAMED: &[(&str, &str)] =
    &[("ggx-f90", "ggx, which has the parameter f90: 1 for a smooth surface, and free in a fit")];

/// A basis lobe's function by its name, the same for every model that has it.
#[must_use]
pub fn lobe(name: &str) -> Option<&'static dyn Lobe> {
    MODELS.iter().flat_map(|model| model.lobes()).map(|basis| basis.lobe).find(|lobe| lobe.name() == name)
}

/// Looks a model up by name.
///
/// # Errors
/// [`ParameterError::UnknownModel`], which lists the known models, or [`ParameterError::Renamed`].
pub fn model(name: &str) -> Result<&'static dyn Model, ParameterError> {
    if let Some(&(name, now)) = RENAMED.iter().find(|(old, _)| *old == name) {
        return Err(ParameterError::Renamed { name, now });
    }
    MODELS.iter().copied().find(|m| m.name() == name).ok_or_else(|| ParameterError::UnknownModel {
        name: name.to_owned(),
        known: MODELS.iter().map(|m| m.name()).collect::<Vec<_>>().join(", "),
    })
}

#[cfg(test)]
mod tests;
