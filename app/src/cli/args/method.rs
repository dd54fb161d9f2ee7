//! Flags of the method.

use super::{super::preset, choice::choice};
use crate::settings::{DisplayExposure, FitModels, FitModelsParser, ModelBounds, ModelName, ModelParams, Preset};
use anyhow::Context;
use clap::{Args, ValueEnum};
use lookalike::{
    brdf::{DEFAULT_MODEL, Model},
    fit::{Gammas, Integration, JudgedBy, Method, Methods, Ranges, SearchKind},
    render::subset::{SampleCount, Sampling},
};
use std::num::NonZeroU32;

#[derive(Debug, Args)]
#[command(next_help_heading = "Method")]
pub(crate) struct MethodArgs {
    /// Set of settings; other flags override it. paper: the published method, with Cook-Torrance, 256 samples, pattern search
    /// from one start, 21 gammas, no polish
    #[arg(long, value_name = "PRESET", value_enum)]
    pub(crate) preset: Option<Preset>,
    /// BRDF model: auto, one name, or several separated by commas, from simple to rich: the simplest one that matches as well as the
    /// best is kept
    #[arg(long, value_name = "NAME[,..]", value_parser = FitModelsParser, default_value_t = FitModels::Auto)]
    model: FitModels,
    /// Hold parameters of the model at these values, such as f90=1 or kd=0,f0=.04; a colour takes one number or three
    #[arg(long, value_name = "NAME=V[,..]")]
    fix: Option<ModelParams>,
    /// Search parameters of the model in a narrower range, such as alpha=.05:.3,kd=0:.5
    #[arg(long, value_name = "NAME=LO:HI")]
    bounds: Option<ModelBounds>,
    /// Gammas of the cost to try, one search each: START:STOP:STEP, or one number
    #[arg(long, value_name = "A:B:STEP", default_value_t, allow_negative_numbers = true)]
    gammas: Gammas,
    /// Pixels that the searches compare: a number of random draws, or full for all usable pixels
    #[arg(long, value_name = "N|full", default_value_t, allow_negative_numbers = true)]
    samples: SampleCount,
    /// Distribution from which these pixels are drawn
    #[arg(long, value_name = "SAMPLING", value_parser = choice::<Sampling>(), default_value_t)]
    sampling: Sampling,
    /// Number of independent pixel subsets to search; candidates and time grow in proportion
    #[arg(long, value_name = "K", default_value = "1", allow_negative_numbers = true)]
    subsets: NonZeroU32,
    /// Search that minimises the cost
    #[arg(long, value_name = "SEARCH", value_parser = choice::<SearchKind>(), default_value_t)]
    search: SearchKind,
    /// How the searches render their pixels: tables, or direct[:SAMPLES] to integrate every evaluation as in the paper (256
    /// samples per pixel if not given), which takes thousands of times longer and needs --search pattern
    #[arg(long, value_name = "INTEGRATOR", default_value_t)]
    integrator: Integration,
    /// Whether to refine the winner on CSSIM itself; the result before that is reported too
    #[arg(long, value_name = "on|off", value_enum, default_value_t = Switch::On)]
    polish: Switch,
    /// Which CSSIM selects the winner and guides the polish
    #[arg(long, value_name = "JUDGE", value_parser = choice::<JudgedBy>(), default_value_t)]
    judge: JudgedBy,
    /// Exposure of both images before the metric: auto (the 97th percentile of the object's largest channel becomes 0.9), a
    /// factor, or from:FILE with the fit.json or an image of an earlier run
    #[arg(long, value_name = "E", default_value = "auto", allow_negative_numbers = true)]
    pub(crate) display_exposure: DisplayExposure,
    /// Seed of every random choice; the same inputs and seed give the same bits
    #[arg(long, value_name = "N", default_value_t = 0, allow_negative_numbers = true)]
    seed: u64,
}

impl MethodArgs {
    /// # Errors
    /// If the model has no parameter of a name in `--fix` or `--bounds`, or a value is outside its range.
    pub(crate) fn into_methods(self) -> anyhow::Result<Methods> {
        let models = match &self.model {
            FitModels::Auto => Methods::auto(&self.ranges(DEFAULT_MODEL)?).context("--model auto")?,
            FitModels::List(models) => {
                let model = |name: &ModelName| Ok((name.model(), self.ranges(name.model())?));
                models.iter().map(model).collect::<anyhow::Result<_>>()?
            }
        };
        let method = Method {
            model: DEFAULT_MODEL,
            ranges: Ranges::default(),
            gammas: self.gammas.values(),
            samples: self.samples,
            sampling: self.sampling,
            subsets: self.subsets.get(),
            search: self.search,
            integration: self.integrator,
            start: preset::start(self.preset),
            compress: preset::compress(self.preset),
            polish: matches!(self.polish, Switch::On),
            judge: self.judge,
            seed: self.seed,
        };
        Ok(Methods::new(method, models))
    }

    /// The ranges of `--fix` and `--bounds` for a model.
    fn ranges(&self, model: &dyn Model) -> anyhow::Result<Ranges> {
        let mut ranges = Ranges::default();
        for (name, values) in self.fix.iter().flat_map(ModelParams::entries) {
            ranges.hold(model, name, values).with_context(|| format!("--fix {name}"))?;
        }
        for (name, lower, upper) in self.bounds.iter().flat_map(ModelBounds::entries) {
            ranges.narrow(model, name, *lower, *upper).with_context(|| format!("--bounds {name}"))?;
        }
        Ok(ranges)
    }
}

/// A flag that takes on or off, so that a later flag can undo an earlier one.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum Switch {
    On,
    Off,
}
