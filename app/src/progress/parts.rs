//! Events about the parts of a run, in addition to those about their nodes: the fits of a batch, the cells of a study.

use crate::wrap::COLUMNS;
use lookalike::fit::{BestScore, JudgedBy};
use std::sync::Arc;

/// The shape of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Shape {
    /// One fit, whose stages are shown.
    OneFit,
    /// Many parts, each of which is shown as a whole.
    Many {
        /// The word for one of them: `fit` or `cell`.
        noun: &'static str,
        /// Their number.
        total: usize,
        /// How many of them an earlier process has completed.
        done: usize,
    },
}

/// An event about a part.
#[derive(Debug, Clone)]
pub(crate) enum PartEvent {
    /// Its inputs are loaded; its first nodes follow.
    Started {
        /// Its place in the run, from 0.
        number: u32,
        /// Its name; empty if it is the only one.
        name: String,
        /// Its best score so far.
        best: Arc<BestScore>,
    },
    /// Its results are written.
    Finished {
        /// Its place in the run, from 0.
        number: u32,
        /// Its name.
        name: String,
        /// Its scores, if it is a fit.
        scores: Option<PartScores>,
    },
    /// It failed.
    Failed {
        /// Its place in the run, from 0.
        number: u32,
        /// Its name.
        name: String,
        /// The error.
        error: String,
    },
}

/// How a fit has ended.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PartScores {
    /// Its final score of the whole image.
    pub(crate) cssim: f64,
    /// Its final score of the object.
    pub(crate) cssim_object: f64,
    /// Which of them it was judged by.
    pub(crate) judge: JudgedBy,
    /// Whether its score lies above its `max-cssim`.
    pub(crate) is_missed: bool,
    /// From its start until its last file was written.
    pub(crate) seconds: f64,
}

/// The number of parts in each state.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct PartCount {
    /// All of them.
    pub(crate) total: usize,
    /// Those that are running.
    pub(crate) running: usize,
    /// Those with results, including those that missed their score.
    pub(crate) done: usize,
    /// Those with results and a score above their `max-cssim`.
    pub(crate) missed: usize,
    /// Those that failed.
    pub(crate) failed: usize,
}

impl PartCount {
    /// `5 of 12 done`, followed by the numbers of missed and failed parts.
    pub(crate) fn text(&self) -> String {
        let mut text = format!("{} of {} done", self.done, self.total);
        for (count, what) in [(self.missed, "missed"), (self.failed, "failed")] {
            if count > 0 {
                text.push_str(&format!(", {count} {what}"));
            }
        }
        text
    }
}

impl PartEvent {
    /// The line that reports the end of a fit or a failure; `None` for everything else.
    pub(super) fn line(&self) -> Option<String> {
        match self {
            Self::Started { .. } | Self::Finished { scores: None, .. } => None,
            Self::Finished { name, scores: Some(scores), .. } => {
                let PartScores { cssim, cssim_object, judge, is_missed, seconds } = *scores;
                let missed = if is_missed { ", above its max-cssim" } else { "" };
                let line = |hint| {
                    let score = judge.pick(cssim, cssim_object);
                    format!("{name}: CSSIM {score:.4} on {judge}{hint}{missed} ({seconds:.1} s)")
                };
                let hinted = line(HINT);
                Some(if hinted.chars().count() <= COLUMNS - PREFIX_COLUMNS { hinted } else { line("") })
            }
            Self::Failed { name, error, .. } => Some(format!("{name}: failed: {error}")),
        }
    }
}

/// How to read a score, where it fits.
pub(super) const HINT: &str = " (0 = identical)";

/// Columns for what is printed before a line about a part: the time and the count, such as `1234.5 s  100 of 400  `.
const PREFIX_COLUMNS: usize = 23;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn line_shows_the_judged_score_and_how_to_read_it_where_there_is_room() {
        let line = |name: &str, judge| {
            let scores = PartScores { cssim: 0.25, cssim_object: 0.125, judge, is_missed: true, seconds: 12.34 };
            PartEvent::Finished { number: 0, name: name.to_owned(), scores: Some(scores) }.line().unwrap()
        };
        let expected = "a: CSSIM 0.1250 on object (0 = identical), above its max-cssim (12.3 s)";
        assert_eq!(line("a", JudgedBy::Object), expected);
        let long = "gold-metallic-paint3-grace_cross-cook-torrance";
        assert_eq!(line(long, JudgedBy::Image), format!("{long}: CSSIM 0.2500 on image, above its max-cssim (12.3 s)"));
    }
}
