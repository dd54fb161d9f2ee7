//! Bars on a terminal: one per stage of the only fit; of many fits or cells one for all, one line each for the first running ones,
//! and above them those that have ended.

use super::{
    Display, Ending,
    parts::{HINT, PartCount, PartEvent, Shape},
    print_line,
    remarks::Remarks,
    rows::{Row, Rows},
    stage::{Count, Stage},
};
use indicatif::{MultiProgress, ProgressBar, ProgressStyle};
use lookalike_coordinator::events::RunEvent;
use std::{collections::BTreeMap, time::Duration};

/// The most parts that have a line of their own; fewer in a small window.
const MOST_ROWS: usize = 10;
/// Lines of the terminal that are not used for parts.
const OTHER_LINES: usize = 6;
/// The columns of a terminal that has room for how to read a score.
const WIDE_COLUMNS: u16 = 80;
/// The width of a part's name, in columns.
const NAME_COLUMNS: usize = 30;

pub(super) struct Bars {
    remarks: Remarks,
    all: MultiProgress,
    rows: Rows,
    /// By number of the part, or by place of the stage.
    bars: BTreeMap<u32, ProgressBar>,
    /// All parts, and the number of running ones without a line; `None` for one fit.
    total: Option<(ProgressBar, ProgressBar)>,
}

impl Bars {
    /// Bars on stderr.
    ///
    /// # Errors
    /// The remarks, if stderr cannot show bars.
    pub(super) fn new(remarks: Remarks) -> Result<Self, Remarks> {
        let all = MultiProgress::new();
        if all.is_hidden() {
            return Err(remarks);
        }
        let total = match remarks.shape {
            Shape::OneFit => None,
            Shape::Many { noun, total, done } => {
                let bar = all.add(ProgressBar::new(total as u64));
                bar.set_style(style("{prefix:<30} {msg:<34} {elapsed:>4} {percent:>3}% {wide_bar:.green/blue}"));
                bar.set_prefix(format!("{noun}s"));
                bar.set_message(PartCount { total, done, ..PartCount::default() }.text());
                bar.set_position(done as u64);
                bar.enable_steady_tick(Duration::from_millis(200));
                let more = all.add(ProgressBar::no_length());
                more.set_style(style("{msg}"));
                Some((bar, more))
            }
        };
        Ok(Self { remarks, all, rows: Rows::default(), bars: BTreeMap::new(), total })
    }

    /// The bar of a stage of the only fit.
    fn stage_bar(all: &MultiProgress, stage: Stage) -> ProgressBar {
        let bar = all.insert(stage.place().into(), ProgressBar::new(0));
        // The bar takes the rest of the line: 11 columns on a terminal of 60, 15 on one of 80.
        let message = if is_wide() { "{msg:<33}" } else { "{msg:<17}" };
        bar.set_style(style(&format!(
            "{{prefix:<20}} {message} {{elapsed:>4}} {{percent:>3}}% {{wide_bar:.cyan/blue}}"
        )));
        bar.set_prefix(stage.title());
        bar.enable_steady_tick(Duration::from_millis(200));
        bar
    }

    /// Gives bars to the first parts that have none, as far as there is room.
    fn fill(&mut self) {
        let Some((total, more)) = &self.total else { return };
        let height = usize::from(console::Term::stderr().size().0);
        let most = MOST_ROWS.min(height.saturating_sub(OTHER_LINES)).max(1);
        // A new row goes last.
        for (number, row) in &self.rows.running {
            if self.bars.len() >= most {
                break;
            }
            self.bars.entry(*number).or_insert_with(|| {
                let bar = self.all.insert_before(total, ProgressBar::new(1000));
                bar.set_style(style("{prefix:<30} {msg:<34} {percent:>8}% {wide_bar:.cyan/blue}"));
                bar.set_prefix(shortened(&row.name));
                show_part(&bar, row);
                bar
            });
        }
        let hidden = self.rows.running.len() - self.bars.len();
        more.set_message(if hidden > 0 { format!("and {hidden} more running") } else { String::new() });
    }
}

impl Display for Bars {
    fn event(&mut self, event: &RunEvent) {
        if let Some((number, row, stage, count)) = self.rows.note(event) {
            match self.remarks.shape {
                Shape::OneFit => {
                    let bar = self.bars.entry(u32::from(stage.place()));
                    show_stage(bar.or_insert_with(|| Self::stage_bar(&self.all, stage)), row, stage, count);
                }
                Shape::Many { .. } => self.bars.get(&number).into_iter().for_each(|bar| show_part(bar, row)),
            }
        }
        if let Some(text) = self.remarks.line(event) {
            self.say(&text);
        }
    }

    fn part(&mut self, event: &PartEvent, count: PartCount) {
        self.rows.part(event);
        let Some((total, _)) = &self.total else { return };
        total.set_position((count.done + count.failed) as u64);
        total.set_message(count.text());
        if let PartEvent::Finished { number, .. } | PartEvent::Failed { number, .. } = event
            && let Some(bar) = self.bars.remove(number)
        {
            bar.finish_and_clear();
            self.all.remove(&bar);
        }
        if let Some(line) = event.line() {
            self.say(&line);
        }
        self.fill();
    }

    fn say(&mut self, text: &str) {
        if self.all.println(text).is_err() {
            print_line(text);
        }
    }

    fn finish(&mut self, _ending: Ending<'_>) {
        let Some((total, more)) = &self.total else {
            // A finished bar keeps its final time. Drawing it again would show the present time.
            for bar in self.bars.values().filter(|bar| !bar.is_finished()) {
                bar.disable_steady_tick();
                bar.abandon();
            }
            return;
        };
        for bar in std::mem::take(&mut self.bars).into_values() {
            bar.finish_and_clear();
            self.all.remove(&bar);
        }
        more.finish_and_clear();
        total.disable_steady_tick();
        total.abandon();
    }
}

fn show_stage(bar: &ProgressBar, row: &Row, stage: Stage, count: Count) {
    bar.set_length(count.planned * 1000);
    bar.set_position((count.done * 1000 + count.permille).min(count.planned * 1000));
    let nodes = || if count.planned > 1 { format!("{} of {}", count.done, count.planned) } else { String::new() };
    let hint = if is_wide() { HINT } else { "" };
    bar.set_message(row.best_at(stage).map_or_else(nodes, |score| format!("best CSSIM {score:.4}{hint}")));
    if count.is_complete() {
        bar.disable_steady_tick();
        bar.abandon();
    }
}

fn show_part(bar: &ProgressBar, row: &Row) {
    let Some((stage, count)) = row.latest() else { return };
    bar.set_message(match (row.best_at(stage), count.planned) {
        (Some(best), _) => format!("{}, best CSSIM {best:.4}", stage.title()),
        (None, 0..=1) => stage.title().to_owned(),
        (None, planned) => format!("{}, {} of {planned}", stage.title(), count.done),
    });
    bar.set_position(count.thousandths());
}

/// Whether the terminal has room for how to read a score.
fn is_wide() -> bool {
    console::Term::stderr().size().1 >= WIDE_COLUMNS
}

/// A name cut to the width of its column.
fn shortened(name: &str) -> String {
    if name.chars().count() <= NAME_COLUMNS {
        return name.to_owned();
    }
    name.chars().take(NAME_COLUMNS - 1).chain(['…']).collect()
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
