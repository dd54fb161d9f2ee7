//! `--gammas`: the exponents of stage one (\[BP20b\] section 3 tries 1.0, 1.1, ..., 3.0).

use anyhow::{Context, bail};
use std::{fmt, str::FromStr};

/// An arithmetic sequence of gammas, both ends included where the step reaches them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gammas {
    start: f64,
    stop: f64,
    step: f64,
}

impl Gammas {
    /// The sequence from `start` to `stop` by `step`.
    ///
    /// # Errors
    /// If `start` is below 1e-6, `stop` lies below `start` or above 100, `step` is below 1e-6, or there would be more
    /// than 1000 of them.
    pub fn new(start: f64, stop: f64, step: f64) -> anyhow::Result<Self> {
        if !(SMALLEST_STEP..=LARGEST).contains(&start) {
            bail!("a gamma must lie between {SMALLEST_STEP} and {LARGEST}, found {start}");
        }
        if !(start..=LARGEST).contains(&stop) {
            bail!("the last gamma must lie between the first ({start}) and {LARGEST}, found {stop}");
        }
        if !(step >= SMALLEST_STEP && step.is_finite()) {
            bail!("the step must be at least {SMALLEST_STEP}, found {step}");
        }
        if (stop - start) / step > (MOST - 1) as f64 {
            bail!("at most {MOST} gammas, found a step of {step} from {start} to {stop}");
        }
        Ok(Self { start, stop, step })
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
    /// The 21 gammas of the paper.
    fn default() -> Self {
        Self { start: 1.0, stop: 3.0, step: 0.1 }
    }
}

impl FromStr for Gammas {
    type Err = anyhow::Error;

    /// `START:STOP:STEP`, or one number for a single gamma.
    fn from_str(text: &str) -> anyhow::Result<Self> {
        let numbers: Option<Vec<f64>> = text.split(':').map(|part| part.trim().parse().ok()).collect();
        match numbers.context("expected START:STOP:STEP, such as 1:3:0.1, or one number")?[..] {
            [gamma] => Self::new(gamma, gamma, 1.0),
            [start, stop, step] => Self::new(start, stop, step),
            _ => bail!("expected START:STOP:STEP, such as 1:3:0.1, or one number"),
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
/// Half a rounding unit: admits a last gamma that equals `stop` but for rounding, never one a step beyond.
const SLACK: f64 = 0.5e-9;
/// Far below any difference that shows, far above the rounding.
const SMALLEST_STEP: f64 = 1e-6;
/// x^(1/100) is flat for every purpose.
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
