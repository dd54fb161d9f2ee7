//! How a run is shown while it goes: bars on a terminal, plain lines elsewhere, JSON lines for programs. All on stderr.

mod bars;
mod json;
mod lines;
mod stage;

use crate::{comm::RunEvent, settings::ProgressKind};
use lookalike::fit::BestScore;
use std::{io::IsTerminal, sync::Arc};

/// Something that watches a run.
pub(crate) trait Display {
    /// Takes note of what happened.
    fn event(&mut self, event: &RunEvent);

    /// A line of text for people, above any bars.
    fn say(&mut self, text: &str);

    /// The run is over, well or with an error; nothing may be left moving.
    fn finish(&mut self, outcome: Result<(), &str>);
}

/// The display that the user asked for. `best` holds the best score so far.
pub(crate) fn display(kind: ProgressKind, best: Arc<BestScore>) -> Box<dyn Display> {
    match kind {
        ProgressKind::Auto if !std::io::stderr().is_terminal() => Box::new(lines::Lines::new(best)),
        // Where bars cannot be drawn (a pipe, a dumb terminal) lines must do.
        ProgressKind::Bar | ProgressKind::Auto => match bars::Bars::new(Arc::clone(&best)) {
            Some(bars) => Box::new(bars),
            None => Box::new(lines::Lines::new(best)),
        },
        ProgressKind::Json => Box::new(json::JsonLines),
        ProgressKind::None => Box::new(Silent),
    }
}

struct Silent;

impl Display for Silent {
    fn event(&mut self, _event: &RunEvent) {}

    fn say(&mut self, text: &str) {
        eprintln!("{text}");
    }

    fn finish(&mut self, _outcome: Result<(), &str>) {}
}

/// What people should be told about a run beyond the counts; `None` for everything that goes as planned.
fn remark(event: &RunEvent) -> Option<String> {
    match event {
        RunEvent::Resumed { results, .. } => {
            Some(format!("going on with the run that is there: {results} results need not be computed again"))
        }
        RunEvent::WaitingForWorkers { waited, limit } => Some(format!(
            "waiting for workers: {} s of at most {} s; start one with `lookalike worker --access OUT/access.json`",
            waited.as_secs(),
            limit.as_secs()
        )),
        RunEvent::LocalWorkerEnded { process, status, restart_after } => {
            let next = restart_after.map_or("it is not started again", |_| "another one takes its place");
            Some(format!("warning: local worker {process} ended ({status}); {next}"))
        }
        RunEvent::WorkerDraining { worker } => {
            Some(format!("{worker} was asked to end: it finishes what it computes and gets nothing more"))
        }
        RunEvent::NodeSuspected { name, deaths } => Some(format!(
            "warning: {deaths} workers have died while they computed {}: from now on it runs alone",
            name.label
        )),
        RunEvent::NodeSpeculated { name, worker } => {
            Some(format!("{} is slow: {worker} computes it too, and the first answer counts", name.label))
        }
        RunEvent::NodeRequeued { name, .. } => Some(format!("{} runs again on another worker", name.label)),
        RunEvent::NodeFailed { name, reason } => Some(format!("error: {} failed: {reason}", name.label)),
        _ => None,
    }
}
