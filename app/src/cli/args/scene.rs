//! Flags of the scene: light, camera and shape, the object in the photo.

use super::finite;
use crate::settings::{CameraSpec, Circle, EnvMapping, EnvironmentSettings, ViewSettings};
use anyhow::bail;
use clap::Args;
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(next_help_heading = "Input")]
pub(crate) struct PhotoArgs {
    /// Photo of the object (.exr, .hdr, .png, .jpg), or a TOML file of settings
    #[arg(value_name = "PHOTO", help_heading = None)]
    pub(crate) photo: PathBuf,
    /// Image that is white where the photo shows the object [default: what the silhouette covers]
    #[arg(long, value_name = "FILE")]
    pub(crate) mask: Option<PathBuf>,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Input")]
pub(crate) struct EnvironmentArgs {
    /// Environment map of the light (.exr, .hdr), linear Rec. 709
    #[arg(long, value_name = "MAP")]
    env: PathBuf,
    /// Layout of the map [default: latlong if it is 2:1, cross if it is 3:4]
    #[arg(long, value_name = "MAPPING", value_enum)]
    env_mapping: Option<EnvMapping>,
    /// Turn the map about +Y, in degrees
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
    /// Projection: orthographic, or perspective:FOV_DEG with the vertical field of view in degrees
    #[arg(long, value_name = "CAMERA", default_value_t)]
    camera: CameraSpec,
    /// World-space unit normals (.exr) of a shape other than the built-in sphere; length 0 is background
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
pub(crate) struct SphereArgs {
    /// Centre and radius of the sphere in the photo, in pixels from its top left corner [default: fitted to the mask,
    /// else the inscribed circle]
    #[arg(long, value_name = "CX,CY,R", allow_hyphen_values = true)]
    pub(crate) sphere: Option<Circle>,
}

impl SphereArgs {
    /// Refuses a sphere beside a map of normals.
    pub(crate) fn check(&self, view: &ViewArgs) -> anyhow::Result<()> {
        if self.sphere.is_some() && view.normals.is_some() {
            bail!("--sphere places the built-in sphere, --normals replaces it; give one of them");
        }
        Ok(())
    }
}
