//! `--samples` of a fit: how many pixels stage one looks at.

use anyhow::Context;
use std::{fmt, num::NonZeroUsize, str::FromStr};

/// The pixels of stage one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Samples {
    /// So many independent draws, with replacement.
    Count(NonZeroUsize),
    /// Every usable pixel, weight 1.
    Full,
}

impl Default for Samples {
    /// 256, as in the paper.
    fn default() -> Self {
        Self::Count(const { NonZeroUsize::new(256).expect("256 is not 0") })
    }
}

impl FromStr for Samples {
    type Err = anyhow::Error;

    /// A whole number above 0, or `full`.
    fn from_str(text: &str) -> anyhow::Result<Self> {
        if text == "full" {
            return Ok(Self::Full);
        }
        text.parse().map(Self::Count).ok().context("expected a whole number above 0, or full")
    }
}

impl fmt::Display for Samples {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Count(count) => write!(f, "{count}"),
            Self::Full => write!(f, "full"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_are_a_count_or_everything() {
        assert_eq!("full".parse::<Samples>().unwrap(), Samples::Full);
        assert_eq!("256".parse::<Samples>().unwrap(), Samples::default());
        for text in ["0", "-1", "2.5", "all", ""] {
            assert!(text.parse::<Samples>().is_err(), "{text}");
        }
    }
}
