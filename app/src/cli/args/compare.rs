//! `lookalike compare`.

use super::choice::choice;
use crate::settings::{CompareSettings, DisplayExposure};
use clap::Args;
use lookalike::metric::MetricKind;
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(args_override_self = true, after_long_help = EXAMPLES)]
pub(crate) struct CompareArgs {
    /// Reference image (.exr, .hdr, .tif, .png, .jpg)
    #[arg(value_name = "REFERENCE")]
    reference: PathBuf,
    /// Image to judge, of the same size
    #[arg(value_name = "IMAGE")]
    image: PathBuf,
    /// Image that is white where the object is; outside of it both images count as black
    #[arg(long, value_name = "FILE", help_heading = "Input")]
    mask: Option<PathBuf>,
    /// Metric of the difference; 0 is equal, larger is worse
    #[arg(long, value_name = "METRIC", value_parser = choice::<MetricKind>(), default_value_t, help_heading = "Method")]
    metric: MetricKind,
    /// Exposure of both images before the metric: auto (the 97th percentile of the reference's largest channel becomes 0.9),
    /// a factor, or from:FILE with the fit.json or an image of an earlier run
    #[arg(long, value_name = "E", default_value = "1", allow_negative_numbers = true, help_heading = "Method")]
    display_exposure: DisplayExposure,
    /// Write a map of the differences to this file (.png)
    #[arg(long, value_name = "OUT.png", help_heading = "Output")]
    map: Option<PathBuf>,
    /// Print the scores as JSON
    #[arg(long, help_heading = "Output")]
    json: bool,
}

impl CompareArgs {
    pub(crate) fn into_settings(self) -> CompareSettings {
        CompareSettings {
            reference: self.reference,
            image: self.image,
            mask: self.mask,
            map: self.map,
            metric: self.metric,
            display_exposure: self.display_exposure,
            json: self.json,
        }
    }
}

const EXAMPLES: &str = "\
Examples:
  lookalike compare run/reference.png run/match.png
  lookalike compare photo.exr rendering.exr --display-exposure auto --map difference.png --json";
