//! Anything that can be rendered: a model with parameters, a measured table, a synthetic target.

use super::{Angles, BasisLobe, Model, ParameterError, flat_bounds, flat_len, flat_names, lobe_terms, term_count};
use crate::math::{Rgb, Vec3};
use std::fmt::Debug;

/// A reflectance that the direct integrator can render.
pub trait Reflectance: Debug + Sync {
    /// `f(wi, wo) cos(theta_i)` in 1/sr for directions in the local frame (normal +Z); zero below the horizon.
    fn eval_cos(&self, wi_local: Vec3, wo_local: Vec3) -> Rgb;

    /// GGX widths of the lobes that importance sampling draws from. They need not be exact, but the smallest must be as narrow as the
    /// sharpest feature.
    fn sampling_alphas(&self) -> Vec<f64>;
}

/// A model with its parameters.
#[derive(Debug, Clone)]
pub struct Material {
    model: &'static dyn Model,
    parameters: Vec<f64>,
    weights: Vec<Rgb>,
}

impl Material {
    /// A material from a flat parameter vector.
    ///
    /// # Errors
    /// When the number of entries is wrong, or one lies outside its bounds.
    pub fn new(model: &'static dyn Model, parameters: Vec<f64>) -> Result<Self, ParameterError> {
        let (lower, upper) = flat_bounds(model.parameters());
        if parameters.len() != flat_len(model.parameters()) {
            return Err(ParameterError::Count { name: model.name(), expected: lower.len(), found: parameters.len() });
        }
        let owner = |entry: usize| {
            let name = &flat_names(model.parameters())[entry];
            model.parameters().iter().map(|p| p.name).find(|n| name.split('.').next() == Some(*n)).unwrap_or("")
        };
        for (entry, &found) in parameters.iter().enumerate() {
            if !(lower[entry]..=upper[entry]).contains(&found) {
                let (lower, upper) = (lower[entry], upper[entry]);
                return Err(ParameterError::OutOfBounds { name: owner(entry), found, lower, upper });
            }
        }
        let mut weights = vec![Rgb::ZERO; term_count(model)];
        model.weights(&parameters, &mut weights);
        Ok(Self { model, parameters, weights })
    }

    /// The model.
    #[must_use]
    pub fn model(&self) -> &'static dyn Model {
        self.model
    }

    /// The flat parameter vector.
    #[must_use]
    pub fn parameters(&self) -> &[f64] {
        &self.parameters
    }

    fn width(&self, basis: &BasisLobe) -> f64 {
        basis.width_at(&self.parameters).unwrap_or(0.0)
    }
}

impl Reflectance for Material {
    fn eval_cos(&self, wi_local: Vec3, wo_local: Vec3) -> Rgb {
        if wi_local.z <= 0.0 || wo_local.z <= 0.0 {
            return Rgb::ZERO;
        }
        let angles = Angles::new(Vec3::Z, wi_local, wo_local);
        let f5 = angles.f5();
        let (mut sum, mut term) = (Rgb::ZERO, 0);
        for basis in self.model.lobes() {
            let value = basis.lobe.eval(&angles, self.width(basis));
            if lobe_terms(basis.lobe) == 1 {
                sum += self.weights[term] * value;
            } else {
                sum += (self.weights[term] * (1.0 - f5) + self.weights[term + 1] * f5) * value;
            }
            term += lobe_terms(basis.lobe);
        }
        sum
    }

    fn sampling_alphas(&self) -> Vec<f64> {
        // All lobes as wide as the hemisphere share one technique.
        let mut has_wide = false;
        let alpha = |b: &BasisLobe| match b.lobe.equivalent_alpha(self.width(b)) {
            Some(alpha) => Some(alpha),
            None => (!std::mem::replace(&mut has_wide, true)).then_some(1.0),
        };
        self.model.lobes().iter().filter_map(alpha).collect()
    }
}
