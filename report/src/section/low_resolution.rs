//! The paper's Figure 5: brute force on small images against two stages on 32 samples.

use super::cost;
use crate::{
    chart::{Axis, Plot, Series, colour, method_colour},
    document::{Block, Panel, Section, StripRow, Table},
    measured::Method,
    statistics::{mean, median},
    study::{Match, Pick, Study},
    text,
    verdict::{self, Verdict},
};
use std::collections::BTreeSet;

/// The samples that the paper compares.
const SAMPLES: u32 = 32;
/// Number of cells with pictures.
const SHOWN: usize = 3;

pub(super) fn section(study: &Study<'_>) -> anyhow::Result<Section> {
    let mut section = Section::new("low-resolution", "Figure 5: low resolution against 32 samples");
    let images = images(study);
    if images.is_empty() {
        return Ok(section.missing("the experiments \"low-resolution\" and \"samples\""));
    }
    let columns = ["material", "light", "size", "method", "searched at", "CSSIM", "CPU s", "charged s"];
    let mut table = Table::new("Every match.", 5, columns);
    let mut series = Vec::new();
    for image in images.iter().copied() {
        let (rows, drawn) = matches(study, image);
        rows.into_iter().for_each(|row| table.row(row));
        if image == study.size() {
            series = drawn;
        }
    }
    section.text(ONE_START);
    section.strip("The photo and its matches.", strip(study, &sizes(study, study.size())));
    let csv = table.csv("fig5-low-resolution");
    if series.is_empty() {
        section.blocks.push(Block::Data(csv));
    } else {
        let plot = Plot {
            title: "CSSIM at full size over cost".to_owned(),
            x: Axis::log("CPU seconds, charged for low resolution (log scale)"),
            y: Axis::linear("CSSIM (lower is better)"),
            series,
        };
        let size = study.size();
        section.figure(&format!("Each mark is a material under a light, at {size} x {size}."), plot.svg()?, csv);
    }
    section.blocks.push(Block::Table(summary(study, &images)));
    for image in images {
        let (verdict, words) = claim_at(study, image);
        section.finding(verdict, words);
    }
    Ok(section)
}

/// The name of the rival.
const ONE_START: &str = "Low resolution searches from one start, the paper's. It is charged its evaluations of CSSIM at the cost \
                         of a direct rendering of the size that it searched at, without the score.";

/// Rows of the table and marks of the figure, of images of one size.
fn matches(study: &Study<'_>, image: u32) -> (Vec<[String; 8]>, Vec<Series>) {
    let cells = study.places();
    let ours: Vec<_> = cells.iter().filter_map(|cell| Some((*cell, few(study, *cell, image)?))).collect();
    let name = format!("ours, {SAMPLES} samples");
    let seconds = |found: &Match<'_>| found.cpu_seconds;
    let mut rows: Vec<_> = ours.iter().map(|(cell, found)| line(*cell, &name, found, Some(seconds(found)))).collect();
    let points = ours.iter().map(|(_, found)| (seconds(found), found.cssim)).collect();
    let mut series = vec![Series { name, colour: method_colour(Method::Ours), points, joined: false, minimum: false }];
    for (i, size) in sizes(study, image).into_iter().enumerate() {
        let found: Vec<_> = cells.iter().filter_map(|cell| Some((*cell, low(study, *cell, image, size)?))).collect();
        rows.extend(
            found.iter().map(|(cell, found)| line(*cell, "low resolution", found, cost::charged(study, found))),
        );
        let cost = |found: &Match<'_>| cost::charged(study, found).unwrap_or(found.cpu_seconds);
        let points = found.iter().map(|(_, found)| (cost(found), found.cssim)).collect();
        let colour = if i == 0 { method_colour(Method::LowRes) } else { colour([2, 1, 3, 6][i % 4]) };
        series.push(Series { name: format!("low resolution {size}"), colour, points, joined: false, minimum: false });
    }
    (rows, series)
}

/// Whether two stages on 32 samples are sharper than low resolution at the size of the grid, and the numbers.
pub(super) fn claim(study: &Study<'_>) -> (Verdict, String) {
    claim_at(study, study.size())
}

