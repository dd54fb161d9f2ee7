//! Settings whose values are names that the program defines. The comment of each name is its line in `--help`.

use clap::ValueEnum;

/// A named bundle of settings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Preset {
    /// The paper's 256 samples, pattern search, 21 gammas and no polish; model, start and bounds are ours, because the paper names none
    Paper,
}

/// How progress is shown, on stderr.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum ProgressKind {
    /// Bars on a terminal, one line per stage elsewhere
    #[default]
    Auto,
    /// Bars, whatever stderr is
    Bar,
    /// One JSON object per line; docs/progress.md describes them
    Json,
    /// Nothing
    None,
}
