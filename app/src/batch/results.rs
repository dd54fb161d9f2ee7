//! Writes the results of fits that have ended on other threads, so that running fits do not wait for a disk.

use super::{backlog::Backlog, board::Board, row::Scores};
use crate::{
    fit::{final_parameters, final_score, final_scores, notes, write_results},
    outputs::{FIT_FILES, FitRecord, OutFolder, Timing},
};
use anyhow::Context;
use lookalike::{fit::Methods, plan::FitOutcome, scene::Capture};
use serde_json::Value;
use std::sync::{
    Arc, Mutex, PoisonError,
    mpsc::{Receiver, Sender, channel},
};
use tokio::sync::Notify;

/// The inputs of a fit.
#[derive(Debug)]
pub(super) struct Inputs {
    pub(super) capture: Arc<Capture>,
    pub(super) methods: Methods,
    pub(super) exposure: f64,
    /// The `inputs` of `fit.json`.
    pub(super) inputs: Value,
    pub(super) max_cssim: Option<f64>,
}

/// A fit that has ended, with everything that its files need.
#[derive(Debug)]
pub(super) struct Fitted {
    pub(super) number: u32,
    pub(super) name: String,
    pub(super) inputs: Inputs,
    pub(super) outcome: FitOutcome,
    pub(super) timing: Timing,
}

/// Writes results on the rayon pool.
#[derive(Debug)]
pub(super) struct Writers {
    board: Arc<Board>,
    out: OutFolder,
    out_name: String,
    /// Each result that is being written holds a clone.
    open: Sender<()>,
    /// Fits whose results were written since the last call of [`Writers::newly_safe`].
    safe: Arc<Mutex<Vec<u32>>>,
    backlog: Backlog,
    /// Notified whenever the results of a fit are written.
    wake: Arc<Notify>,
}

/// Waits for the writers.
#[derive(Debug)]
pub(super) struct Written(Receiver<()>);

impl Written {
    /// Waits until everything is written. The [`Writers`] must be dropped first.
    pub(super) fn wait(self) {
        while self.0.recv().is_ok() {}
    }
}

impl Writers {
    pub(super) fn new(board: Arc<Board>, out: OutFolder, out_name: String, wake: Arc<Notify>) -> (Self, Written) {
        let (open, written) = channel();
        let (safe, backlog) = (Arc::default(), Backlog::default());
        (Self { board, out, out_name, open, safe, backlog, wake }, Written(written))
    }

    /// The fits that are being written.
    pub(super) fn backlog(&self) -> &Backlog {
        &self.backlog
    }

    /// The fits whose results were written since the last call.
    pub(super) fn newly_safe(&self) -> Vec<u32> {
        std::mem::take(&mut self.safe.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Begins to write the results of a fit.
    pub(super) fn write(&self, fitted: Fitted) {
        let (board, out, open) = (Arc::clone(&self.board), self.out.clone(), self.open.clone());
        let (safe, wake) = (Arc::clone(&self.safe), Arc::clone(&self.wake));
        let entry = self.backlog.add(fitted.inputs.capture.photo().width() * fitted.inputs.capture.photo().height());
        let out_name = format!("{}/{}", self.out_name, fitted.name);
        rayon::spawn(move || {
            match write(&out, out_name, &fitted) {
                Ok(scores) => {
                    board.finished(fitted.number, scores);
                    safe.lock().unwrap_or_else(PoisonError::into_inner).push(fitted.number);
                }
                Err(error) => board.failed(fitted.number, &format!("{error:#}")),
            }
            drop((fitted, entry));
            wake.notify_one();
            drop(open);
        });
    }
}

fn write(out: &OutFolder, out_name: String, fitted: &Fitted) -> anyhow::Result<Scores> {
    let Fitted { inputs, outcome, timing, .. } = fitted;
    let folder = out.sub(&fitted.name)?;
    let method = inputs.methods.get(outcome.chosen);
    let notes = notes(method, outcome);
    let record = FitRecord {
        methods: &inputs.methods,
        capture: &inputs.capture,
        inputs: &inputs.inputs,
        outcome,
        display_exposure: inputs.exposure,
        notes: &notes,
    };
    write_results(&folder, &record, &Timing { out: out_name, ..timing.clone() })?;
    let (cssim, cssim_object) = final_scores(outcome);
    let best = final_score(method.judge, outcome);
    let files = FIT_FILES.iter().map(|name| {
        let hash = folder.hash(name)?.with_context(|| format!("{} is gone already", folder.file(name).display()))?;
        Ok(((*name).to_owned(), hash))
    });
    let files = files.collect::<anyhow::Result<_>>()?;
    Ok(Scores {
        cssim,
        cssim_object,
        judge: method.judge,
        model: method.model,
        gamma: outcome.judged[outcome.winner].candidate.gamma,
        parameters: final_parameters(outcome).to_vec(),
        is_polished: outcome.polished.is_some(),
        is_missed: inputs.max_cssim.is_some_and(|limit| best > limit),
        files,
    })
}
