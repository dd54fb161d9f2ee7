//! The effect of the pixel subset on the score, the distribution of winning gammas, and the gain from polish.

use crate::{
    chart::{Axis, Plot, Series, Spread, SpreadRow, colour},
    document::{Block, Csv, CsvText, Section, Table},
    measured::{Method, Row},
    statistics::{deviation, mean, median, number, range},
    study::{CSSIM, Study},
    text,
    verdict::Verdict,
};
use std::collections::BTreeMap;

const SAMPLES: [u32; 3] = [32, 64, 256];

/// The matches of one cell, one for each seed.
type Cell<'a> = Vec<&'a Row>;

pub(super) fn section(study: &Study<'_>) -> anyhow::Result<Section> {
    let mut section = Section::new("seeds", "Spread over subsets, winning γ, gain of polish");
    let levels: Vec<(u32, Vec<Cell<'_>>)> = SAMPLES
        .into_iter()
        .map(|samples| (samples, cells(study, samples)))
        .filter(|level| !level.1.is_empty())
        .collect();
    if levels.is_empty() {
        section = section.missing("the experiment \"spread\" with several seeds");
    } else {
        spread(&levels, &mut section)?;
    }
    polish(study, &mut section);
    Ok(section)
}

/// The cells that have at least two seeds at a number of samples.
fn cells<'a>(study: &Study<'a>, samples: u32) -> Vec<Cell<'a>> {
    let mut cells: BTreeMap<(&str, &str), Cell<'a>> = BTreeMap::new();
    let meant = |row: &&Row| {
        row.method == Method::Ours
            && row.shown == row.probe
            && row.samples == Some(samples)
            && row.sampling == "importance"
            && (!row.clamped && row.subsets <= 1)
            && (row.size == study.size() && row.metric == CSSIM && row.model == study.model)
            && row.cssim.is_finite()
    };
    for row in study.data.rows.iter().filter(meant) {
        let cell = cells.entry((&row.material, &row.probe)).or_default();
        if cell.iter().all(|other| other.seed != row.seed) {
            cell.push(row);
        }
    }
    cells.into_values().filter(|rows| rows.len() > 1).collect()
}

fn spread(levels: &[(u32, Vec<Cell<'_>>)], section: &mut Section) -> anyhow::Result<()> {
    let columns = [
        "samples",
        "cells",
        "matches",
        "mean CSSIM",
        "mean sd over seeds",
        "largest sd",
        "γ that wins most",
        "how often",
    ];
    let mut table = Table::new("Spread over the seeds of the subset, two stages without polish.", 1, columns);
    let mut rows = Vec::new();
    let mut series = Vec::new();
    for (i, (samples, cells)) in levels.iter().enumerate() {
        let scores = |cell: &Cell<'_>| cell.iter().map(|row| row.cssim).collect::<Vec<f64>>();
        let means: Vec<f64> = cells.iter().filter_map(|cell| mean(&scores(cell))).collect();
        let deviations: Vec<f64> = cells.iter().filter_map(|cell| deviation(&scores(cell))).collect();
        let wins = wins(cells);
        let total: usize = wins.iter().map(|win| win.1).sum();
        let most = wins.iter().max_by(|a, b| a.1.cmp(&b.1).then(b.0.total_cmp(&a.0)));
        table.row([
            samples.to_string(),
            cells.len().to_string(),
            cells.iter().map(Vec::len).sum::<usize>().to_string(),
            text::score(mean(&means)),
            text::score(mean(&deviations)),
            text::score(range(&deviations).map(|range| range.1)),
            text::fixed(most.map(|most| most.0), 2),
            text::share(most.map_or(0, |most| most.1), total),
        ]);
        let around = |cell: &Cell<'_>| {
            let scores = scores(cell);
            let middle = mean(&scores).unwrap_or(f64::NAN);
            scores.into_iter().map(move |score| score - middle).collect::<Vec<f64>>()
        };
        let name = format!("{samples} samples");
        rows.push(SpreadRow { name: name.clone(), colour: colour(i), values: cells.iter().flat_map(around).collect() });
        let points =
            wins.iter().map(|(gamma, count)| (*gamma, 100.0 * number(*count) / number(total.max(1)))).collect();
        series.push(Series { name, colour: colour(i), points, joined: true, minimum: false });
    }
    let label = "CSSIM less the mean of its cell".to_owned();
    let chart = Spread { title: "CSSIM over seeds".to_owned(), label, rows };
    section.figure(
        "Each dot is a seed of one cell; the box is the middle half, the line the median.",
        chart.svg()?,
        seeds_csv(levels),
    );
    let (x, y) = (Axis::linear("γ of the winner"), Axis::from_zero("share of the matches (%)"));
    let plot = Plot { title: "Which γ wins".to_owned(), x, y, series };
    section.figure("How often each γ wins, over all cells and seeds.", plot.svg()?, wins_csv(levels));
    let deviations: Vec<String> =
        table.rows.iter().map(|row| format!("{} at {} samples", row[4].text, row[0].text)).collect();
    section.blocks.push(Block::Table(table));
    section.finding(
        Verdict::Measured,
        format!("The standard deviation of CSSIM over seeds is {} on average over the cells.", text::list(&deviations)),
    );
    Ok(())
}

/// How often each gamma wins, by ascending gamma.
fn wins(cells: &[Cell<'_>]) -> Vec<(f64, usize)> {
    let mut gammas: Vec<f64> = cells.iter().flatten().filter_map(|row| row.gamma).collect();
    gammas.sort_by(f64::total_cmp);
    gammas.chunk_by(|a, b| (a - b).abs() < 1e-9).map(|group| (group[0], group.len())).collect()
}

fn seeds_csv(levels: &[(u32, Vec<Cell<'_>>)]) -> Csv {
    let mut csv = CsvText::new("seeds", ["samples", "material", "light", "seed", "gamma", "cssim"]);
    for row in levels.iter().flat_map(|(_, cells)| cells.iter().flatten()) {
        let samples = row.samples.map_or_else(String::new, |samples| samples.to_string());
        let (seed, gamma) = (row.seed.to_string(), text::exact(row.gamma));
        csv.row([samples, row.material.clone(), row.probe.clone(), seed, gamma, text::exact(Some(row.cssim))]);
    }
    csv.done()
}

fn wins_csv(levels: &[(u32, Vec<Cell<'_>>)]) -> Csv {
    let mut csv = CsvText::new("winning-gamma", ["samples", "gamma", "wins"]);
    for (samples, cells) in levels {
        for (gamma, count) in wins(cells) {
            csv.row([samples.to_string(), text::exact(Some(gamma)), count.to_string()]);
        }
    }
    csv.done()
}

fn polish(study: &Study<'_>, section: &mut Section) {
    let gains: Vec<f64> =
        study.pairs(Method::Ours, Method::OursPolished).iter().map(|(_, ours, polished)| ours - polished).collect();
    let Some((low, high)) = range(&gains) else {
        let needs = "Gain of polish: not in this study: STUDY.toml needs the experiment \"methods\".";
        return section.blocks.push(Block::Missing(needs.to_owned()));
    };
    let words = format!(
        "Polish lowers CSSIM by {} on average and {} in the median of {}, from {} to {}.",
        text::score(mean(&gains)),
        text::score(median(&gains)),
        text::count(gains.len(), "cell"),
        text::score(Some(low)),
        text::score(Some(high))
    );
    section.finding(Verdict::Measured, words);
}
