//! Settings of the program alone that are one of a few names. The comment of each name is its line in `--help`.

use clap::ValueEnum;

/// A colour-image-difference metric.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum MetricKind {
    /// CSSIM, single scale, five features
    #[default]
    Cssim,
    /// iCID
    Icid,
}

/// A named bundle of settings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Preset {
    /// The method of the paper, to the letter
    Paper,
}

/// How progress is shown, on stderr.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum ProgressKind {
    /// Bars on a terminal, a line per stage elsewhere
    #[default]
    Auto,
    /// A bar
    Bar,
    /// One JSON object a line
    Json,
    /// Nothing
    None,
}
