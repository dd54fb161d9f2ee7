//! The rules by which numbers confirm a claim or refute it, stated beside each number.

use super::statistics::{mean, number};

/// What the numbers say of a claim.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Verdict {
    /// They bear it out.
    Confirmed,
    /// They contradict it.
    Refuted,
    /// They do neither, or there are none.
    NotDecided,
    /// There is no claim: a measurement.
    Measured,
}

impl Verdict {
    /// As a word at the start of a sentence.
    pub(super) const fn word(self) -> &'static str {
        match self {
            Self::Confirmed => "Confirmed",
            Self::Refuted => "Refuted",
            Self::NotDecided => "Not decided",
            Self::Measured => "Measured",
        }
    }

    /// `Confirmed` or `Refuted`; `NotDecided` where nothing was measured.
    pub(super) fn of(holds: Option<bool>) -> Self {
        match holds {
            Some(true) => Self::Confirmed,
            Some(false) => Self::Refuted,
            None => Self::NotDecided,
        }
    }
}

/// Ours may exceed brute force by this in the mean.
pub(super) const MEAN_SLACK: f64 = 0.002;
/// A cell that exceeds its rival by more is listed; a difference that a reader may see.
pub(super) const CELL_SLACK: f64 = 0.01;
/// Of the comparisons, the part that has to point one way.
const MAJORITY: f64 = 2.0 / 3.0;
/// The rule of [`paired`], in words.
pub(super) const PAIRED_RULE: &str = "confirmed if the mean margin is positive and two thirds of the comparisons are; \
                                      refuted if both are so of negative ones; else not decided";

/// Whether ours is as good as a rival over cells: `(ours, rival)`.
pub(super) fn no_worse(pairs: &[(f64, f64)]) -> Verdict {
    let excess: Vec<f64> = pairs.iter().map(|(ours, rival)| ours - rival).collect();
    Verdict::of(mean(&excess).map(|mean| mean <= MEAN_SLACK && excess.iter().all(|excess| *excess <= CELL_SLACK)))
}

/// Whether margins (rival less ours) favour ours: [`PAIRED_RULE`].
pub(super) fn paired(margins: &[f64]) -> Verdict {
    let Some(mean) = mean(margins) else { return Verdict::NotDecided };
    let needed = number(margins.len()) * MAJORITY - 1e-9;
    let wins = number(margins.iter().filter(|margin| **margin > 0.0).count());
    let losses = number(margins.iter().filter(|margin| **margin < 0.0).count());
    if mean > 0.0 && wins >= needed {
        Verdict::Confirmed
    } else if mean < 0.0 && losses >= needed {
        Verdict::Refuted
    } else {
        Verdict::NotDecided
    }
}

/// Whether a number is at most `good`, or more than `bad`.
pub(super) fn between(measured: Option<f64>, good: f64, bad: f64) -> Verdict {
    match measured {
        Some(x) if x <= good => Verdict::Confirmed,
        Some(x) if x > bad => Verdict::Refuted,
        _ => Verdict::NotDecided,
    }
}

#[cfg(test)]
mod tests {
    use super::{Verdict::*, *};

    #[test]
    fn one_bad_cell_or_a_bad_mean_refutes_no_worse() {
        assert_eq!(no_worse(&[(0.05, 0.05), (0.051, 0.05)]), Confirmed);
        assert_eq!(no_worse(&[(0.053, 0.05), (0.053, 0.05)]), Refuted);
        assert_eq!(no_worse(&[(0.02, 0.05), (0.065, 0.05)]), Refuted);
        assert_eq!(no_worse(&[]), NotDecided);
    }

    #[test]
    fn paired_margins_need_mean_and_majority() {
        assert_eq!(paired(&[0.1, 0.1, -0.1]), Confirmed);
        assert_eq!(paired(&[-0.1, -0.1, 0.1]), Refuted);
        assert_eq!(paired(&[0.1, 0.1, -0.9]), NotDecided);
        assert_eq!(paired(&[0.1, -0.01]), NotDecided);
        assert_eq!(paired(&[]), NotDecided);
    }

    #[test]
    fn between_has_a_gap() {
        assert_eq!([0.5, 1.5, 2.5].map(|x| between(Some(x), 1.0, 2.0)), [Confirmed, NotDecided, Refuted]);
        assert_eq!(between(None, 1.0, 2.0), NotDecided);
    }
}
