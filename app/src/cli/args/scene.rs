//! Flags of the scene: light, camera and shape, the object in the photo.

use super::choice::choice;
use crate::settings::{CaptureSettings, EnvironmentSettings, ViewSettings};
use anyhow::bail;
use clap::Args;
use lookalike::{
    light::Mapping,
    scene::{Camera, Circle},
};
use std::path::PathBuf;

/// A photo with its scene.
#[derive(Debug, Args)]
pub(crate) struct CaptureArgs {
    #[command(flatten)]
    photo: PhotoArgs,
    #[command(flatten)]
    environment: EnvironmentArgs,
    #[command(flatten)]
    view: ViewArgs,
    #[command(flatten)]
    sphere: SphereArgs,
}

impl CaptureArgs {
    pub(crate) fn into_settings(self) -> anyhow::Result<CaptureSettings> {
        let sphere = self.sphere.sphere;
        if sphere.is_some() && self.view.normals.is_some() {
            bail!("--sphere places the built-in sphere, --normals replaces it; give one of them");
        }
        Ok(CaptureSettings {
            photo: self.photo.photo,
            layer: self.photo.layer,
            mask: self.photo.mask,
            environment: self.environment.into_settings(),
            view: self.view.into_settings(),
            sphere,
        })
    }
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Input")]
struct PhotoArgs {
    /// Photo of the object (.exr, .hdr, .tif, .png, .jpg), or a TOML file of settings
    #[arg(value_name = "PHOTO", help_heading = None)]
    photo: PathBuf,
    /// Layer of an OpenEXR photo with several, such as beauty [default: unnamed, Combined, beauty, rgba]
    #[arg(long, value_name = "NAME")]
    layer: Option<String>,
    /// Image that is white where the photo shows the object [default: all of the silhouette]
    #[arg(long, value_name = "FILE")]
    mask: Option<PathBuf>,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Input")]
pub(crate) struct EnvironmentArgs {
    /// Environment map of the light, linear Rec. 709 (.exr, .hdr, .pfm)
    #[arg(long, value_name = "MAP")]
    env: PathBuf,
    /// Layout of the map; needed unless it is 2:1 or 3:4 [default: latlong if it is 2:1, cross if it is 3:4]
    #[arg(long, value_name = "MAPPING", value_parser = choice::<Mapping>())]
    env_mapping: Option<Mapping>,
    /// Turn the map about +Y, in degrees; 90 brings the light at +Z to +X
    #[arg(long, value_name = "DEG", default_value = "0", value_parser = finite, allow_negative_numbers = true)]
    env_rotation: f64,
}

impl EnvironmentArgs {
    pub(crate) fn into_settings(self) -> EnvironmentSettings {
        EnvironmentSettings { path: self.env, mapping: self.env_mapping, rotation_deg: self.env_rotation }
    }
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Geometry")]
pub(crate) struct ViewArgs {
    /// Projection: orthographic, or perspective:FOV_DEG with the vertical field of view of the whole photo in degrees, for
    /// example perspective:30
    #[arg(long, value_name = "CAMERA", default_value_t)]
    camera: Camera,
    /// World-space unit normals (.exr) of a shape other than the built-in sphere; length 0 marks the background
    #[arg(long, value_name = "FILE")]
    normals: Option<PathBuf>,
}

impl ViewArgs {
    pub(crate) fn into_settings(self) -> ViewSettings {
        ViewSettings { camera: self.camera, normals: self.normals }
    }
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Geometry")]
struct SphereArgs {
    /// Centre and radius of the sphere in the photo, in pixels from the top left corner, for example 128,128,100
    /// [default: fitted to the mask or to the photo's alpha channel, else the largest circle in the photo]
    #[arg(long, value_name = "CX,CY,R", allow_hyphen_values = true)]
    sphere: Option<Circle>,
}

/// Accepts a finite number.
fn finite(text: &str) -> anyhow::Result<f64> {
    match text.parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(number),
        _ => bail!("expected a finite number"),
    }
}
