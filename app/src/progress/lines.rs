//! A line when a stage is complete, for logs and pipes.

use super::{Display, Ending, print_line, remark, stage::Tally};
use crate::progress::stage::Stage;
use lookalike::fit::BestScore;
use lookalike_coordinator::events::RunEvent;
use std::{sync::Arc, time::Instant};

pub(super) struct Lines {
    tally: Tally,
    best: Arc<BestScore>,
    began: Instant,
}

impl Lines {
    pub(super) fn new(best: Arc<BestScore>) -> Self {
        Self { tally: Tally::default(), best, began: Instant::now() }
    }
}

impl Display for Lines {
    fn event(&mut self, event: &RunEvent) {
        if let Some((stage, count)) = self.tally.note(event)
            && count.is_complete()
            && matches!(event, RunEvent::NodeFinished { .. } | RunEvent::NodeRecalled { .. })
        {
            let best = self.best.get().filter(|_| stage >= Stage::Judging);
            let best = best.map(|score| format!(", best CSSIM so far {score:.4}")).unwrap_or_default();
            self.say(&format!("{:6.1} s  {} done{best}", self.began.elapsed().as_secs_f64(), stage.title()));
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