/// The same for images of another size.
fn claim_at(study: &Study<'_>, image: u32) -> (Verdict, String) {
    let mut margins = Vec::new();
    let mut parts = Vec::new();
    for size in sizes(study, image) {
        let of: Vec<f64> = pairs(study, image, size).iter().map(|(few, low)| low.cssim - few.cssim).collect();
        if !of.is_empty() {
            let wins = text::share(of.iter().filter(|margin| **margin > 0.0).count(), of.len());
            parts.push(format!("at {size} pixels in {wins} cells, by {} on average", text::signed(mean(&of))));
        }
        // At the full size of the image, low resolution is brute force itself.
        margins.extend(of.into_iter().filter(|_| size < image));
    }
    if parts.is_empty() {
        return (Verdict::NotDecided, text::ABSENT.to_owned());
    }
    let parts = parts.join("; ");
    let words = format!(
        "On images of {image} x {image}, {SAMPLES} samples beat brute force on low-resolution images, of one start, {parts}; \
         below the full size {}.",
        verdict::rule(&margins)
    );
    (verdict::paired(&margins), words)
}

/// The sizes of images at which both were measured; the grid's size first.
fn images(study: &Study<'_>) -> Vec<u32> {
    let rows = study.data.rows.iter().filter(|row| row.method == Method::LowRes);
    let images: BTreeSet<u32> = rows.map(|row| row.size).collect();
    let measured = |image: &u32| sizes(study, *image).into_iter().any(|size| !pairs(study, *image, size).is_empty());
    let mut images: Vec<u32> = images.into_iter().filter(measured).collect();
    images.sort_by_key(|image| *image != study.size());
    images
}

/// The sizes at which low resolution was searched, for images of a size.
fn sizes(study: &Study<'_>, image: u32) -> BTreeSet<u32> {
    let rows = study.data.rows.iter().filter(|row| row.method == Method::LowRes && row.size == image);
    rows.map(|row| row.searched_size).collect()
}

fn few<'a>(study: &Study<'a>, cell: (&str, &str), size: u32) -> Option<Match<'a>> {
    study.find(&Pick { size, samples: Some(SAMPLES), ..study.pick(Method::Ours, cell) })
}

fn low<'a>(study: &Study<'a>, cell: (&str, &str), size: u32, searched: u32) -> Option<Match<'a>> {
    study.find(&Pick { size, searched_size: Some(searched), ..study.pick(Method::LowRes, cell) })
}

/// The cells that have both: `(32 samples, low resolution)`.
fn pairs<'a>(study: &Study<'a>, image: u32, size: u32) -> Vec<(Match<'a>, Match<'a>)> {
    let both = |cell| Some((few(study, cell, image)?, low(study, cell, image, size)?));
    study.places().into_iter().filter_map(both).collect()
}

fn summary(study: &Study<'_>, images: &[u32]) -> Table {
    let columns = [
        "searched at",
        "image",
        "cells",
        "32 samples",
        "low resolution",
        "CPU s, 32 samples",
        "charged s, low resolution",
    ];
    let mut table = Table::new("Mean CSSIM and median cost over the cells that have both.", 2, columns);
    for image in images {
        for size in sizes(study, *image) {
            let found = pairs(study, *image, size);
            let of =
                |f: &dyn Fn(&(Match<'_>, Match<'_>)) -> Option<f64>| found.iter().filter_map(f).collect::<Vec<f64>>();
            table.row([
                format!("{size} x {size}"),
                format!("{image} x {image}"),
                found.len().to_string(),
                text::score(mean(&of(&|pair| Some(pair.0.cssim)))),
                text::score(mean(&of(&|pair| Some(pair.1.cssim)))),
                text::significant(median(&of(&|pair| Some(pair.0.cpu_seconds)))),
                text::significant(median(&of(&|pair| cost::charged(study, &pair.1)))),
            ]);
        }
    }
    table
}

fn line(cell: (&str, &str), name: &str, found: &Match<'_>, charged: Option<f64>) -> [String; 8] {
    let row = found.row;
    let searched = if row.method == Method::LowRes { row.searched_size } else { row.size };
    [
        cell.0.to_owned(),
        text::light(cell.1).to_owned(),
        row.size.to_string(),
        name.to_owned(),
        searched.to_string(),
        text::exact(Some(found.cssim)),
        text::exact(Some(found.cpu_seconds)),
        text::exact(charged),
    ]
}

fn strip(study: &Study<'_>, sizes: &BTreeSet<u32>) -> Vec<StripRow> {
    let grid = study.size();
    let mut rows = Vec::new();
    for cell in study.cells() {
        let picture = |what: &str| study.picture(cell, grid, what);
        let found: Vec<_> = sizes.iter().filter_map(|size| Some((size, low(study, cell, grid, *size)?))).collect();
        let some = found.iter().any(|(size, _)| picture(&format!("lowres{size}")).is_some());
        if rows.len() == SHOWN || !some {
            continue;
        }
        let mut panels = vec![Panel::new("photo", String::new(), picture("photo"))];
        if let Some(few) = few(study, cell, grid) {
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
