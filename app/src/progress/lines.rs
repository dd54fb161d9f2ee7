//! Plain lines for logs and pipes: one when a stage is complete, and occasional ones in between.

use super::{
    Display, Ending, PAUSE, print_line, remark,
    stage::{Stage, Tally},
};
use lookalike::fit::BestScore;
use lookalike_coordinator::events::RunEvent;
use std::{sync::Arc, time::Instant};

pub(super) struct Lines {
    tally: Tally,
    best: Arc<BestScore>,
    began: Instant,
    told: Instant,
}

impl Lines {
    pub(super) fn new(best: Arc<BestScore>) -> Self {
        Self { tally: Tally::default(), best, began: Instant::now(), told: Instant::now() }
    }

    fn tell(&mut self, stage: Stage, what: &str) {
        let best = self.best.get().filter(|_| stage >= Stage::Judging);
        let best = best.map(|score| format!(", best CSSIM so far {score:.4}")).unwrap_or_default();
        self.say(&format!("{:6.1} s  {}{what}{best}", self.began.elapsed().as_secs_f64(), stage.title()));
        self.told = Instant::now();
    }
}

impl Display for Lines {
    fn event(&mut self, event: &RunEvent) {
        if let Some((stage, count)) = self.tally.note(event) {
            let is_end = matches!(event, RunEvent::NodeFinished { .. } | RunEvent::NodeRecalled { .. });
            if is_end && count.is_complete() {
                self.tell(stage, " done");
            } else if self.told.elapsed() >= PAUSE {
                self.tell(stage, &format!(": {} %", count.thousandths() / 10));
            }
        }
        if let Some(text) = remark(event) {
            self.say(&text);
        }
    }

    fn say(&mut self, text: &str) {
        print_line(text);
    }

    fn finish(&mut self, _ending: Ending<'_>) {}
}
