//! How good a match is, in words (design section 6).

use std::fmt;

/// How good a match is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verdict {
    /// Side by side, photo and match look the same.
    Indistinguishable,
    /// They look alike; differences show where one looks for them.
    Close,
    /// The same kind of material, with differences that anyone sees.
    VisibleDifference,
    /// Another material, or a photo that its map, camera or place of the object does not explain.
    NoMatch,
}

/// CSSIM over the object up to which a match is indistinguishable: less than 2 % of noise cost (.0064; 1 % costs .0016: design section 6).
pub const INDISTINGUISHABLE: f64 = 0.005;

/// Up to which it is close: what a circle costs that is off by 1.3 pixels, with all else right (.043).
pub const CLOSE: f64 = 0.04;

/// Up to which differences are visible: less than a fit under the map of another place reaches (.29; a map turned by 30 degrees: .52).
pub const VISIBLE: f64 = 0.25;

/// Noise may hide as much again as it costs, but no more than makes a match close: fine texture looks like noise.
const OF_NOISE: f64 = 2.0;

impl Verdict {
    /// The verdict on a CSSIM over the object. `noise_floor` is what the photo's noise alone costs.
    #[must_use]
    pub fn of(cssim_object: f64, noise_floor: f64) -> Self {
        match cssim_object {
            x if x <= INDISTINGUISHABLE.max(OF_NOISE * noise_floor).min(CLOSE) => Self::Indistinguishable,
            x if x <= CLOSE => Self::Close,
            x if x <= VISIBLE => Self::VisibleDifference,
            _ => Self::NoMatch,
        }
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Indistinguishable => "indistinguishable",
            Self::Close => "close",
            Self::VisibleDifference => "visible difference",
            Self::NoMatch => "no match",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn verdicts_follow_the_score_and_noise_hides_differences() {
        let of = |cssim: f64, floor: f64| Verdict::of(cssim, floor).to_string();
        assert_eq!(of(0.004, 0.0), "indistinguishable");
        assert_eq!((of(0.01, 0.0), of(0.01, 0.006)), ("close".to_owned(), "indistinguishable".to_owned()));
        assert_eq!(of(0.1, 0.2), "visible difference", "texture is not noise");
        assert_eq!((of(0.1, 0.0), of(0.3, 0.0)), ("visible difference".to_owned(), "no match".to_owned()));
        assert_eq!(of(f64::NAN, 0.0), "no match");
    }
}
