//! Settings that are one of a few names. The comment of each name is its line in `--help`.

use clap::ValueEnum;

/// How the directions of an environment map are laid out in its image (design section 3).
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum EnvMapping {
    /// Equirectangular, 2:1, image centre is +Z
    Latlong,
    /// Vertical cross of six faces, 3:4
    Cross,
    /// Debevec's angular map, 1:1
    Angular,
    /// A mirror sphere as this camera sees it, 1:1
    MirrorBall,
}

/// How the pixels of stage one are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum Sampling {
    /// In proportion to the photo's luminance, as in the paper
    #[default]
    Importance,
    /// As importance, with the draws stratified
    Stratified,
    /// All usable pixels alike
    Uniform,
}

/// How stage one minimises the cost.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum SearchKind {
    /// Levenberg-Marquardt from a scan of starts, several minima kept
    #[default]
    LeastSquares,
    /// Pattern search, as in the paper
    Pattern,
}

/// Which CSSIM score selects the winner and guides the polish.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum Judge {
    /// The mean over the whole image, as in the paper
    #[default]
    Image,
    /// The mean over the windows centred on the object
    Object,
}

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

/// Where the searches of stage one start. Not a flag of its own: `--preset paper` sets it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Start {
    /// From a scan of the model's width and of what multiplies other parameters.
    #[default]
    Scan,
    /// From the paper's one point: .3 in every parameter (20 in an exponent).
    Paper,
}

/// What `x^(1/gamma)` becomes near and below zero. Not a flag of its own: `--preset paper` sets it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum CompressAtZero {
    /// Its tangent line below 1e-6 of the photo's mean radiance.
    #[default]
    Tangent,
    /// That of max(x, 0).
    Clamp,
}
