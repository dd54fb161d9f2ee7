//! One bar per stage, with the best CSSIM so far.

use super::{
    Display, Ending, print_line, remark,
    stage::{Count, Stage, Tally},
};
use indicatif::{MultiProgress, ProgressBar, ProgressStyle};
use lookalike::fit::BestScore;
use lookalike_coordinator::events::RunEvent;
use std::{collections::BTreeMap, sync::Arc, time::Duration};

pub(super) struct Bars {
    all: MultiProgress,
    bars: BTreeMap<Stage, ProgressBar>,
    tally: Tally,
    best: Arc<BestScore>,
}

impl Bars {
    /// Bars on stderr; `None` if stderr cannot show them.
    pub(super) fn new(best: Arc<BestScore>) -> Option<Self> {
        let all = MultiProgress::new();
        (!all.is_hidden()).then(|| Self { all, bars: BTreeMap::new(), tally: Tally::default(), best })
    }

    fn show(&mut self, stage: Stage, count: Count) {
        let bar = self.bars.entry(stage).or_insert_with(|| {
            let place = Stage::ALL.iter().position(|s| *s == stage).unwrap_or(0);
            let bar = self.all.insert(place, ProgressBar::new(0));
            bar.set_style(style());
            bar.set_prefix(stage.title());
            bar.enable_steady_tick(Duration::from_millis(200));
            bar
        });
        bar.set_length(count.planned * 1000);
        bar.set_position((count.done * 1000 + count.permille).min(count.planned * 1000));
        let best = self.best.get().map(|score| format!("best CSSIM {score:.4}"));
        let best = best.filter(|_| matches!(stage, Stage::Judging | Stage::Polish)).unwrap_or_default();
        let nodes = if count.planned > 1 { format!("{} of {}", count.done, count.planned) } else { String::new() };
        bar.set_message(if best.is_empty() { nodes } else { best });
        if count.is_complete() {
            bar.disable_steady_tick();
            bar.abandon();
        }
    }
}

impl Display for Bars {
    fn event(&mut self, event: &RunEvent) {
        if let Some((stage, count)) = self.tally.note(event) {
            self.show(stage, count);
        }
        if let Some(text) = remark(event) {
            self.say(&text);
        }
    }

    fn say(&mut self, text: &str) {
        if self.all.println(text).is_err() {
            print_line(text);
        }
    }

    fn finish(&mut self, _ending: Ending<'_>) {
        // A finished bar keeps its final time. Drawing it again would show the present time.
        for bar in self.bars.values().filter(|bar| !bar.is_finished()) {
            bar.disable_steady_tick();
            bar.abandon();
        }
    }
}

fn style() -> ProgressStyle {
    // The bar takes the rest of the line: 11 columns on a terminal of 60.
    ProgressStyle::with_template("{prefix:<20} {msg:<17} {elapsed:>4} {percent:>3}% {wide_bar:.cyan/blue}")
        .unwrap_or_else(|_| ProgressStyle::default_bar())
        .progress_chars("━━─")
}
