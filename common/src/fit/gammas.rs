//! The exponents of stage one (\[BP20b\] section 3 tries 1.0, 1.1, ..., 3.0).

use std::{fmt, str::FromStr};
use thiserror::Error;

/// An arithmetic sequence of gammas, both ends included where the step reaches them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gammas {
    start: f64,
    stop: f64,
    step: f64,
}

/// Why a sequence of gammas is invalid.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum GammasError {
    /// Not a sequence.
    #[error("expected START:STOP:STEP, such as 1:3:0.1, or one number")]
    Form,
    /// The first gamma is out of range.
    #[error("a gamma must lie between {SMALLEST_STEP} and {LARGEST}, found {found}")]
    Start {
        /// The first gamma.
        found: f64,
    },
    /// The last gamma is out of range.
    #[error("the last gamma must lie between the first ({start}) and {LARGEST}, found {found}")]
    Stop {
        /// The first gamma.
        start: f64,
        /// The last gamma.
        found: f64,
    },
    /// The step is too small or not finite.
    #[error("the step must be at least {SMALLEST_STEP}, found {found}")]
    Step {
        /// The step.
        found: f64,
    },
    /// Too many gammas.
    #[error("at most {MOST} gammas, found a step of {step} from {start} to {stop}")]
    TooMany {
        /// The first gamma.
        start: f64,
        /// The last gamma.
        stop: f64,
        /// The step.
        step: f64,
    },
}

impl Gammas {
    /// The 21 gammas of the paper.
    pub const DEFAULT: Self = Self { start: 1.0, stop: 3.0, step: 0.1 };

    /// The sequence from `start` to `stop` by `step`.
    ///
    /// # Errors
    /// If `start` is below 1e-6, `stop` lies below `start` or above 100, `step` is below 1e-6, or there would be more
    /// than 1000 of them.
    pub fn new(start: f64, stop: f64, step: f64) -> Result<Self, GammasError> {
        if !(SMALLEST_STEP..=LARGEST).contains(&start) {
            return Err(GammasError::Start { found: start });
        }
        if !(start..=LARGEST).contains(&stop) {
            return Err(GammasError::Stop { start, found: stop });
        }
        if !(step >= SMALLEST_STEP && step.is_finite()) {
            return Err(GammasError::Step { found: step });
        }
        if (stop - start) / step > (MOST - 1) as f64 {
            return Err(GammasError::TooMany { start, stop, step });
        }
        Ok(Self { start, stop, step })
    }

    /// The sequence of values that [`Self::values`] gave, up to the part of the range that its last step did not reach.
    ///
    /// Returns `None` for an empty list.
    #[must_use]
    pub fn of_values(values: &[f64]) -> Option<Self> {
        let (&start, &stop) = (values.first()?, values.last()?);
        let step = values.get(1).map_or(1.0, |second| ((second - start) * PER_UNIT).round() / PER_UNIT);
        Some(Self { start, stop, step })
    }

    /// The gammas, ascending: `start + i * step` rounded to the nearest multiple of 1e-9, so that each is the double
    /// nearest to its decimal (1.1 is `1.1`).
    #[must_use]
    pub fn values(&self) -> Vec<f64> {
        let value = |i: u32| ((self.start + f64::from(i) * self.step) * PER_UNIT).round() / PER_UNIT;
        (0..).map(value).take_while(|&gamma| gamma <= self.stop + SLACK).collect()
    }
}

impl Default for Gammas {
    fn default() -> Self {
        Self::DEFAULT
    }
}

impl FromStr for Gammas {
    type Err = GammasError;

    /// `START:STOP:STEP`, or one number for a single gamma.
    fn from_str(text: &str) -> Result<Self, GammasError> {
        let numbers: Option<Vec<f64>> = text.split(':').map(|part| part.trim().parse().ok()).collect();
        match numbers.ok_or(GammasError::Form)?[..] {
            [gamma] => Self::new(gamma, gamma, 1.0),
            [start, stop, step] => Self::new(start, stop, step),
            _ => Err(GammasError::Form),
        }
    }
}
impl fmt::Display for Gammas {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}:{}", self.start, self.stop, self.step)
    }
}

/// Gammas are rounded to 1 / `PER_UNIT`: an integer divided by a power of ten is the double nearest to that decimal.
const PER_UNIT: f64 = 1e9;
/// Half a rounding unit: accepts a last gamma that differs from `stop` by rounding, but not one that is a step above it.
const SLACK: f64 = 0.5e-9;
/// Far below any visible difference, and far above the rounding.
const SMALLEST_STEP: f64 = 1e-6;
/// x^(1/100) is nearly constant, so a larger gamma gives no other match.
const LARGEST: f64 = 100.0;
/// Each gamma is a search, a candidate and a full-resolution rendering.
const MOST: usize = 1000;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_is_the_papers_21_gammas_as_exact_decimals() {
        let decimals =
            [1.0, 1.1, 1.2, 1.3, 1.4, 1.5, 1.6, 1.7, 1.8, 1.9, 2.0, 2.1, 2.2, 2.3, 2.4, 2.5, 2.6, 2.7, 2.8, 2.9, 3.0];
        assert_eq!(Gammas::default().values(), decimals);
        assert_eq!("1:3:0.1".parse::<Gammas>().unwrap(), Gammas::default());
        assert_eq!(Gammas::default().to_string(), "1:3:0.1");
        assert_eq!(Gammas::of_values(&decimals), Some(Gammas::default()));
        assert_eq!(Gammas::of_values(&[]), None);
    }

    #[test]
    fn every_hundredth_is_the_nearest_double_too() {
        let values = "0.5:4:0.01".parse::<Gammas>().unwrap().values();
        assert_eq!(values.len(), 351);
        for (i, gamma) in values.iter().enumerate() {
            let hundredths = 50 + i;
            assert_eq!(*gamma, format!("{}.{:02}", hundredths / 100, hundredths % 100).parse::<f64>().unwrap());
        }
    }

    #[test]
    fn a_step_that_misses_the_end_stops_short_of_it() {
        assert_eq!("1:2:0.3".parse::<Gammas>().unwrap().values(), [1.0, 1.3, 1.6, 1.9]);
        assert_eq!("2.2".parse::<Gammas>().unwrap().values(), [2.2]);
    }

    #[test]
    fn senseless_ranges_are_refused() {
        for text in
            ["", "1:3", "3:1:0.1", "1:3:0", "1:3:-0.1", "0:3:0.1", "-1", "nan", "1:3:nan", "1:inf:1", "1:3:0.001"]
        {
            assert!(text.parse::<Gammas>().is_err(), "{text}");
        }
    }
}
