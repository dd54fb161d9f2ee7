//! Events about the fits of a batch, in addition to those about their nodes.

use lookalike::fit::BestScore;
use std::sync::Arc;

/// An event about a fit.
#[derive(Debug, Clone)]
pub(crate) enum FitEvent {
    /// Its inputs are loaded; its first nodes follow.
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
        /// From its start until its last file was written.
        seconds: f64,
    },
    /// It failed.
    Failed {
        /// Its place in the manifest, from 0.
        number: u32,
        /// Its name.
        name: String,
        /// The error.
        error: String,
    },
}

/// The number of fits in each state.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct FitCount {
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

impl FitCount {
    /// `5 of 12 done`, followed by the numbers of missed and failed fits.
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
    /// The line that reports the end of a fit; `None` for its start.
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
