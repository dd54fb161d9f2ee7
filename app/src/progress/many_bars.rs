//! A batch on a terminal: one bar for all fits, one line each for the first running fits, and above them the fits that have
//! ended.

use super::{
    Display, Ending,
    fits::{FitCount, FitEvent},
    print_line, remark_of_many,
    stage::{Stage, Tally},
};
use indicatif::{MultiProgress, ProgressBar, ProgressStyle};
use lookalike::{fit::BestScore, graph::NodeId, graph::split_label};
use lookalike_coordinator::events::RunEvent;
use std::{collections::BTreeMap, sync::Arc, time::Duration};

/// The most fits that have a line of their own; fewer in a small window.
const MOST_ROWS: usize = 10;
/// Lines of the terminal that are not used for fits.
const OTHER_LINES: usize = 6;
/// The width of a fit's name, in columns.
const NAME_COLUMNS: usize = 30;

pub(super) struct ManyBars {
    all: MultiProgress,
    total: ProgressBar,
    /// The number of running fits without a line.
    more: ProgressBar,
    count: FitCount,
    fits: BTreeMap<u32, Row>,
    numbers: BTreeMap<String, u32>,
    /// The fits that the running nodes belong to.
    owners: BTreeMap<NodeId, u32>,
}

/// A running fit.
struct Row {
    name: String,
    best: Arc<BestScore>,
    tally: Tally,
    /// `None` while there are too many fits.
    bar: Option<ProgressBar>,
}

impl ManyBars {
    /// Bars on stderr; `None` if stderr cannot show them.
    pub(super) fn new(total: usize) -> Option<Self> {
        let all = MultiProgress::new();
        if all.is_hidden() {
            return None;
        }
        let bar = all.add(ProgressBar::new(total as u64));
        bar.set_style(style("{prefix:<30} {msg:<34} {elapsed:>4} {percent:>3}% {wide_bar:.green/blue}"));
        bar.set_prefix("fits");
        bar.enable_steady_tick(Duration::from_millis(200));
        let more = all.add(ProgressBar::no_length());
        more.set_style(style("{msg}"));
        let count = FitCount { total, ..FitCount::default() };
        bar.set_message(count.text());
        let (fits, numbers, owners) = Default::default();
        Some(Self { all, total: bar, more, count, fits, numbers, owners })
    }

    /// Gives bars to the first fits that have none, as far as there is room.
    fn fill(&mut self) {
        let height = usize::from(console_height());
        let most = MOST_ROWS.min(height.saturating_sub(OTHER_LINES)).max(1);
        let mut shown = self.fits.values().filter(|row| row.bar.is_some()).count();
        // Fits begin in order, so a new row goes last.
        for row in self.fits.values_mut() {
            if shown >= most {
                break;
            }
            if row.bar.is_none() {
                let bar = self.all.insert_before(&self.total, ProgressBar::new(1000));
                bar.set_style(style("{prefix:<30} {msg:<34} {percent:>8}% {wide_bar:.cyan/blue}"));
                bar.set_prefix(shortened(&row.name));
                row.bar = Some(bar);
                row.show();
                shown += 1;
            }
        }
        let hidden = self.fits.len() - shown;
        self.more.set_message(if hidden > 0 { format!("and {hidden} more running") } else { String::new() });
    }

    /// Removes a row.
    fn clear(&self, row: Row) {
        if let Some(bar) = row.bar {
            bar.finish_and_clear();
            self.all.remove(&bar);
        }
    }

    fn end(&mut self, number: u32, event: &FitEvent) {
        if let Some(row) = self.fits.remove(&number) {
            self.numbers.remove(&row.name);
            self.clear(row);
        }
        self.owners.retain(|_, owner| *owner != number);
        if let Some(line) = event.line() {
            self.say(&line);
        }
    }
}

impl Row {
    fn show(&self) {
        let (Some(bar), Some((stage, count))) = (&self.bar, self.tally.latest()) else { return };
        let best = self.best.get().filter(|_| stage >= Stage::Judging);
        bar.set_message(match (best, count.planned) {
            (Some(best), _) => format!("{}, best {best:.4}", stage.title()),
            (None, 0..=1) => stage.title().to_owned(),
            (None, planned) => format!("{}, {} of {planned}", stage.title(), count.done),
        });
        bar.set_position(count.thousandths());
    }
}

impl Display for ManyBars {
    fn event(&mut self, event: &RunEvent) {
        let owner = match event {
            RunEvent::NodeAdded { name }
            | RunEvent::NodeFinished { name, .. }
            | RunEvent::NodeRecalled { name, .. } => {
                split_label(&name.label).0.and_then(|fit| self.numbers.get(fit)).copied()
            }
            RunEvent::NodeProgress { node, .. } => self.owners.get(node).copied(),
            _ => None,
        };
        if let (RunEvent::NodeAdded { name }, Some(owner)) = (event, owner) {
            self.owners.insert(name.node, owner);
        }
        if let Some(row) = owner.and_then(|owner| self.fits.get_mut(&owner))
            && row.tally.note(event).is_some()
        {
            row.show();
        }
        if let Some(text) = remark_of_many(event) {
            self.say(&text);
        }
    }

    fn fit(&mut self, event: &FitEvent, count: FitCount) {
        match event {
            FitEvent::Started { number, name, best } => {
                let (name, best) = (name.clone(), Arc::clone(best));
                self.numbers.insert(name.clone(), *number);
                self.fits.insert(*number, Row { name, best, tally: Tally::default(), bar: None });
            }
            FitEvent::Finished { number, .. } | FitEvent::Failed { number, .. } => self.end(*number, event),
        }
        self.count = count;
        self.total.set_position((count.done + count.failed) as u64);
        self.total.set_message(count.text());
        self.fill();
    }

    fn say(&mut self, text: &str) {
        if self.all.println(text).is_err() {
            print_line(text);
        }
    }

    fn finish(&mut self, _ending: Ending<'_>) {
        for row in std::mem::take(&mut self.fits).into_values() {
            self.clear(row);
        }
        self.more.finish_and_clear();
        self.total.disable_steady_tick();
        self.total.abandon();
    }
}

/// A name cut to the width of its column.
fn shortened(name: &str) -> String {
    if name.chars().count() <= NAME_COLUMNS {
        return name.to_owned();
    }
    name.chars().take(NAME_COLUMNS - 1).chain(['…']).collect()
}

fn console_height() -> u16 {
    console::Term::stderr().size().0
}

fn style(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar()).progress_chars("━━─")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_names_are_cut_to_their_column() {
        assert_eq!(shortened("gold-garden-ggx"), "gold-garden-ggx");
        let long = shortened("gold-metallic-paint3-grace_cross-cook-torrance");
        assert_eq!((long.chars().count(), long.as_str()), (NAME_COLUMNS, "gold-metallic-paint3-grace_cr…"));
    }
}
