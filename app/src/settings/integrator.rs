//! `--integrator` of a fit: how its searches render their pixels.

use anyhow::Context;
use std::{fmt, num::NonZeroU32, str::FromStr};

/// How searches render their pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Integrator {
    /// By transport tables.
    #[default]
    Tables,
    /// By Monte Carlo integration in every evaluation, with so many samples per pixel.
    Direct(NonZeroU32),
}

/// Samples per pixel of `direct` unless it says how many.
const DIRECT_SAMPLES: NonZeroU32 = NonZeroU32::new(256).expect("256 is not 0");

/// Most samples per pixel.
const MOST_SAMPLES: u32 = 1 << 20;

impl FromStr for Integrator {
    type Err = anyhow::Error;

    /// `tables`, `direct`, or `direct:SAMPLES`.
    fn from_str(text: &str) -> anyhow::Result<Self> {
        match text.split_once(':') {
            None if text == "tables" => Ok(Self::Tables),
            None if text == "direct" => Ok(Self::Direct(DIRECT_SAMPLES)),
            Some(("direct", samples)) => samples
                .parse()
                .ok()
                .filter(|samples: &NonZeroU32| samples.get() <= MOST_SAMPLES)
                .map(Self::Direct)
                .with_context(|| format!("expected 1 to {MOST_SAMPLES} samples per pixel after direct:")),
            _ => Err(anyhow::anyhow!("expected tables, direct or direct:SAMPLES")),
        }
    }
}

impl fmt::Display for Integrator {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Tables => write!(f, "tables"),
            Self::Direct(samples) => write!(f, "direct:{samples}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integrators_are_tables_or_direct_with_samples() {
        let parse = |text: &str| text.parse::<Integrator>();
        assert_eq!(parse("tables").unwrap(), Integrator::default());
        assert_eq!(parse("direct").unwrap(), parse("direct:256").unwrap());
        assert_eq!(parse("direct:32").unwrap().to_string(), "direct:32");
        for text in ["", "table", "direct:", "direct:0", "direct:-1", "direct:1e3", "direct:4294967296", "tables:3"] {
            assert!(parse(text).is_err(), "{text}");
        }
    }
}
