//! The settings of the method, with their defaults (design sections 1, 2 and 10).

use super::{gammas::Gammas, ranges::Ranges};
use crate::{
    brdf::{DEFAULT_MODEL, Model},
    choice::choice,
    render::subset::{SampleCount, Sampling},
};
use serde_json::{Value, json};
use std::{fmt, str::FromStr};
use thiserror::Error;

/// The search that minimises Eq. 1.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum SearchKind {
    /// Generalised pattern search, as in the paper.
    Pattern,
    /// Levenberg-Marquardt with bounds on analytic derivatives.
    #[default]
    LeastSquares,
}

choice! { SearchKind:
    LeastSquares = "least-squares", "Levenberg-Marquardt from the best points of a scan; several minima are kept";
    Pattern = "pattern", "Pattern search, as in the paper";
}

/// How stage one renders its pixels.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Integration {
    /// From a transport table, which is integrated once.
    #[default]
    Tables,
    /// By the direct integrator, for every evaluation, as in the paper.
    Direct {
        /// Samples per pixel.
        samples: u32,
    },
}

/// The text does not name an [`Integration`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("expected tables, direct or direct:SAMPLES with 1 to {MOST_SAMPLES} samples per pixel")]
pub struct UnknownIntegration;

/// Samples per pixel of `direct` without a number.
const DIRECT_SAMPLES: u32 = 256;

/// The most samples per pixel that `direct:SAMPLES` accepts.
const MOST_SAMPLES: u32 = 1 << 20;

impl FromStr for Integration {
    type Err = UnknownIntegration;

    /// `tables`, `direct`, or `direct:SAMPLES`.
    fn from_str(text: &str) -> Result<Self, UnknownIntegration> {
        match text.split_once(':') {
            None if text == "tables" => Ok(Self::Tables),
            None if text == "direct" => Ok(Self::Direct { samples: DIRECT_SAMPLES }),
            Some(("direct", samples)) => match samples.parse() {
                Ok(samples @ 1..=MOST_SAMPLES) => Ok(Self::Direct { samples }),
                _ => Err(UnknownIntegration),
            },
            _ => Err(UnknownIntegration),
        }
    }
}

impl fmt::Display for Integration {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Tables => write!(f, "tables"),
            Self::Direct { samples } => write!(f, "direct:{samples}"),
        }
    }
}

/// Where a search starts.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Start {
    /// The best points of a scan over widths (design section 2).
    #[default]
    Scan,
    /// The single start of the paper, [`Parameter::start`](crate::brdf::Parameter::start).
    Paper,
}

/// The function that Eq. 1 applies to radiance before it compares: the power `1/gamma`, which needs a rule at and below zero, or a
/// function that studies compare with it.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub enum Compress {
    /// The power; below a small radiance, the knee, its tangent.
    #[default]
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

/// The score by which stage two selects and stage three polishes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum JudgedBy {
    /// CSSIM over the whole image, as in the paper.
    #[default]
    Image,
    /// CSSIM over windows centred on the object.
    Object,
}

choice! { JudgedBy:
    Image = "image", "The mean over the whole image, as in the paper";
    Object = "object", "The mean over the windows centred on the object";
}

/// The settings of a fit.
#[derive(Debug, Clone)]
pub struct Method {
    /// The BRDF model.
    pub model: &'static dyn Model,
    /// The parameters of it that are held or have a narrower range.
    pub ranges: Ranges,
    /// Gammas of stage one, ascending.
    pub gammas: Vec<f64>,
    /// Pixels of stage one.
    pub samples: SampleCount,
    /// The distribution from which they are drawn.
    pub sampling: Sampling,
    /// The number of independent pixel subsets, at least 1.
    pub subsets: u32,
    /// The search that minimises Eq. 1.
    pub search: SearchKind,
    /// How stage one renders its pixels.
    pub integration: Integration,
    /// Where searches start.
    pub start: Start,
    /// The function that Eq. 1 applies to radiance.
    pub compress: Compress,
    /// Whether stage three runs.
    pub polish: bool,
    /// The score by which stage two selects and stage three polishes.
    pub judge: JudgedBy,
    /// Seed of every random choice.
    pub seed: u64,
}

impl Default for Method {
    fn default() -> Self {
        Self {
            model: DEFAULT_MODEL,
            ranges: Ranges::default(),
            gammas: Gammas::DEFAULT.values(),
            samples: SampleCount::default(),
            sampling: Sampling::default(),
            subsets: 1,
            search: SearchKind::default(),
            integration: Integration::default(),
            start: Start::default(),
            compress: Compress::default(),
            polish: true,
            judge: JudgedBy::default(),
            seed: 0,
        }
    }
}

/// The most searches of one fit: their candidates are sent to stage two in one message.
pub const MOST_SEARCHES: usize = 5000;

