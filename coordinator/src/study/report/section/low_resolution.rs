//! The paper's Figure 5: brute force on small images against two stages on 32 samples.

use super::cost;
use crate::study::{
    report::{
        chart::{Axis, Plot, Series, colour, method_colour},
        document::{Block, Panel, Section, StripRow, Table},
        statistics::{mean, median},
        study::{Match, Pick, Study},
        text,
        verdict::{self, PAIRED_RULE, Verdict},
    },
    row::Method,
};
use std::collections::BTreeSet;

/// The samples that the paper compares.
const SAMPLES: u32 = 32;
/// Pictures of so many cells.
const SHOWN: usize = 3;

pub(super) fn section(study: &Study<'_>) -> anyhow::Result<Section> {
    let mut section = Section::new("low-resolution", "Figure 5: low resolution against 32 samples");
    let sizes = sizes(study);
    if sizes.is_empty() || sizes.iter().all(|size| pairs(study, *size).is_empty()) {
        return Ok(section.missing("the method \"lowres\" and the method \"ours\" with 32 samples on the same cells"));
    }
    let cells = study.cells();
    let ours: Vec<_> = cells.iter().filter_map(|cell| Some((*cell, few(study, *cell)?))).collect();
    let columns = ["material", "light", "method", "searched at", "CSSIM", "CPU s", "charged s"];
    let mut table = Table::new(
        "Low resolution is charged its evaluations at the cost of a direct rendering of that size, by pixels.",
        4,
        columns,
    );
    let mut series = vec![Series {
        name: format!("ours, {SAMPLES} samples"),
        colour: method_colour(Method::Ours),
        points: ours.iter().map(|(_, found)| (found.cpu_seconds, found.cssim)).collect(),
        joined: false,
        minimum: false,
    }];
    for (cell, found) in &ours {
        table.row(line(study, *cell, &format!("ours, {SAMPLES} samples"), found, Some(found.cpu_seconds)));
    }
    for (i, size) in sizes.iter().enumerate() {
        let found: Vec<_> = cells.iter().filter_map(|cell| Some((*cell, low(study, *cell, *size)?))).collect();
        for (cell, found) in &found {
            table.row(line(study, *cell, "low resolution", found, cost::charged(study, found)));
        }
        let cost = |found: &Match<'_>| cost::charged(study, found).unwrap_or(found.cpu_seconds);
        let points = found.iter().map(|(_, found)| (cost(found), found.cssim)).collect();
        let colour = if i == 0 { method_colour(Method::LowRes) } else { colour([2, 1, 3, 6][i % 4]) };
        series.push(Series { name: format!("low resolution {size}"), colour, points, joined: false, minimum: false });
    }
    section.strip("The photo and its matches.", strip(study, &sizes));
    let plot = Plot {
        title: "CSSIM at full size over cost".to_owned(),
        x: Axis::log("CPU seconds, charged for low resolution (log scale)"),
        y: Axis::linear("CSSIM (lower is better)"),
        series,
    };
    section.figure("Each mark is a material under a light.", plot.svg()?, table.csv("fig5-low-resolution"));
    section.blocks.push(Block::Table(summary(study, &sizes)));
    let (verdict, words) = claim(study);
    section.finding(verdict, words);
    Ok(section)
}

/// Whether two stages on 32 samples are sharper than low resolution, and the numbers.
pub(super) fn claim(study: &Study<'_>) -> (Verdict, String) {
    let mut margins = Vec::new();
    let mut parts = Vec::new();
    for size in sizes(study) {
        let of: Vec<f64> = pairs(study, size).iter().map(|(few, low)| low - few).collect();
        if !of.is_empty() {
            let wins = text::share(of.iter().filter(|margin| **margin > 0.0).count(), of.len());
            parts.push(format!("at {size} pixels in {wins} cells, by {} in the mean", text::signed(mean(&of))));
        }
        // At the size of the grid it is brute force itself.
        margins.extend(of.into_iter().filter(|_| size < study.size()));
    }
    if parts.is_empty() {
        return (Verdict::NotDecided, text::ABSENT.to_owned());
    }
    let parts = parts.join("; ");
    let words = format!(
        "{SAMPLES} samples beat brute force on low-resolution images {parts}; below the full size {PAIRED_RULE}."
    );
    (verdict::paired(&margins), words)
}

