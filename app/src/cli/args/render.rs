//! `lookalike render`.

use super::scene::{EnvironmentArgs, ViewArgs};
use crate::settings::{Material, ModelName, ModelParams, ModelParser, RenderSettings};
use anyhow::bail;
use clap::Args;
use std::{num::NonZeroUsize, path::PathBuf};

#[derive(Debug, Args)]
#[command(args_override_self = true, after_long_help = EXAMPLES)]
pub(crate) struct RenderArgs {
    #[command(flatten)]
    material: MaterialArgs,
    #[command(flatten)]
    environment: EnvironmentArgs,
    #[command(flatten)]
    view: ViewArgs,
    #[command(flatten)]
    quality: QualityArgs,
    #[command(flatten)]
    output: OutputArgs,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Input")]
struct MaterialArgs {
    /// Measured material in the file format of the MERL database, instead of --model
    #[arg(long, value_name = "FILE.binary")]
    brdf: Option<PathBuf>,
    /// BRDF model; needs --params
    #[arg(long, value_name = "NAME", value_parser = ModelParser)]
    model: Option<ModelName>,
    /// Parameters of the model: NAME=VALUE with one number, or three for a colour, such as kd=.5,.4,.3,f0=.04,alpha=.1; f90 is 1
    /// if not given
    #[arg(long, value_name = "K=V,...")]
    params: Option<ModelParams>,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Method")]
struct QualityArgs {
    /// Width and height of the image in pixels; with --normals, the image has the size of that map
    #[arg(long, value_name = "N", default_value = "256", allow_negative_numbers = true)]
    size: NonZeroUsize,
    /// Light directions per pixel; noise falls with their square root
    #[arg(long, value_name = "N", default_value = "1024", allow_negative_numbers = true)]
    samples: NonZeroUsize,
    /// Seed of the directions; the same inputs and seed give the same bits
    #[arg(long, value_name = "N", default_value_t = 0, allow_negative_numbers = true)]
    seed: u64,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Output")]
struct OutputArgs {
    /// Image to write: .exr (radiance, coverage, metadata), .pfm (radiance) or .png (for display, at automatic exposure)
    #[arg(long, short, value_name = "OUT.exr")]
    out: PathBuf,
}

impl RenderArgs {
    pub(crate) fn into_settings(self) -> anyhow::Result<RenderSettings> {
        Ok(RenderSettings {
            material: self.material.into_settings()?,
            environment: self.environment.into_settings(),
            view: self.view.into_settings(),
            size_px: self.quality.size,
            samples: self.quality.samples,
            seed: self.quality.seed,
            out: self.output.out,
        })
    }
}

impl MaterialArgs {
    fn into_settings(self) -> anyhow::Result<Material> {
        match (self.brdf, self.model, self.params) {
            (Some(path), None, None) => Ok(Material::Measured(path)),
            (None, Some(model), Some(params)) => Ok(Material::Analytic { model, params }),
            (None, Some(_), None) => bail!("--model needs --params, such as --params kd=.5,f0=.04,alpha=.1"),
            (None, None, Some(_)) => bail!("--params needs --model NAME"),
            (None, None, None) => bail!("no material; give --brdf FILE.binary, or --model NAME with --params"),
            (Some(_), ..) => bail!("two materials; give --brdf, or --model with --params, not both"),
        }
    }
}

const EXAMPLES: &str = "\
Examples:
  lookalike render --model ggx --params kd=.5,.1,.1,f0=.04,alpha=.1 --env garden.hdr -o red.exr
  lookalike render --brdf gold-metallic-paint.binary --env grace_cross.hdr --size 512 -o gold.exr";
