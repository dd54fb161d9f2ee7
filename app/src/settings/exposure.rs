//! `--display-exposure`: the exposure of the display transform before the metric (design section 6).

use anyhow::{Context, bail};
use std::{
    fmt,
    path::{Path, PathBuf},
    str::FromStr,
};

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

impl DisplayExposure {
    /// The file that it reads, if any.
    #[must_use]
    pub fn file(&self) -> Option<&Path> {
        match self {
            Self::From(path) => Some(path),
            Self::Auto | Self::Value(_) => None,
        }
    }
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
}
