//! Shows a run while it goes on, all on stderr: bars on a terminal, plain lines elsewhere, JSON lines for programs.

mod activity;
mod bars;
mod json;
mod lines;
mod parts;
mod remarks;
mod rows;
mod stage;

pub(crate) use activity::Activity;
pub(crate) use parts::{PartCount, PartEvent, PartScores, Shape};

use crate::settings::ProgressKind;
use lookalike_coordinator::events::RunEvent;
pub(crate) use lookalike_worker::print_line;
use remarks::Remarks;
use std::{
    io::{self, IsTerminal},
    path::PathBuf,
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

/// The display of this kind for a run of this shape, whose workers use this access file.
pub(crate) fn display(kind: ProgressKind, shape: Shape, access: PathBuf) -> Box<dyn Display> {
    let remarks = Remarks { shape, access };
    match kind {
        ProgressKind::Auto if !io::stderr().is_terminal() => Box::new(lines::Lines::new(remarks)),
        // Print lines where bars cannot be drawn (a pipe, a dumb terminal).
        ProgressKind::Bar | ProgressKind::Auto => match bars::Bars::new(remarks) {
            Ok(bars) => Box::new(bars),
            Err(remarks) => Box::new(lines::Lines::new(remarks)),
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
