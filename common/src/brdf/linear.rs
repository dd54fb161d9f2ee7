//! Models whose weights are parameters or simple products of them. The weights and their derivatives are implemented once, here.

use super::{BasisLobe, Model, Parameter};
use crate::math::Rgb;
use std::fmt::Debug;

/// The weight of one term as a function of the flat parameter vector. A `usize` is the first entry of a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Weight {
    /// 1 in every channel.
    One,
    /// A colour.
    Colour(usize),
    /// A scalar, the same in every channel.
    Scalar(usize),
    /// A colour times a scalar.
    Scaled(usize, usize),
    /// The first colour times 1 minus the second. The scan solves for this product instead of the first colour.
    Remainder(usize, usize),
}

impl Weight {
    fn at(self, p: &[f64]) -> Rgb {
        let channel = |c: usize| match self {
            Self::One => 1.0,
            Self::Colour(colour) => p[colour + c],
            Self::Scalar(scalar) => p[scalar],
            Self::Scaled(colour, scalar) => p[colour + c] * p[scalar],
            Self::Remainder(colour, other) => p[colour + c] * (1.0 - p[other + c]),
        };
        Rgb::new(channel(0), channel(1), channel(2))
    }

    /// Calls `push(entry, derivative)` for every entry that the weight depends on in channel `c`.
    fn derivatives(self, p: &[f64], c: usize, mut push: impl FnMut(usize, f64)) {
        match self {
            Self::One => {}
            Self::Colour(colour) => push(colour + c, 1.0),
            Self::Scalar(scalar) => push(scalar, 1.0),
            Self::Scaled(colour, scalar) => {
                push(colour + c, p[scalar]);
                push(scalar, p[colour + c]);
            }
            Self::Remainder(colour, other) => {
                push(colour + c, 1.0 - p[other + c]);
                push(other + c, -p[colour + c]);
            }
        }
    }

    /// The weight in the coordinates of the scan.
    const fn of_scan(self) -> Self {
        match self {
            Self::Remainder(colour, _) => Self::Colour(colour),
            same => same,
        }
    }
}

/// A model declared by constants. Its first term must be the diffuse lobe, its second the specular lobe at normal incidence.
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
        weights.iter_mut().zip(M::WEIGHTS).for_each(|(weight, of)| *weight = of.at(p));
    }

    fn weight_derivatives(&self, p: &[f64], push: &mut dyn FnMut(usize, usize, usize, f64)) {
        for c in 0..3 {
            for (term, weight) in M::WEIGHTS.iter().enumerate() {
                weight.derivatives(p, c, |entry, value| push(term, c, entry, value));
            }
        }
    }

    fn scan_weights(&self, p: &[f64], weights: &mut [Rgb]) {
        weights.iter_mut().zip(M::WEIGHTS).for_each(|(weight, of)| *weight = of.of_scan().at(p));
    }

    fn parameters_of_scan(&self, p: &mut [f64]) {
        for weight in M::WEIGHTS {
            let Weight::Remainder(colour, other) = *weight else { continue };
            for c in 0..3 {
                let rest = 1.0 - p[other + c];
                p[colour + c] = if p[colour + c] < rest { p[colour + c] / rest } else { 1.0 };
            }
        }
    }

    fn normal_incidence_specular(&self, p: &[f64]) -> Rgb {
        M::WEIGHTS[1].at(p)
    }

    fn diffuse_albedo(&self, p: &[f64]) -> Rgb {
        M::WEIGHTS[0].at(p) * M::DIFFUSE_ALBEDO
    }

    fn remark(&self, p: &[f64], is_determined: &dyn Fn(usize) -> bool) -> Option<String> {
        M::REMARK.and_then(|remark| remark(p, is_determined))
    }
}