/// The sizes that low resolution was searched at.
fn sizes(study: &Study<'_>) -> BTreeSet<u32> {
    let rows = study.data.rows.iter().filter(|row| row.method == Method::LowRes && row.size == study.size());
    rows.map(|row| row.searched_size).collect()
}

fn few<'a>(study: &Study<'a>, cell: (&str, &str)) -> Option<Match<'a>> {
    study.find(&Pick { samples: Some(SAMPLES), ..study.pick(Method::Ours, cell) })
}

fn low<'a>(study: &Study<'a>, cell: (&str, &str), size: u32) -> Option<Match<'a>> {
    study.find(&Pick { searched_size: Some(size), ..study.pick(Method::LowRes, cell) })
}

/// CSSIM of the cells that have both: `(32 samples, low resolution)`.
fn pairs(study: &Study<'_>, size: u32) -> Vec<(f64, f64)> {
    let both = |cell| Some((few(study, cell)?.cssim, low(study, cell, size)?.cssim));
    study.cells().into_iter().filter_map(both).collect()
}

fn summary(study: &Study<'_>, sizes: &BTreeSet<u32>) -> Table {
    let columns =
        ["searched at", "cells", "32 samples", "low resolution", "CPU s, 32 samples", "charged s, low resolution"];
    let mut table = Table::new("Mean CSSIM and median cost over the cells that have both.", 1, columns);
    for size in sizes {
        let found = |cell| Some((few(study, cell)?, low(study, cell, *size)?));
        let found: Vec<_> = study.cells().into_iter().filter_map(found).collect();
        let of = |f: &dyn Fn(&(Match<'_>, Match<'_>)) -> Option<f64>| found.iter().filter_map(f).collect::<Vec<f64>>();
        table.row([
            format!("{size} x {size}"),
            found.len().to_string(),
            text::score(mean(&of(&|pair| Some(pair.0.cssim)))),
            text::score(mean(&of(&|pair| Some(pair.1.cssim)))),
            text::significant(median(&of(&|pair| Some(pair.0.cpu_seconds)))),
            text::significant(median(&of(&|pair| cost::charged(study, &pair.1)))),
        ]);
    }
    table
}

fn line(study: &Study<'_>, cell: (&str, &str), name: &str, found: &Match<'_>, charged: Option<f64>) -> [String; 7] {
    let searched = if found.row.method == Method::LowRes { found.row.searched_size } else { study.size() };
    [
        cell.0.to_owned(),
        text::light(cell.1).to_owned(),
        name.to_owned(),
        searched.to_string(),
        text::exact(Some(found.cssim)),
        text::exact(Some(found.cpu_seconds)),
        text::exact(charged),
    ]
}

fn strip(study: &Study<'_>, sizes: &BTreeSet<u32>) -> Vec<StripRow> {
    let mut rows = Vec::new();
    for cell in study.cells() {
        let picture = |what: &str| study.picture(cell, study.size(), what);
        let found: Vec<_> = sizes.iter().filter_map(|size| Some((size, low(study, cell, *size)?))).collect();
        let some = found.iter().any(|(size, _)| picture(&format!("lowres{size}")).is_some());
        if rows.len() == SHOWN || !some {
            continue;
        }
        let mut panels = vec![Panel::new("photo", String::new(), picture("photo"))];
        if let Some(few) = few(study, cell) {
            let note = text::score(Some(few.cssim));
            panels.push(Panel::new(&format!("ours, {SAMPLES} samples"), note, picture("samples32")));
        }
        panels.extend(found.iter().map(|(size, found)| {
            let note = text::score(Some(found.cssim));
            Panel::new(&format!("low resolution {size}"), note, picture(&format!("lowres{size}")))
        }));
        rows.push(StripRow { label: text::cell(cell.0, cell.1), panels });
    }
    rows
}
