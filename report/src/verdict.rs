//! The rules by which numbers confirm or refute a claim; the report prints the rule with the numbers.

use super::{
    statistics::{mean, number},
    text,
};

/// The verdict on a claim.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Verdict {
    /// The numbers confirm it.
    Confirmed,
    /// The numbers contradict it.
    Refuted,
    /// Neither, or there are no numbers.
    NotDecided,
    /// A measurement without a claim.
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

    /// `Confirmed` or `Refuted`; `NotDecided` without a measurement.
    pub(super) fn of(holds: Option<bool>) -> Self {
        match holds {
            Some(true) => Self::Confirmed,
            Some(false) => Self::Refuted,
            None => Self::NotDecided,
        }
    }
}

/// Largest mean excess of ours over brute force that still counts as no worse.
pub(super) const MEAN_SLACK: f64 = 0.002;
/// A cell that exceeds its rival by more than this is listed; such a difference may be visible.
pub(super) const CELL_SLACK: f64 = 0.01;
/// Share of the comparisons that must agree in sign.
const MAJORITY: f64 = 2.0 / 3.0;
/// Fewest comparisons for a decision.
const FEWEST: usize = 5;
/// Signs decide only if the probability of signs at least as one-sided, with both equally likely, is below this.
const CHANCE: f64 = 0.1;

/// The rule of [`paired`] in words, after the numbers that it uses.
pub(super) fn rule(margins: &[f64]) -> String {
    format!(
        "n = {}, sign test {}; confirmed if the mean margin is positive, at least two thirds of {FEWEST} or more margins are positive, \
         and p (two-sided) is below {CHANCE}; refuted if all this holds for negative margins; otherwise not decided",
        margins.len(),
        text::probability(sign_test(margins))
    )
}

/// Whether ours is as good as a rival over cells: `(ours, rival)`.
pub(super) fn no_worse(pairs: &[(f64, f64)]) -> Verdict {
    let excess: Vec<f64> = pairs.iter().map(|(ours, rival)| ours - rival).collect();
    Verdict::of(mean(&excess).map(|mean| mean <= MEAN_SLACK && excess.iter().all(|excess| *excess <= CELL_SLACK)))
}

/// Whether margins (rival minus ours) favour ours, by [`rule`].
pub(super) fn paired(margins: &[f64]) -> Verdict {
    let Some(mean) = mean(margins) else { return Verdict::NotDecided };
    if margins.len() < FEWEST || sign_test(margins) >= CHANCE {
        return Verdict::NotDecided;
    }
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

/// The two-sided probability of signs at least as one-sided as these if both signs are equally likely; zeros are left out.
fn sign_test(margins: &[f64]) -> f64 {
    let wins = margins.iter().filter(|margin| **margin > 0.0).count();
    let losses = margins.iter().filter(|margin| **margin < 0.0).count();
    let (fewer, all) = (wins.min(losses), wins + losses);
    // In logarithms, because 2^all overflows.
    let mut choices = -number(all) * std::f64::consts::LN_2;
    let mut tail = choices.exp();
    for chosen in 1..=fewer {
        choices += (number(all + 1 - chosen) / number(chosen)).ln();
        tail += choices.exp();
    }
    (2.0 * tail).min(1.0)
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
        let margins = |wins: usize, losses: usize, loss: f64| [vec![0.1; wins], vec![-loss; losses]].concat();
        assert_eq!(paired(&margins(9, 1, 0.1)), Confirmed);
        assert_eq!(paired(&margins(1, 9, 0.1)), Refuted);
        // A mean that contradicts the majority, no majority, and a majority that may be chance.
        assert_eq!(paired(&margins(9, 1, 9.0)), NotDecided);
        assert_eq!(paired(&margins(30, 20, 0.1)), NotDecided);
        assert_eq!(paired(&margins(6, 3, 0.1)), NotDecided);
        assert_eq!([margins(4, 0, 0.0), margins(5, 0, 0.0)].map(|all| paired(&all)), [NotDecided, Confirmed]);
        assert_eq!(paired(&[]), NotDecided);
    }

    #[test]
    fn the_sign_test_is_the_exact_binomial() {
        let p = |wins: usize, losses: usize| sign_test(&[vec![1.0; wins], vec![-1.0; losses], vec![0.0; 3]].concat());
        for (wins, losses, expected) in
            [(5, 0, 2.0 / 32.0), (0, 5, 2.0 / 32.0), (4, 1, 12.0 / 32.0), (9, 1, 22.0 / 1024.0)]
        {
            assert!((p(wins, losses) - expected).abs() < 1e-12, "{wins} {losses}: {}", p(wins, losses));
        }
        assert_eq!([p(0, 0), p(2, 2)], [1.0, 1.0]);
        assert!(p(2000, 1000) < 1e-60 && p(1500, 1500) == 1.0);
    }

    #[test]
    fn between_has_a_gap() {
        assert_eq!([0.5, 1.5, 2.5].map(|x| between(Some(x), 1.0, 2.0)), [Confirmed, NotDecided, Refuted]);
        assert_eq!(between(None, 1.0, 2.0), NotDecided);
    }
}
