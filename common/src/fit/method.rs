//! The settings of the method, with their defaults (design sections 1, 2 and 10).

use crate::{
    brdf::{DEFAULT_MODEL, Model},
    render::subset::{SampleCount, Sampling},
};
use thiserror::Error;

/// How Eq. 1 is minimised.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SearchKind {
    /// Generalised pattern search, the paper's.
    Pattern,
    /// Levenberg-Marquardt with bounds on analytic derivatives.
    LeastSquares,
}

/// How stage one renders its pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Integration {
    /// By a transport table, which is integrated once.
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
    /// The paper's one point, [`Parameter::start`](crate::brdf::Parameter::start).
    Paper,
}

/// What Eq. 1 compares: the power `1/gamma`, how it continues at and below zero, and what studies put in its place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Compress {
    /// Continues as its tangent line.
    Tangent,
    /// Of `max(x, 0)`, the paper's.
    Clamp,
    /// Of the radiance clamped to what a display shows, between 0 and this radiance.
    ClampTo {
        /// The radiance of white, above 0.
        white: f64,
    },
    /// Instead of a power, the logarithm [`Compression::logarithm`](crate::metric::cost::Compression::logarithm); gamma says nothing.
    Logarithm,
}

/// Which score selects and polishes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JudgedBy {
    /// CSSIM over the whole image, the paper's.
    Image,
    /// CSSIM over windows centred on the object.
    Object,
}

/// How to fit.
#[derive(Debug, Clone)]
pub struct Method {
    /// The BRDF model.
    pub model: &'static dyn Model,
    /// Exponents of stage one, ascending.
    pub gammas: Vec<f64>,
    /// Pixels of stage one.
    pub samples: SampleCount,
    /// How they are drawn.
    pub sampling: Sampling,
    /// Independent subsets, at least 1.
    pub subsets: u32,
    /// How Eq. 1 is minimised.
    pub search: SearchKind,
    /// How its pixels are rendered.
    pub integration: Integration,
    /// Where searches start.
    pub start: Start,
    /// What Eq. 1 compares.
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
            model: DEFAULT_MODEL,
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

/// Most searches of one fit: their candidates travel to stage two in one message.
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
    /// Nothing to draw.
    #[error("the number of samples must be at least 1, found 0; the paper uses 256")]
    NoSamples,
    /// Nothing to search.
    #[error("the number of subsets must be at least 1, found 0")]
    NoSubsets,
    /// All subsets would be the same.
    #[error(
        "all pixels taken {subsets} times are {subsets} times the same: leave out the subsets, or give a number of samples"
    )]
    SameSubsets {
        /// The number of subsets.
        subsets: u32,
    },
    /// The direct integrator gives no derivatives.
    #[error(
        "the direct integrator (--integrator direct) has no derivatives, which least squares needs: use --search pattern"
    )]
    NoDerivatives,
    /// Gammas times subsets.
    #[error("{found} searches (gammas times subsets) are more than the {MOST_SEARCHES} that one fit may have")]
    TooManySearches {
        /// Gammas times subsets.
        found: usize,
    },
}

impl Method {
    /// Checks what types cannot.
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
