//! The paper's Figure 3: the full image against 256 samples.

use crate::study::{
    report::{
        chart::{Bars, Group, method_colour},
        differences::GAIN,
        document::{Block, Panel, Section, StripRow, Table},
        statistics::mean,
        study::{Pick, Study},
        text,
        verdict::{self, CELL_SLACK, Verdict},
    },
    row::Method,
};

/// A cell and its scores from samples and from all pixels.
pub(super) type Pair<'a> = ((&'a str, &'a str), f64, f64);

/// The mean difference up to which a match from samples is close to one from all pixels.
const CLOSE: f64 = 0.005;

pub(super) fn section(study: &Study<'_>) -> anyhow::Result<Section> {
    let samples = study.samples.map_or_else(|| "256".to_owned(), |samples| samples.to_string());
    let mut section = Section::new("full", &format!("Figure 3: {samples} samples against the full image"));
    let pairs = pairs(study);
    if pairs.is_empty() {
        return Ok(section.missing("the method \"ours\" with samples \"full\" beside the grid's"));
    }
    let columns = [
        "material".to_owned(),
        "light".to_owned(),
        format!("{samples} samples"),
        "full".to_owned(),
        "difference".to_owned(),
    ];
    let mut table =
        Table::new("CSSIM of two stages without polish; a positive difference is the price of sampling.", 2, columns);
    for ((material, probe), sampled, full) in &pairs {
        let difference = text::signed(Some(sampled - full));
        table.row([
            (*material).to_owned(),
            text::light(probe).to_owned(),
            text::score(Some(*sampled)),
            text::score(Some(*full)),
            difference,
        ]);
    }
    let kinds = vec![
        (format!("{samples} samples"), method_colour(Method::Ours)),
        ("full image".to_owned(), method_colour(Method::OursPolished)),
    ];
    let groups = pairs.iter().map(|(cell, sampled, full)| Group {
        name: text::cell(cell.0, cell.1),
        bars: vec![Some(*sampled), Some(*full)],
    });
    let title = format!("{samples} samples against all pixels");
    let bars = Bars { title, label: "CSSIM (lower is better)".to_owned(), kinds, groups: groups.collect() };
    let caption =
        format!("The photo, its matches, and the absolute difference of each from it, {GAIN} times as bright.");
    section.strip(&caption, strip(study, &pairs, &samples));
    section.figure(
        "CSSIM of the match from samples and of the match from all pixels.",
        bars.svg()?,
        table.csv("fig3-full"),
    );
    section.blocks.push(Block::Table(table));
    let (verdict, words) = claim(&pairs);
    section.finding(verdict, words);
    Ok(section)
}

/// Scores of the cells that have both; of the six, where the study names them.
pub(super) fn pairs<'a>(study: &Study<'a>) -> Vec<Pair<'a>> {
    let six = &study.data.about.six;
    let cells = if six.is_empty() { study.cells() } else { study.cells_of(six) };
    let both = |cell| {
        let full = study.find(&Pick { samples: None, ..study.pick(Method::Ours, cell) })?;
        Some((cell, study.samples.and(study.grid(Method::Ours, cell))?.cssim, full.cssim))
    };
    cells.into_iter().filter_map(both).collect()
}

/// Whether samples come close to all pixels, and the numbers.
pub(super) fn claim(pairs: &[Pair<'_>]) -> (Verdict, String) {
    if pairs.is_empty() {
        return (Verdict::NotDecided, text::ABSENT.to_owned());
    }
    let excess: Vec<f64> = pairs.iter().map(|(_, sampled, full)| sampled - full).collect();
    let worst = pairs.iter().max_by(|a, b| (a.1 - a.2).total_cmp(&(b.1 - b.2)));
    let worst = worst.map_or_else(String::new, |((material, probe), sampled, full)| {
        format!(", at most {} ({})", text::signed(Some(sampled - full)), text::cell(material, probe))
    });
    let words = format!(
        "From samples CSSIM differs by {} from that of all pixels (positive: worse) in the mean of {}{worst}; confirmed up to a \
         mean of {CLOSE:.3}, refuted above {CELL_SLACK:.2}.",
        text::signed(mean(&excess)),
        text::count(pairs.len(), "cell")
    );
    (verdict::between(mean(&excess), CLOSE, CELL_SLACK), words)
}

/// Of each material the first light that has pictures of both.
fn strip(study: &Study<'_>, pairs: &[Pair<'_>], samples: &str) -> Vec<StripRow> {
    let mut rows: Vec<StripRow> = Vec::new();
    let mut done: Vec<&str> = Vec::new();
    for (cell, sampled, full) in pairs {
        let picture = |what| study.picture(*cell, study.size(), what);
        if done.contains(&cell.0) || picture("full").is_none() {
            continue;
        }
        done.push(cell.0);
        let note = |score: &f64| text::score(Some(*score));
        let panels = vec![
            Panel::new("photo", String::new(), picture("photo")),
            Panel::new(&format!("{samples} samples"), note(sampled), picture("ours")),
            Panel::new("full image", note(full), picture("full")),
            Panel::new(&format!("difference of {samples}"), String::new(), picture("difference-ours")),
            Panel::new("difference of full", String::new(), picture("difference-full")),
        ];
        rows.push(StripRow { label: text::cell(cell.0, cell.1), panels });
    }
    rows
}
