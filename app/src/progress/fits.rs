//! What is told of the fits of a batch, beside the events of its nodes.

use lookalike::fit::BestScore;
use std::sync::Arc;

/// Something that happened to a fit.
#[derive(Debug, Clone)]
pub(crate) enum FitEvent {
    /// Its inputs are there; its first nodes follow.
    Started {
        /// Its place in the manifest, from 0.
        number: u32,
        /// Its name.
        name: String,
        /// Its best score so far.
        best: Arc<BestScore>,
    },
    /// Its results are written.
    Finished {
        /// Its place in the manifest, from 0.
        number: u32,
        /// Its name.
        name: String,
        /// Its final score of the whole image.
        cssim: f64,
        /// Its final score of the object.
        cssim_object: f64,
        /// Whether its score lies above its `max-cssim`.
        is_missed: bool,
        /// From its start to its last file.
        seconds: f64,
    },
    /// It gave up.
    Failed {
        /// Its place in the manifest, from 0.
        number: u32,
        /// Its name.
        name: String,
        /// Why.
        error: String,
    },
}

/// How many fits there are, and how many have come to which end.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct FitCount {
    /// All of them.
    pub(crate) total: usize,
    /// Under way.
    pub(crate) running: usize,
    /// With results, those included that missed their score.
    pub(crate) done: usize,
    /// With results and a score above their `max-cssim`.
    pub(crate) missed: usize,
    /// Without results.
    pub(crate) failed: usize,
}

impl FitCount {
    /// `5 of 12 done`, and what went wrong.
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

impl FitEvent {
    /// The end of a fit in a line for people; none for its start.
    pub(crate) fn line(&self) -> Option<String> {
        match self {
            Self::Started { .. } => None,
            Self::Finished { name, cssim, is_missed, seconds, .. } => {
                let missed = if *is_missed { ", above its max-cssim" } else { "" };
                Some(format!("{name}: CSSIM {cssim:.4}{missed} ({seconds:.1} s)"))
            }
            Self::Failed { name, error, .. } => Some(format!("{name}: failed: {error}")),
        }
    }
}
