//! A fit of a batch: how far it is, and its scores.

use lookalike::brdf::Model;
use lookalike_coordinator::journal::{PartRow, PartStatus};

/// A fit, as the summaries show it.
#[derive(Debug, Clone)]
pub(super) struct Row {
    pub(super) name: String,
    pub(super) photo: String,
    pub(super) env: String,
    pub(super) model: &'static dyn Model,
    pub(super) state: State,
    /// From its start to its end, so far as it has one.
    pub(super) seconds: Option<f64>,
}

/// How far a fit is.
#[derive(Debug, Clone)]
pub(super) enum State {
    /// Its turn has not come.
    Waiting,
    /// Its nodes run, or its results are being written.
    Running,
    /// Its results are there.
    Done(Scores),
    /// It has no results and gets none.
    Failed(String),
    /// The run ended before it did.
    Stopped,
}

impl State {
    /// In one word, as the summaries and the metrics have it.
    pub(super) fn name(&self) -> &'static str {
        match self {
            Self::Waiting => "waiting",
            Self::Running => "running",
            Self::Done(scores) if scores.is_missed => "missed",
            Self::Done(_) => "done",
            Self::Failed(_) => "failed",
            Self::Stopped => "stopped",
        }
    }
}

impl Row {
    /// As the journal has it.
    pub(super) fn journal_row(&self, number: u32) -> PartRow {
        let (scores, error) = match &self.state {
            State::Done(scores) => (Some(scores), None),
            State::Failed(error) => (None, Some(error.clone())),
            State::Waiting | State::Running | State::Stopped => (None, None),
        };
        let status = PartStatus {
            name: self.name.clone(),
            state: self.state.name().to_owned(),
            score: scores.map(|scores| scores.cssim),
            seconds: self.seconds,
            error,
        };
        PartRow { number, status, outputs: scores.map(|scores| scores.files.clone()).unwrap_or_default() }
    }
}

/// All words that [`State::name`] can say.
pub(super) const STATES: [&str; 6] = ["waiting", "running", "done", "missed", "failed", "stopped"];

/// What the summaries say of a fit with results.
#[derive(Debug, Clone)]
pub(super) struct Scores {
    pub(super) cssim: f64,
    pub(super) cssim_object: f64,
    /// Of the winner of stage two.
    pub(super) gamma: f64,
    /// The flat vector that the fit ends with.
    pub(super) parameters: Vec<f64>,
    pub(super) is_polished: bool,
    /// Whether the score lies above the fit's `max-cssim`.
    pub(super) is_missed: bool,
    /// The files that were written, each with the BLAKE3 of its bytes.
    pub(super) files: Vec<(String, String)>,
}
