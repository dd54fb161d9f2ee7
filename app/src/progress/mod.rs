//! Shows a run while it goes on, all on stderr: bars on a terminal, plain lines elsewhere, JSON lines for programs.

mod activity;
mod bars;
mod json;
mod lines;
mod parts;
mod rows;
mod stage;

pub(crate) use activity::Activity;
pub(crate) use parts::{PartCount, PartEvent, PartScores, Shape};

use crate::settings::ProgressKind;
use lookalike_coordinator::events::RunEvent;
use std::{
    io::{self, IsTerminal, Write as _},
    time::Duration,
};

/// The time before the first line of progress where bars cannot be drawn.
const FIRST: Duration = Duration::from_secs(2);

/// The time between two lines of progress where bars cannot be drawn.
const PAUSE: Duration = Duration::from_secs(10);

/// How a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Ending<'a> {
    /// All nodes have ended.
    Finished,
    /// It was stopped early on request, for this reason.
    Stopped(&'a str),
    /// It failed, with this error.
    Failed(&'a str),
}

/// Shows the events of a run.
pub(crate) trait Display: Send {
    /// Processes an event.
    fn event(&mut self, event: &RunEvent);

    /// Processes an event about a part.
    fn part(&mut self, event: &PartEvent, count: PartCount);

    /// Prints a line of text, above any bars.
    fn say(&mut self, text: &str);

    /// The run is over, and all its files are written. Stops all animation.
    fn finish(&mut self, ending: Ending<'_>);
}

/// Prints a line on stderr, in one piece: workers and scripts write there too. A closed stderr does not stop the run.
pub(crate) fn print_line(text: &str) {
    let _ = io::stderr().write_all(format!("{text}\n").as_bytes());
}

/// The display of this kind for a run of this shape.
pub(crate) fn display(kind: ProgressKind, shape: Shape) -> Box<dyn Display> {
    match kind {
        ProgressKind::Auto if !io::stderr().is_terminal() => Box::new(lines::Lines::new(shape)),
        // Print lines where bars cannot be drawn (a pipe, a dumb terminal).
        ProgressKind::Bar | ProgressKind::Auto => match bars::Bars::new(shape) {
            Some(bars) => Box::new(bars),
            None => Box::new(lines::Lines::new(shape)),
        },
        ProgressKind::Json => Box::new(json::JsonLines::new(shape)),
        ProgressKind::None => Box::new(Silent),
    }
}

/// Shows failed parts only.
struct Silent;

impl Display for Silent {
    fn event(&mut self, _event: &RunEvent) {}

    fn part(&mut self, event: &PartEvent, _count: PartCount) {
        if let (PartEvent::Failed { .. }, Some(line)) = (event, event.line()) {
            self.say(&line);
        }
    }

    fn say(&mut self, text: &str) {
        print_line(text);
    }

    fn finish(&mut self, _ending: Ending<'_>) {}
}

/// A line about an unexpected event; `None` for all other events.
fn remark(event: &RunEvent, shape: Shape) -> Option<String> {
    match event {
        RunEvent::Resumed { results, .. } => Some(format!("resuming the run: its journal holds {results} results")),
        RunEvent::Listening { address, local_workers: 0 } => Some(format!(
            "listening for workers, which connect to {address}; start one with `lookalike worker --access OUT/access.json`"
        )),
        RunEvent::WaitingForWorkers { waited, limit } => Some(format!(
            "waiting for workers: {} s of at most {} s; start one with `lookalike worker --access OUT/access.json`",
            waited.as_secs(),
            limit.as_secs()
        )),
        RunEvent::LocalWorkerEnded { process, status, restart_after } => {
            let next = restart_after.map_or("it is not restarted", |_| "starting another one");
            Some(format!("warning: local worker {process} ended ({status}); {next}"))
        }
        RunEvent::WorkerDraining { worker } => {
            Some(format!("{worker} was asked to end: it finishes its nodes and gets no more"))
        }
        RunEvent::NodeSuspected { name, deaths } => Some(format!(
            "warning: {deaths} workers died while they computed {}: it runs alone from now on",
            name.label
        )),
        RunEvent::AnswersDiffer { name, first, second, error } => Some(format!(
            "warning: {} has an output and an error ({error}), one from {first} and one from {second}: one of these machines computes \
             wrongly",
            name.label
        )),
        RunEvent::NodeSpeculated { name, worker } => {
            Some(format!("{} is slow: {worker} computes it too, and the first result counts", name.label))
        }
        RunEvent::NodeRequeued { name, .. } => Some(format!("retrying {} on another worker", name.label)),
        RunEvent::NodeFailed { reason, .. } if reason.is_cancellation() => None,
        // Reported as a failed part.
        RunEvent::NodeFailed { .. } if shape != Shape::OneFit => None,
        RunEvent::NodeFailed { name, reason } => Some(format!("error: {} failed: {reason}", name.label)),
        _ => None,
    }
}
