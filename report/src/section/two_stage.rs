//! The paper's Figure 1: two stages against brute force on CSSIM.

use super::cost;
use crate::{
    document::{Block, Panel, Section, StripRow, Table},
    measured::Method,
    study::{Match, Pick, Study},
    text,
    verdict::{self, Verdict},
};

/// Number of cells in the paper's figure.
const SHOWN: usize = 3;
/// The compared methods, in the order of the pictures.
const METHODS: [Method; 3] = [Method::Ours, Method::OursPolished, Method::Brute];

/// A material, a light and a size.
type Shown<'a> = ((&'a str, &'a str), u32);

pub(super) fn section(study: &Study<'_>) -> anyhow::Result<Section> {
    let mut section = Section::new("two-stage", "Figure 1: two stages against brute force");
    let shown = shown(study);
    if shown.is_empty() {
        return Ok(section.missing("the experiment \"methods\""));
    }
    let columns = ["material", "light", "size", "method", "CSSIM", "evaluations", "of", "CPU s", "charged s"];
    let caption = "Brute force has the best score of its starts and the sum of their costs. Charged: its evaluations times the median \
                   seconds of one direct rendering, without its score; for the two stages, the CPU seconds themselves.";
    let mut table = Table::new(caption, 4, columns);
    let mut strip = Vec::new();
    let mut pairs = Vec::new();
    for (cell, size) in &shown {
        for method in METHODS {
            if let Some(found) = at(study, *cell, *size, method) {
                table.row(line(study, (*cell, *size), method, &found));
            }
        }
        let score = |method| at(study, *cell, *size, method).map(|found| found.cssim);
        let ours = score(Method::OursPolished).or_else(|| score(Method::Ours));
        pairs.extend(ours.zip(score(Method::Brute)));
        strip.push(strip_row(study, (*cell, *size)));
    }
    section.strip("The photo and its matches.", strip);
    let csv = table.csv("fig1-two-stage");
    section.blocks.extend([Block::Table(table), Block::Data(csv)]);
    let margins: Vec<String> = pairs.iter().map(|(ours, brute)| text::signed(Some(ours - brute))).collect();
    section.finding(
        verdict::no_worse(&pairs),
        format!(
            "On these cells our best match differs from the best of brute force by {} (negative: ours is better); confirmed if \
             the mean is at most {:.3} and no difference is above {:.2}.",
            text::list(&margins),
            verdict::MEAN_SLACK,
            verdict::CELL_SLACK
        ),
    );
    if let Some(ratio) = cost::median_ratio(study, Method::Ours) {
        let words = format!(
            "Over the whole grid brute force from the paper's start alone costs {} times the two stages (median; charged one direct rendering for each evaluation).",
            text::significant(Some(ratio))
        );
        section.finding(Verdict::Measured, words);
    }
    Ok(section)
}

/// The first cells with brute force, at the largest size that has it, then at the next size.
fn shown<'a>(study: &Study<'a>) -> Vec<Shown<'a>> {
    let mut sizes: Vec<u32> =
        study.data.rows.iter().filter(|row| row.method == Method::Brute).map(|row| row.size).collect();
    sizes.sort_unstable_by(|a, b| b.cmp(a));
    sizes.dedup();
    let about = &study.data.about;
    let cells = about.materials.iter().flat_map(|m| about.probes.iter().map(move |p| (m.as_str(), p.as_str())));
    let cells: Vec<_> = cells.collect();
    let mut shown: Vec<Shown<'a>> = Vec::new();
    for size in sizes {
        for cell in &cells {
            let there = |method| at(study, *cell, size, method).is_some();
            let new = shown.iter().all(|(other, _)| other != cell);
            if new && there(Method::Brute) && (there(Method::Ours) || there(Method::OursPolished)) {
                shown.push((*cell, size));
            }
        }
    }
    // Prefer different lights, because they add more information.
    let mut chosen: Vec<Shown<'a>> = Vec::new();
    for (cell, size) in &shown {
        if chosen.iter().all(|((material, probe), _)| *material != cell.0 && *probe != cell.1) {
            chosen.push((*cell, *size));
        }
    }
    let rest: Vec<_> = shown.iter().filter(|one| !chosen.contains(one)).copied().collect();
    chosen.into_iter().chain(rest).take(SHOWN).collect()
}

fn at<'a>(study: &Study<'a>, cell: (&str, &str), size: u32, method: Method) -> Option<Match<'a>> {
    study.find(&Pick { size, ..study.pick(method, cell) })
}

fn line(study: &Study<'_>, (cell, size): Shown<'_>, method: Method, found: &Match<'_>) -> [String; 9] {
    let charged = if method == Method::Brute { cost::charged(study, found) } else { Some(found.cpu_seconds) };
    [
        cell.0.to_owned(),
        text::light(cell.1).to_owned(),
        size.to_string(),
        text::method(method).to_owned(),
        text::score(Some(found.cssim)),
        found.evaluations.to_string(),
        text::minimised(method).to_owned(),
        text::significant(Some(found.cpu_seconds)),
        text::significant(charged),
    ]
}

fn strip_row(study: &Study<'_>, (cell, size): Shown<'_>) -> StripRow {
    let photo = Panel::new("photo", String::new(), study.picture(cell, size, "photo"));
    let panels = METHODS.into_iter().filter_map(|method| {
        let found = at(study, cell, size, method)?;
        let charged = if method == Method::Brute { cost::charged(study, &found) } else { None };
        let seconds = text::significant(charged.or(Some(found.cpu_seconds)));
        let note = format!("{} · {seconds} s", text::score(Some(found.cssim)));
        Some(Panel::new(text::method(method), note, study.picture(cell, size, method.name())))
    });
    StripRow {
        label: format!("{}, {size} x {size}", text::cell(cell.0, cell.1)),
        panels: std::iter::once(photo).chain(panels).collect(),
    }
}
