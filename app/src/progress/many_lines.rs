//! Plain lines for logs and pipes: one when a fit of a batch has ended, and occasional ones in between.

use super::{
    Display, Ending, PAUSE,
    fits::{FitCount, FitEvent},
    print_line, remark_of_many,
};
use lookalike_coordinator::events::RunEvent;
use std::time::Instant;

pub(super) struct ManyLines {
    began: Instant,
    told: Instant,
    count: FitCount,
}

impl ManyLines {
    pub(super) fn new() -> Self {
        Self { began: Instant::now(), told: Instant::now(), count: FitCount::default() }
    }
}

impl Display for ManyLines {
    fn event(&mut self, event: &RunEvent) {
        if let Some(text) = remark_of_many(event) {
            self.say(&text);
        }
        if self.count.running > 0 && self.told.elapsed() >= PAUSE {
            self.told = Instant::now();
            let (seconds, running) = (self.began.elapsed().as_secs_f64(), self.count.running);
            self.say(&format!("{seconds:7.1} s  {}, {running} running", self.count.text()));
        }
    }

    fn fit(&mut self, event: &FitEvent, count: FitCount) {
        self.count = count;
        if let Some(line) = event.line() {
            self.told = Instant::now();
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
