//! `--camera`: how the object was seen (design section 3).

use anyhow::{Context, bail};
use std::{fmt, str::FromStr};

/// The projection of the camera, which sits on +Z and looks along -Z.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum CameraSpec {
    /// Parallel rays along -Z.
    #[default]
    Orthographic,
    /// A pinhole whose distance follows from the silhouette.
    Perspective {
        /// Vertical field of view in degrees, in (0, 180).
        fov_deg: f64,
    },
}

impl FromStr for CameraSpec {
    type Err = anyhow::Error;

    /// `orthographic` or `perspective:FOV_DEG`.
    fn from_str(text: &str) -> anyhow::Result<Self> {
        if text == "orthographic" {
            return Ok(Self::Orthographic);
        }
        let Some(fov) = text.strip_prefix("perspective:") else {
            bail!("expected orthographic or perspective:FOV_DEG");
        };
        let fov_deg: f64 = fov.parse().ok().context("the field of view must be a number of degrees")?;
        if !(fov_deg > 0.0 && fov_deg < 180.0) {
            bail!("the vertical field of view must lie between 0 and 180 degrees, both excluded");
        }
        Ok(Self::Perspective { fov_deg })
    }
}

impl fmt::Display for CameraSpec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Orthographic => write!(f, "orthographic"),
            Self::Perspective { fov_deg } => write!(f, "perspective:{fov_deg}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cameras_survive_a_round_trip() {
        for text in ["orthographic", "perspective:35", "perspective:12.5"] {
            assert_eq!(text.parse::<CameraSpec>().unwrap().to_string(), text);
        }
    }

    #[test]
    fn impossible_fields_of_view_are_refused() {
        for text in
            ["perspective:0", "perspective:180", "perspective:nan", "perspective:wide", "perspective", "fisheye"]
        {
            assert!(text.parse::<CameraSpec>().is_err(), "{text}");
        }
    }
}
