//! Plain lines for logs and pipes: one when a stage of the only fit is complete or a fit of many has ended, and one every few
//! seconds in between.

use super::{
    Display, Ending, FIRST, PAUSE,
    parts::{HINT, PartCount, PartEvent, Shape},
    print_line,
    remarks::Remarks,
    rows::Rows,
};
use lookalike_coordinator::events::RunEvent;
use std::time::Instant;

pub(super) struct Lines {
    remarks: Remarks,
    count: PartCount,
    rows: Rows,
    began: Instant,
    /// When the latest line was printed.
    told: Option<Instant>,
}

impl Lines {
    pub(super) fn new(remarks: Remarks) -> Self {
        let (count, rows, now) = (PartCount::default(), Rows::default(), Instant::now());
        Self { remarks, count, rows, began: now, told: None }
    }

    fn tell(&mut self, text: &str) {
        self.told = Some(Instant::now());
        self.say(&format!("{:6.1} s  {text}", self.began.elapsed().as_secs_f64()));
    }

    /// Whether it is time for a line, although nothing has ended.
    fn is_due(&self) -> bool {
        self.told.map_or(self.began.elapsed() >= FIRST, |told| told.elapsed() >= PAUSE)
    }

    /// The line about the stage of the only fit that an event belongs to.
    fn stage(&mut self, event: &RunEvent) {
        let is_due = self.is_due();
        let Some((_, row, stage, count)) = self.rows.note(event) else { return };
        let is_end = matches!(event, RunEvent::NodeFinished { .. } | RunEvent::NodeRecalled { .. });
        let state = match is_end && count.is_complete() {
            true => " done".to_owned(),
            false if is_due => format!(": {} %", count.thousandths() / 10),
            false => return,
        };
        let best = row.best_at(stage).map(|score| format!(", best CSSIM so far {score:.4}{HINT}")).unwrap_or_default();
        self.tell(&format!("{}{state}{best}", stage.title()));
    }

    /// The line about all parts.
    fn counts(&mut self, noun: &str) {
        let is_over = self.count.done + self.count.failed == self.count.total;
        if is_over || self.is_due() {
            self.tell(&format!("{noun}s: {}, {} running", self.count.text(), self.count.running));
        }
    }
}

impl Display for Lines {
    fn event(&mut self, event: &RunEvent) {
        match self.remarks.shape {
            Shape::OneFit => self.stage(event),
            Shape::Many { noun, .. } if self.count.running > 0 => self.counts(noun),
            Shape::Many { .. } => {}
        }
        if let Some(text) = self.remarks.line(event) {
            self.say(&text);
        }
    }

    fn part(&mut self, event: &PartEvent, count: PartCount) {
        self.count = count;
        match self.remarks.shape {
            Shape::OneFit => self.rows.part(event),
            Shape::Many { noun, total, .. } => match event.line() {
                Some(line) => {
                    let width = total.to_string().len();
                    self.tell(&format!("{:>width$} of {total}  {line}", count.done + count.failed));
                }
                None => self.counts(noun),
            },
        }
    }

    fn say(&mut self, text: &str) {
        print_line(text);
    }

    fn finish(&mut self, _ending: Ending<'_>) {}
}
