//! Models whose weights are products of parameters and of their differences to 1. The weights and their derivatives are implemented once, here.

use super::{BasisLobe, Model, Parameter};
use crate::math::Rgb;
use std::fmt::Debug;

/// A factor of a weight. A `usize` is the first entry of a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Factor {
    /// A colour.
    Colour(usize),
    /// A scalar, the same in every channel.
    Scalar(usize),
    /// 1 minus a colour. The scan solves for the product of the weight's colour and this instead of the colour.
    RestOfColour(usize),
    /// 1 minus a scalar.
    RestOfScalar(usize),
}

impl Factor {
    /// The entry it depends on in channel `c`, and its derivative.
    const fn entry(self, c: usize) -> (usize, f64) {
        match self {
            Self::Colour(colour) => (colour + c, 1.0),
            Self::Scalar(scalar) => (scalar, 1.0),
            Self::RestOfColour(colour) => (colour + c, -1.0),
            Self::RestOfScalar(scalar) => (scalar, -1.0),
        }
    }

    fn at(self, p: &[f64], c: usize) -> f64 {
        let (entry, sign) = self.entry(c);
        if sign < 0.0 { 1.0 - p[entry] } else { p[entry] }
    }
}

/// The weight of one term as a function of the flat parameter vector: a product, 1 without factors.
pub type Weight = &'static [Factor];

/// A weight without some of its factors.
fn product(weight: Weight, p: &[f64], counts: impl Fn(usize, Factor) -> bool) -> Rgb {
    let channel = |c: usize| {
        let factors = weight.iter().enumerate().filter(|(i, factor)| counts(*i, **factor));
        factors.fold(1.0, |product, (_, factor)| product * factor.at(p, c))
    };
    Rgb::new(channel(0), channel(1), channel(2))
}

/// A model declared by constants. Its first term must be the diffuse lobe.
pub trait LinearModel: Debug + Sync {
    /// [`Model::name`].
    const NAME: &'static str;
    /// [`Model::summary`].
    const SUMMARY: &'static str;
    /// [`Model::parameters`].
    const PARAMETERS: &'static [Parameter];
    /// [`Model::lobes`].
    const LOBES: &'static [BasisLobe];
    /// The weight of every term, in the order of the terms.
    const WEIGHTS: &'static [Weight];
    /// The reflectance of all specular lobes at normal incidence; unless given, the weight of the second term.
    const SPECULAR: Weight = Self::WEIGHTS[1];
    /// Albedo of the diffuse lobe of weight 1 at normal incidence.
    const DIFFUSE_ALBEDO: f64 = 1.0;
    /// [`Model::remark`].
    const REMARK: Option<Remark> = None;
}

/// [`Model::remark`] of a model declared by constants.
pub type Remark = fn(&[f64], &dyn Fn(usize) -> bool) -> Option<String>;

impl<M: LinearModel> Model for M {
    fn name(&self) -> &'static str {
        M::NAME
    }

    fn summary(&self) -> &'static str {
        M::SUMMARY
    }

    fn parameters(&self) -> &'static [Parameter] {
        M::PARAMETERS
    }

    fn lobes(&self) -> &'static [BasisLobe] {
        M::LOBES
    }

    fn weights(&self, p: &[f64], weights: &mut [Rgb]) {
        debug_assert_eq!(weights.len(), M::WEIGHTS.len(), "{} has a weight for every term", M::NAME);
        weights.iter_mut().zip(M::WEIGHTS).for_each(|(weight, of)| *weight = product(of, p, |_, _| true));
    }

    fn weight_derivatives(&self, p: &[f64], push: &mut dyn FnMut(usize, usize, usize, f64)) {
        for (term, weight) in M::WEIGHTS.iter().enumerate() {
            for (i, factor) in weight.iter().enumerate() {
                let others = product(weight, p, |j, _| j != i);
                for c in 0..3 {
                    let (entry, derivative) = factor.entry(c);
                    push(term, c, entry, derivative * others[c]);
                }
            }
        }
    }

    fn scan_weights(&self, p: &[f64], weights: &mut [Rgb]) {
        let counts = |_, factor| !matches!(factor, Factor::RestOfColour(_));
        weights.iter_mut().zip(M::WEIGHTS).for_each(|(weight, of)| *weight = product(of, p, counts));
    }

    fn parameters_of_scan(&self, p: &mut [f64]) {
        for weight in M::WEIGHTS {
            let [Factor::Colour(colour), Factor::RestOfColour(other)] = **weight else { continue };
            for c in 0..3 {
                let rest = 1.0 - p[other + c];
                p[colour + c] = if p[colour + c] < rest { p[colour + c] / rest } else { 1.0 };
            }
        }
    }

    fn normal_incidence_specular(&self, p: &[f64]) -> Rgb {
        product(M::SPECULAR, p, |_, _| true)
    }

    fn diffuse_albedo(&self, p: &[f64]) -> Rgb {
        product(M::WEIGHTS[0], p, |_, _| true) * M::DIFFUSE_ALBEDO
    }

    fn remark(&self, p: &[f64], is_determined: &dyn Fn(usize) -> bool) -> Option<String> {
        M::REMARK.and_then(|remark| remark(p, is_determined))
    }
}
