//! Shows a study while it runs: a bar of cells on a terminal, occasional lines elsewhere.

use crate::{
    progress::{Display, Ending, display_of_many},
    settings::ProgressKind,
};
use indicatif::{ProgressBar, ProgressStyle};
use lookalike_coordinator::events::RunEvent;
use std::{
    io::{self, IsTerminal},
    time::{Duration, Instant},
};

/// The display of a study.
pub(super) struct Progress {
    cells: usize,
    complete: usize,
    kind: Kind,
    /// Shows the events of workers and nodes.
    display: Box<dyn Display>,
    began: Instant,
    told: Instant,
}

enum Kind {
    Bar(ProgressBar),
    Lines,
    Silent,
}

/// The time between two lines.
const PAUSE: Duration = Duration::from_secs(10);

impl Progress {
    pub(super) fn new(kind: ProgressKind, cells: usize) -> Self {
        let is_terminal = io::stderr().is_terminal();
        let (kind, inner) = match kind {
            ProgressKind::Auto if !is_terminal => (Kind::Lines, ProgressKind::Auto),
            ProgressKind::Auto | ProgressKind::Bar if is_terminal => (Kind::Bar(bar(cells)), ProgressKind::None),
            ProgressKind::Auto | ProgressKind::Bar => (Kind::Lines, ProgressKind::None),
            silent => (Kind::Silent, silent),
        };
        let display = display_of_many(inner, cells);
        Self { cells, complete: 0, kind, display, began: Instant::now(), told: Instant::now() }
    }

    pub(super) fn event(&mut self, event: &RunEvent) {
        match &self.kind {
            Kind::Bar(bar) => bar.suspend(|| self.display.event(event)),
            Kind::Lines | Kind::Silent => self.display.event(event),
        }
    }

    /// Sets the number of complete cells.
    pub(super) fn complete(&mut self, complete: usize) {
        match &self.kind {
            Kind::Bar(bar) => bar.set_position(complete as u64),
            Kind::Lines if complete > self.complete && (self.told.elapsed() > PAUSE || complete == self.cells) => {
                self.told = Instant::now();
                let minutes = self.began.elapsed().as_secs_f64() / 60.0;
                self.display.say(&format!("{complete} of {} cells complete, {minutes:.1} min", self.cells));
                self.complete = complete;
            }
            Kind::Lines | Kind::Silent => {}
        }
    }

    pub(super) fn finish(&mut self, ending: Ending<'_>) {
        if let Kind::Bar(bar) = &self.kind {
            bar.finish_and_clear();
        }
        self.display.finish(ending);
    }
}

fn bar(cells: usize) -> ProgressBar {
    let bar = ProgressBar::new(cells as u64);
    if let Ok(style) = ProgressStyle::with_template("study {wide_bar} {pos} of {len} cells, {elapsed}, {eta} left") {
        bar.set_style(style);
    }
    bar.enable_steady_tick(Duration::from_secs(1));
    bar
}
