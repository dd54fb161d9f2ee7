//! The settings of the method, with their defaults (design sections 1, 2 and 10).

use crate::{
    brdf::{MODELS, Model},
    render::subset::{SampleCount, Sampling},
};
use thiserror::Error;

/// How Eq. 1 is minimised.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SearchKind {
    /// Generalised pattern search, as in the paper.
    Pattern,
    /// Levenberg-Marquardt with bounds on analytic derivatives.
    LeastSquares,
}

/// How stage one renders its pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Integration {
    /// From a transport table, which is integrated once.
    Tables,
    /// By the direct integrator, for every evaluation, as in the paper.
    Direct {
        /// Samples per pixel.
        samples: u32,
    },
}

/// Where a search starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Start {
    /// The best points of a scan over widths (design section 2).
    Scan,
    /// The single start of the paper, [`Parameter::start`](crate::brdf::Parameter::start).
    Paper,
}

/// The function that Eq. 1 applies to radiance: the power `1/gamma` with a rule for values at and below zero, or an alternative for
/// studies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Compress {
    /// The power; below its knee, its tangent line.
    Tangent,
    /// The power of `max(x, 0)`, as in the paper.
    Clamp,
    /// The power of the radiance clamped to the range of a display, from 0 to `white`.
    ClampTo {
        /// The radiance of white, above 0.
        white: f64,
    },
    /// The logarithm [`Compression::logarithm`](crate::metric::cost::Compression::logarithm); gamma has no effect.
    Logarithm,
}

/// Which score selects and polishes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JudgedBy {
    /// CSSIM over the whole image, as in the paper.
    Image,
    /// CSSIM over windows centred on the object.
    Object,
}

/// The settings of a fit.
#[derive(Debug, Clone)]
pub struct Method {
    /// The BRDF model.
    pub model: &'static dyn Model,
    /// Gammas of stage one, ascending.
    pub gammas: Vec<f64>,
    /// Pixels of stage one.
    pub samples: SampleCount,
    /// How these pixels are drawn.
    pub sampling: Sampling,
    /// Independent subsets, at least 1.
    pub subsets: u32,
    /// How Eq. 1 is minimised.
    pub search: SearchKind,
    /// How stage one renders its pixels.
    pub integration: Integration,
    /// Where searches start.
    pub start: Start,
    /// The function that Eq. 1 applies to radiance.
    pub compress: Compress,
    /// Whether stage three runs.
    pub polish: bool,
    /// Which score selects and polishes.
    pub judge: JudgedBy,
    /// Seed of every random choice.
    pub seed: u64,
}

impl Default for Method {
    fn default() -> Self {
        Self {
            model: MODELS[0],
            gammas: (10..=30).map(|tenth| f64::from(tenth) / 10.0).collect(),
            samples: SampleCount::Draws(256),
            sampling: Sampling::Importance,
            subsets: 1,
            search: SearchKind::LeastSquares,
            integration: Integration::Tables,
            start: Start::Scan,
            compress: Compress::Tangent,
            polish: true,
            judge: JudgedBy::Image,
            seed: 0,
        }
    }
}

/// Most searches of one fit: their candidates are sent to stage two in one message.
pub const MOST_SEARCHES: usize = 5000;

/// What is wrong with a method.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum MethodError {
    /// Gammas must be positive and ascending.
    #[error("gammas must be positive, finite and ascending, found {found:?}")]
    Gammas {
        /// The values given.
        found: Vec<f64>,
    },
    /// No pixels.
    #[error("the number of samples must be at least 1, found 0; the paper uses 256")]
    NoSamples,
    /// No subsets.
    #[error("the number of subsets must be at least 1, found 0")]
    NoSubsets,
    /// All subsets would be the same.
    #[error("{subsets} subsets of all pixels would be equal: use 1 subset, or give a number of samples")]
    SameSubsets {
        /// The number of subsets.
        subsets: u32,
    },
    /// The direct integrator has no derivatives.
    #[error(
        "the direct integrator (--integrator direct) has no derivatives, which least squares needs: use --search pattern"
    )]
    NoDerivatives,
    /// Too many gammas times subsets.
    #[error(
        "{found} searches (gammas times subsets) are more than the limit of {MOST_SEARCHES}: use fewer gammas or subsets"
    )]
    TooManySearches {
        /// Gammas times subsets.
        found: usize,
    },
}

impl Method {
    /// Checks the settings that their types do not.
    ///
    /// # Errors
    /// Names the setting that is out of range.
    pub fn check(&self) -> Result<(), MethodError> {
        let ascending = self.gammas.windows(2).all(|w| w[0] < w[1]);
        let positive = self.gammas.iter().all(|g| g.is_finite() && *g > 0.0);
        if self.gammas.is_empty() || !ascending || !positive {
            return Err(MethodError::Gammas { found: self.gammas.clone() });
        }
        if self.samples == SampleCount::Draws(0) {
            return Err(MethodError::NoSamples);
        }
        if self.subsets == 0 {
            return Err(MethodError::NoSubsets);
        }
        if self.samples == SampleCount::Full && self.subsets > 1 {
            return Err(MethodError::SameSubsets { subsets: self.subsets });
        }
        if self.search == SearchKind::LeastSquares && self.integration != Integration::Tables {
            return Err(MethodError::NoDerivatives);
        }
        let searches = self.gammas.len() * self.subsets as usize;
        if searches > MOST_SEARCHES {
            return Err(MethodError::TooManySearches { found: searches });
        }
        Ok(())
    }
}

/// First and last gamma.
#[must_use]
pub fn gamma_range(gammas: &[f64]) -> Option<(f64, f64)> {
    Some((*gammas.first()?, *gammas.last()?))
}
