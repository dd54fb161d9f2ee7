//! Flags of the method.

use super::super::preset;
use crate::settings::{
    DisplayExposure, Gammas, Integrator, Judge, MethodSettings, ModelName, Preset, Samples, Sampling, SearchKind,
};
use clap::{Args, ValueEnum};
use std::num::NonZeroUsize;

#[derive(Debug, Args)]
#[command(next_help_heading = "Method")]
pub(crate) struct MethodArgs {
    /// A bundle of settings; flags given as well win over it. paper: the papers' model, 256 samples, pattern search from the
    /// papers' one start, 21 gammas, no polish
    #[arg(long, value_name = "PRESET", value_enum)]
    pub(crate) preset: Option<Preset>,
    /// BRDF model
    #[arg(long, value_name = "NAME", value_enum, default_value_t)]
    model: ModelName,
    /// Exponents of the cost that are tried: START:STOP:STEP, or one number
    #[arg(long, value_name = "A:B:STEP", default_value_t, allow_negative_numbers = true)]
    gammas: Gammas,
    /// Pixels that the searches look at: a number of draws, or full
    #[arg(long, value_name = "N|full", default_value_t, allow_negative_numbers = true)]
    samples: Samples,
    /// How these pixels are drawn
    #[arg(long, value_name = "SAMPLING", value_enum, default_value_t)]
    sampling: Sampling,
    /// Independent subsets of pixels to search; more candidates for proportionally more time
    #[arg(long, value_name = "K", default_value = "1", allow_negative_numbers = true)]
    subsets: NonZeroUsize,
    /// How the cost is minimised
    #[arg(long, value_name = "SEARCH", value_enum, default_value_t)]
    search: SearchKind,
    /// How the searches render their pixels: by transport tables, or direct[:SAMPLES], by Monte Carlo integration in every
    /// evaluation as in the paper, which takes thousands of times longer and needs --search pattern
    #[arg(long, value_name = "INTEGRATOR", default_value_t)]
    integrator: Integrator,
    /// Whether the winner is refined on the metric itself; its result is reported apart
    #[arg(long, value_name = "on|off", value_enum, default_value_t = Switch::On)]
    polish: Switch,
    /// Which CSSIM selects and polishes
    #[arg(long, value_name = "JUDGE", value_enum, default_value_t)]
    judge: Judge,
    /// Exposure before the metric: auto (97th percentile of the object's largest channel to 0.9), a factor, or from:FILE
    #[arg(long, value_name = "E", default_value = "auto", allow_negative_numbers = true)]
    pub(crate) display_exposure: DisplayExposure,
    /// Seed of every random choice; the same inputs and seed give the same bits
    #[arg(long, value_name = "N", default_value_t = 0, allow_negative_numbers = true)]
    seed: u64,
}

impl MethodArgs {
    pub(crate) fn into_settings(self) -> MethodSettings {
        MethodSettings {
            preset: self.preset,
            model: self.model,
            gammas: self.gammas,
            samples: self.samples,
            sampling: self.sampling,
            subsets: self.subsets,
            search: self.search,
            integrator: self.integrator,
            start: preset::start(self.preset),
            compress_at_zero: preset::compress_at_zero(self.preset),
            polish: matches!(self.polish, Switch::On),
            judge: self.judge,
            seed: self.seed,
        }
    }
}

/// A flag that takes on or off, so that a later flag can undo an earlier one.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum Switch {
    On,
    Off,
}
