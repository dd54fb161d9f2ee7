//! A fit of a batch: its state and its scores.

use lookalike::{
    brdf::Model,
    fit::{JudgedBy, Methods},
};
use lookalike_coordinator::journal::{PartRow, PartStatus};

/// A fit, as the summaries show it.
#[derive(Debug, Clone)]
pub(super) struct Row {
    pub(super) name: String,
    pub(super) photo: String,
    pub(super) env: String,
    /// The models that it compares.
    pub(super) models: Methods,
    pub(super) state: State,
    /// From its start to its end; `None` before its end.
    pub(super) seconds: Option<f64>,
}

/// The state of a fit.
#[derive(Debug, Clone)]
pub(super) enum State {
    /// It has not begun.
    Waiting,
    /// Its nodes are running, or its results are being written.
    Running,
    /// Its results are written.
    Done(Scores),
    /// It failed and has no results.
    Failed(String),
    /// The run ended before the fit did.
    Stopped,
}

impl State {
    /// The word for it in the summaries and the metrics.
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
    /// The model that was chosen; before that, what the fit chooses from.
    pub(super) fn model(&self) -> String {
        match &self.state {
            State::Done(scores) => scores.model.name().to_owned(),
            _ => self.models.name(),
        }
    }

    /// Its row in the journal.
    pub(super) fn journal_row(&self, number: u32) -> PartRow {
        let (scores, error) = match &self.state {
            State::Done(scores) => (Some(scores), None),
            State::Failed(error) => (None, Some(error.clone())),
            State::Waiting | State::Running | State::Stopped => (None, None),
        };
        let status = PartStatus {
            name: self.name.clone(),
            state: self.state.name().to_owned(),
            score: scores.map(Scores::judged),
            seconds: self.seconds,
            error,
        };
        PartRow { number, status, outputs: scores.map(|scores| scores.files.clone()).unwrap_or_default() }
    }
}

/// All values of [`State::name`].
pub(super) const STATES: [&str; 6] = ["waiting", "running", "done", "missed", "failed", "stopped"];

/// The part of a fit's results that the summaries show.
#[derive(Debug, Clone)]
pub(super) struct Scores {
    pub(super) cssim: f64,
    pub(super) cssim_object: f64,
    /// Which of them the fit was judged by.
    pub(super) judge: JudgedBy,
    /// The model that was chosen.
    pub(super) model: &'static dyn Model,
    /// The gamma of the winner of stage two.
    pub(super) gamma: f64,
    /// The final flat parameter vector.
    pub(super) parameters: Vec<f64>,
    pub(super) is_polished: bool,
    /// Whether the score lies above the fit's `max-cssim`.
    pub(super) is_missed: bool,
    /// The files that were written, each with the BLAKE3 of its bytes.
    pub(super) files: Vec<(String, String)>,
}

impl Scores {
    /// The score that the fit was judged by.
    pub(super) fn judged(&self) -> f64 {
        self.judge.pick(self.cssim, self.cssim_object)
    }
}