/// An invalid setting of the method.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum MethodError {
    /// The gammas are not positive and ascending.
    #[error("gammas must be positive, finite and ascending, found {found:?}")]
    Gammas {
        /// The values given.
        found: Vec<f64>,
    },
    /// The number of samples is 0.
    #[error("the number of samples must be at least 1, found 0; the paper uses 256")]
    NoSamples,
    /// The number of subsets is 0.
    #[error("the number of subsets must be at least 1, found 0")]
    NoSubsets,
    /// No parameter is free.
    #[error("--fix holds all parameters of {model}, so there is nothing to find: use lookalike render and compare")]
    NothingFree {
        /// The model.
        model: &'static str,
    },
    /// Several subsets of all pixels.
    #[error("{subsets} subsets of all pixels would be equal: use 1 subset, or give a number of samples")]
    SameSubsets {
        /// The number of subsets.
        subsets: u32,
    },
    /// Least squares with the direct integrator, which has no derivatives.
    #[error(
        "the direct integrator (--integrator direct) has no derivatives, which least squares needs: use --search pattern"
    )]
    NoDerivatives,
    /// More than [`MOST_SEARCHES`] gammas times subsets.
    #[error(
        "{found} searches (gammas times subsets) are more than the limit of {MOST_SEARCHES}: use fewer gammas or subsets"
    )]
    TooManySearches {
        /// Gammas times subsets.
        found: usize,
    },
}

impl Method {
    /// Checks the settings that their types do not check.
    ///
    /// # Errors
    /// Names the setting that is out of range.
    pub fn check(&self) -> Result<(), MethodError> {
        let ascending = self.gammas.windows(2).all(|w| w[0] < w[1]);
        let positive = self.gammas.iter().all(|g| g.is_finite() && *g > 0.0);
        if self.gammas.is_empty() || !ascending || !positive {
            return Err(MethodError::Gammas { found: self.gammas.clone() });
        }
        if self.ranges.holds_everything(self.model) {
            return Err(MethodError::NothingFree { model: self.model.name() });
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

/// One setting of a method, for outputs.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    /// Its flag, or a description if no flag sets it alone. It is part of the identity of a run, which `--resume` compares.
    pub flag: &'static str,
    /// Its value in words.
    pub text: String,
    /// Its name and value in `fit.json`, if it is there.
    pub field: Option<(&'static str, Value)>,
}

impl Setting {
    fn new(flag: &'static str, field: &'static str, value: Value) -> Self {
        let text = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        Self { flag, text, field: Some((field, value)) }
    }
}

impl Method {
    /// Every setting, in the order of `fit.json`: the one list for `fit.json` and for the identity of a run.
    #[must_use]
    pub fn settings(&self) -> Vec<Setting> {
        // Without `..`: a new field has to be listed.
        let Self {
            model,
            ranges,
            gammas,
            samples,
            sampling,
            subsets,
            search,
            integration,
            start,
            compress,
            polish,
            judge,
            seed,
        } = self;
        let samples = match samples {
            SampleCount::Draws(draws) => json!(draws),
            SampleCount::Full => json!("full"),
        };
        let sequence = Gammas::of_values(gammas).map_or_else(String::new, |gammas| gammas.to_string());
        let polish = if *polish { "on" } else { "off" };
        let named = |choice: &dyn fmt::Debug| json!(format!("{choice:?}").to_lowercase());
        vec![
            Setting::new("--model", "model", json!(model.name())),
            Setting::new("--fix", "fixed", ranges.held()),
            Setting::new("--bounds", "bounds", ranges.narrowed()),
            Setting::new("--samples", "samples", samples),
            Setting::new("--sampling", "sampling", json!(sampling.to_string())),
            Setting::new("--subsets", "subsets", json!(subsets)),
            Setting::new("--seed", "seed", json!(seed)),
            Setting::new("--search", "search", json!(search.to_string())),
            Setting::new("--integrator", "integrator", json!(integration.to_string())),
            Setting::new("the start of the searches (--preset)", "start", named(start)),
            Setting::new("compression at zero (--preset)", "at_zero", named(compress)),
            Setting { text: sequence, ..Setting::new("--gammas", "gammas", json!(gammas)) },
            Setting { flag: "--polish", text: polish.to_owned(), field: None },
            Setting::new("--judge", "judge", json!(judge.to_string())),
        ]
    }
}

/// First and last gamma.
#[must_use]
pub fn gamma_range(gammas: &[f64]) -> Option<(f64, f64)> {
    Some((*gammas.first()?, *gammas.last()?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{choice::Choice, light::Mapping};
    use std::error::Error;

    fn names_round_trip<T: Choice + fmt::Display + FromStr<Err: Error>>() {
        for (value, name, _) in T::TABLE {
            assert_eq!(value.to_string(), *name);
            assert_eq!(name.parse::<T>().unwrap().to_string(), *name);
        }
        let error = T::from_str("no-such-name").err().unwrap().to_string();
        assert!(T::TABLE.iter().all(|(_, name, _)| error.contains(name)), "{error}");
    }

    #[test]
    fn choices_parse_what_they_print_and_errors_list_the_names() {
        names_round_trip::<SearchKind>();
        names_round_trip::<JudgedBy>();
        names_round_trip::<Sampling>();
        names_round_trip::<Mapping>();
    }

    #[test]
    fn integrators_are_tables_or_direct_with_samples() {
        let parse = |text: &str| text.parse::<Integration>();
        assert_eq!(parse("tables").unwrap(), Integration::default());
        assert_eq!(parse("direct").unwrap(), parse("direct:256").unwrap());
        assert_eq!(parse("direct:32").unwrap().to_string(), "direct:32");
        for text in ["", "table", "direct:", "direct:0", "direct:-1", "direct:1e3", "direct:4294967296", "tables:3"] {
            assert!(parse(text).is_err(), "{text}");
        }
    }
}
