//! The declaration of a reflectance model.

use super::{Lobe, Parameter, ParameterError, Split, Width, offset_of};
use crate::math::Rgb;
use std::fmt::Debug;

/// A lobe of a model, and where its width comes from.
#[derive(Debug, Clone, Copy)]
pub struct BasisLobe {
    /// The shape.
    pub lobe: &'static dyn Lobe,
    /// How its width follows from the parameters; `None` for a lobe of fixed shape.
    pub width: Option<Width>,
}

impl BasisLobe {
    /// A lobe of fixed shape.
    #[must_use]
    pub const fn fixed(lobe: &'static dyn Lobe) -> Self {
        Self { lobe, width: None }
    }

    /// A lobe whose width follows from a parameter.
    #[must_use]
    pub const fn with_width(lobe: &'static dyn Lobe, width: Width) -> Self {
        Self { lobe, width: Some(width) }
    }

    /// The lobe's width at a flat parameter vector; `None` for a lobe of fixed shape.
    #[must_use]
    pub fn width_at(&self, parameters: &[f64]) -> Option<f64> {
        self.width.map(|width| width.at(parameters))
    }
}

/// A reflectance model: parameters, basis lobes, and the map between them.
///
/// Terms are counted lobe by lobe: a lobe that splits by Schlick's Fresnel term has two, `(1 - F5)` and `F5`; any other
/// has one.
pub trait Model: Debug + Sync {
    /// The name in `--model` and `fit.json`.
    fn name(&self) -> &'static str;

    /// The formula and its source in one line, for the help.
    fn summary(&self) -> &'static str;

    /// Parameters in the order of the flat vector.
    fn parameters(&self) -> &'static [Parameter];

    /// Basis lobes in the order of the terms. The first lobe with a width is the main one: a table may cover a part of
    /// its widths. A lobe may be there twice, with two widths.
    fn lobes(&self) -> &'static [BasisLobe];

    /// Weight of every term at a flat parameter vector; `weights.len()` is [`term_count`].
    fn weights(&self, parameters: &[f64], weights: &mut [Rgb]);

    /// The weights in the coordinates of the scan: affine in all entries of [`Role::Linear`](super::Role::Linear) together, because the
    /// scan solves for all of them at once. Differs from [`Self::weights`] only where one linear parameter multiplies another.
    fn scan_weights(&self, point: &[f64], weights: &mut [Rgb]) {
        self.weights(point, weights);
    }

    /// Converts the coordinates of the scan to parameters within their bounds, with the same weights where the bounds allow.
    fn parameters_of_scan(&self, _point: &mut [f64]) {}

    /// Calls `push(term, channel, entry, value)` for every derivative of a weight by an entry of the flat parameter vector that is not
    /// always zero.
    fn weight_derivatives(&self, parameters: &[f64], push: &mut dyn FnMut(usize, usize, usize, f64));

    /// The colour of the specular lobe at normal incidence, for reports: `f0`, or `ks f0`.
    fn normal_incidence_specular(&self, parameters: &[f64]) -> Rgb;

    /// The diffuse albedo at normal incidence, for reports.
    fn diffuse_albedo(&self, parameters: &[f64]) -> Rgb;

    /// What a user should know about a fit with these parameters, if anything. `is_determined` says of an entry whether the photo
    /// determines it.
    fn remark(&self, _parameters: &[f64], _is_determined: &dyn Fn(usize) -> bool) -> Option<String> {
        None
    }
}

/// The basis lobe of a model's main lobe, the first that has a width, with its width.
#[must_use]
pub fn main_lobe(model: &dyn Model) -> Option<(BasisLobe, Width)> {
    model.lobes().iter().find_map(|basis| Some((*basis, basis.width?)))
}

/// Terms of one lobe.
#[must_use]
pub fn lobe_terms(lobe: &dyn Lobe) -> usize {
    match lobe.split() {
        Split::Whole => 1,
        Split::Schlick => 2,
    }
}

/// Terms of a model.
#[must_use]
pub fn term_count(model: &dyn Model) -> usize {
    model.lobes().iter().map(|b| lobe_terms(b.lobe)).sum()
}

/// For every basis lobe of a model whether a flat parameter vector gives it light: the width of a dark lobe means nothing.
#[must_use]
pub fn lit_lobes(model: &dyn Model, parameters: &[f64]) -> Vec<bool> {
    let mut weights = vec![Rgb::ZERO; term_count(model)];
    model.weights(parameters, &mut weights);
    let mut rest = &weights[..];
    let is_lit = |basis: &BasisLobe| {
        let (of_lobe, others) = rest.split_at(lobe_terms(basis.lobe));
        rest = others;
        of_lobe.iter().any(|weight| *weight != Rgb::ZERO)
    };
    model.lobes().iter().map(is_lit).collect()
}

/// A parameter of a model by name, with its first entry in the flat vector.
///
/// # Errors
/// [`ParameterError::UnknownParameter`].
pub fn parameter(model: &dyn Model, name: &str) -> Result<(&'static Parameter, usize), ParameterError> {
    let parameters = model.parameters();
    let found = parameters.iter().find(|p| p.name == name).zip(offset_of(parameters, name));
    found.ok_or_else(|| {
        let known = parameters.iter().map(|p| p.name).collect::<Vec<_>>().join(", ");
        ParameterError::UnknownParameter { model: model.name(), name: name.to_owned(), known }
    })
}
