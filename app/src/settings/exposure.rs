//! Exposure: of the display transform before the metric (design section 6), and the gain between photo and map
//! (design section 3).

use anyhow::{Context, bail};
use std::{fmt, path::PathBuf, str::FromStr};

/// The factor that radiance is multiplied by before it is shown or scored, the same for both images.
#[derive(Debug, Clone, PartialEq)]
pub enum DisplayExposure {
    /// Brings the 97th percentile of the photo's largest channel over the object to 0.9.
    Auto,
    /// This factor, above 0.
    Value(f64),
    /// The factor stored in a `fit.json` or in the metadata of an image of an earlier run.
    From(PathBuf),
}

impl FromStr for DisplayExposure {
    type Err = anyhow::Error;

    /// `auto`, a number above 0, or `from:FILE`.
    fn from_str(text: &str) -> anyhow::Result<Self> {
        if text == "auto" {
            return Ok(Self::Auto);
        }
        if let Some(path) = text.strip_prefix(Self::FROM) {
            if path.is_empty() {
                bail!("from: must be followed by the path of a fit.json or an image of an earlier run");
            }
            return Ok(Self::From(path.into()));
        }
        let value: f64 = text.parse().ok().context("expected auto, a number above 0, or from:FILE")?;
        if !(value > 0.0 && value.is_finite()) {
            bail!("an exposure must be a number above 0");
        }
        Ok(Self::Value(value))
    }
}

impl DisplayExposure {
    /// What precedes the path in the text form of [`DisplayExposure::From`].
    pub const FROM: &'static str = "from:";
}

impl fmt::Display for DisplayExposure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Auto => write!(f, "auto"),
            Self::Value(value) => write!(f, "{value}"),
            Self::From(path) => write!(f, "{}{}", Self::FROM, path.display()),
        }
    }
}

/// Whether a gain between the photo and the environment map is fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, clap::ValueEnum)]
pub enum GainKind {
    /// Photo and map share one exposure.
    #[default]
    None,
    /// One factor for all channels.
    Scalar,
    /// One factor per channel.
    Rgb,
}

/// What pins the gain down: a gain is degenerate with the colours of a model that is linear in them.
#[derive(Debug, Clone, PartialEq)]
pub enum Anchor {
    /// The reflectance at normal incidence is known, in (0, 1].
    F0(f64),
    /// The gain is the smallest with which the material's albedo stays at or below 1.
    AlbedoAtMostOne,
    /// A photo of a grey ball taken under the same light.
    GreyBall(PathBuf),
}

impl FromStr for Anchor {
    type Err = anyhow::Error;

    /// `f0=VALUE`, `albedo<=1`, or a path.
    fn from_str(text: &str) -> anyhow::Result<Self> {
        if text == "albedo<=1" {
            return Ok(Self::AlbedoAtMostOne);
        }
        let Some(value) = text.strip_prefix("f0=") else {
            if text.is_empty() {
                bail!("expected f0=VALUE, albedo<=1 or a photo of a grey ball");
            }
            return Ok(Self::GreyBall(text.into()));
        };
        let f0: f64 = value.parse().ok().context("f0 must be a number")?;
        if !(f0 > 0.0 && f0 <= 1.0) {
            bail!("f0 must lie above 0 and at or below 1");
        }
        Ok(Self::F0(f0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn display_exposures_survive_a_round_trip() {
        for text in ["auto", "1", "1.7", "from:run/fit.json"] {
            assert_eq!(text.parse::<DisplayExposure>().unwrap().to_string(), text);
        }
        for text in ["0", "-1", "inf", "nan", "from:", "bright", ""] {
            assert!(text.parse::<DisplayExposure>().is_err(), "{text}");
        }
    }

    #[test]
    fn anchors_are_a_reflectance_a_bound_or_a_grey_ball() {
        assert_eq!("f0=0.04".parse::<Anchor>().unwrap(), Anchor::F0(0.04));
        assert_eq!("albedo<=1".parse::<Anchor>().unwrap(), Anchor::AlbedoAtMostOne);
        assert_eq!("grey.exr".parse::<Anchor>().unwrap(), Anchor::GreyBall("grey.exr".into()));
        for text in ["f0=0", "f0=2", "f0=", ""] {
            assert!(text.parse::<Anchor>().is_err(), "{text}");
        }
    }
}
