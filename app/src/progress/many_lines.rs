//! A line when a fit of a batch has ended, for logs and pipes.

use super::{
    Display, Ending,
    fits::{FitCount, FitEvent},
    print_line, remark_of_many,
};
use lookalike_coordinator::events::RunEvent;
use std::time::Instant;

pub(super) struct ManyLines {
    began: Instant,
}

impl ManyLines {
    pub(super) fn new() -> Self {
        Self { began: Instant::now() }
    }
}

impl Display for ManyLines {
    fn event(&mut self, event: &RunEvent) {
        if let Some(text) = remark_of_many(event) {
            self.say(&text);
        }
    }

    fn fit(&mut self, event: &FitEvent, count: FitCount) {
        if let Some(line) = event.line() {
            let width = count.total.to_string().len();
            let ended = count.done + count.failed;
            let seconds = self.began.elapsed().as_secs_f64();
            self.say(&format!("{seconds:7.1} s  {ended:>width$} of {}  {line}", count.total));
        }
    }

    fn say(&mut self, text: &str) {
        print_line(text);
    }

    fn finish(&mut self, _ending: Ending<'_>) {}
}
