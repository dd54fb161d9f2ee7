//! What a match costs: by the number of samples, and against brute force.

use crate::study::{
    report::{
        chart::{Axis, Plot, Series, method_colour},
        document::{Block, Section, Table},
        statistics::{mean, median},
        study::{Match, Pick, Study},
        text,
        verdict::Verdict,
    },
    row::{DirectCost, Method},
};
use std::collections::BTreeSet;

/// The paper's speed-up of 256 samples over brute force.
pub(super) const PAPER_RATIO: f64 = 10.0;

pub(super) fn section(study: &Study<'_>) -> anyhow::Result<Section> {
    let mut section = Section::new("cost", "Cost");
    let samples = by_samples(study);
    let ratios = ratio_table(study);
    if samples.rows.is_empty() && ratios.rows.is_empty() {
        return Ok(section.missing("the method \"ours\" with several numbers of samples, or the method \"brute\""));
    }
    if !samples.rows.is_empty() {
        let (svg, csv) = (draw(study)?, samples.csv("cost-samples"));
        section.figure("Median CPU seconds of a match over the number of samples, tables included.", svg, csv);
        section.blocks.push(Block::Table(samples));
    }
    if ratios.rows.is_empty() {
        section.blocks.push(Block::Missing(
            "Against brute force: not in this study: STUDY.toml needs the method \"brute\".".to_owned(),
        ));
        return Ok(section);
    }
    let csv = ratios.csv("cost-brute");
    section.blocks.extend([Block::Table(ratios), Block::Data(csv)]);
    for method in [Method::Ours, Method::OursPolished] {
        let (verdict, words) = claim(study, method);
        section.finding(verdict, words);
    }
    if let Some(words) = direct_check(study) {
        section.finding(Verdict::Measured, words);
    }
    Ok(section)
}

/// Seconds of one core that a search would have taken without tables: its evaluations times the median direct rendering
/// and score of its cell, else of its size; scaled by pixels from another size where its own was not measured.
pub(super) fn charged(study: &Study<'_>, found: &Match<'_>) -> Option<f64> {
    let row = found.row;
    let direct = &study.data.direct;
    let same_cell = |cost: &&DirectCost| cost.material == row.material && cost.probe == row.probe;
    let seconds = |size: u32| {
        let of = |keep: &dyn Fn(&&DirectCost) -> bool| {
            let costs = direct.iter().filter(|cost| cost.size == size).filter(keep);
            median(&costs.flat_map(|cost| cost.seconds.iter().copied()).collect::<Vec<_>>())
        };
        of(&|cost| same_cell(cost) && cost.model == row.model).or_else(|| of(&same_cell)).or_else(|| of(&|_| true))
    };
    let nearest = direct.iter().map(|cost| cost.size).min_by_key(|size| size.abs_diff(row.searched_size));
    let scaled = |size: u32| {
        let sides = f64::from(row.searched_size) / f64::from(size.max(1));
        seconds(size).map(|seconds| seconds * sides * sides)
    };
    let one = seconds(row.searched_size).or_else(|| scaled(nearest?))?;
    // Exact below 2^53; a search has some thousands.
    Some(one * f64::from(u32::try_from(found.evaluations).ok()?))
}

/// Charged seconds of brute force over the seconds of a method, in every cell that has both.
fn ratios(study: &Study<'_>, method: Method) -> Vec<f64> {
    let ratio = |cell| {
        let (ours, brute) = (study.grid(method, cell)?, study.grid(Method::Brute, cell)?);
        let ratio = charged(study, &brute)? / ours.cpu_seconds;
        ratio.is_finite().then_some(ratio)
    };
    study.cells().into_iter().filter_map(ratio).collect()
}

/// The median over the cells.
pub(super) fn median_ratio(study: &Study<'_>, method: Method) -> Option<f64> {
    median(&ratios(study, method))
}

/// Whether two stages are ten times as cheap as brute force, and the numbers.
pub(super) fn claim(study: &Study<'_>, method: Method) -> (Verdict, String) {
    let ratios = ratios(study, method);
    if ratios.is_empty() {
        return (Verdict::NotDecided, text::ABSENT.to_owned());
    }
    let lowest = ratios.iter().copied().min_by(f64::total_cmp);
    let on_tables = |cell| Some(study.grid(Method::Brute, cell)?.cpu_seconds / study.grid(method, cell)?.cpu_seconds);
    let on_tables: Vec<f64> = study.cells().into_iter().filter_map(on_tables).collect();
    let words = format!(
        "Brute force, charged one direct rendering for each evaluation, costs {} times {} (median over {}, lowest {}); as run, on tables, {} times; the \
         paper has {PAPER_RATIO}, and less refutes it.",
        text::significant(median(&ratios)),
        text::method(method),
        text::count(ratios.len(), "cell"),
        text::significant(lowest),
        text::significant(median(&on_tables))
    );
    (Verdict::of(median(&ratios).map(|median| median >= PAPER_RATIO)), words)
}

/// The search that was run without tables, against what it is charged.
fn direct_check(study: &Study<'_>) -> Option<String> {
    let row = study.data.rows.iter().find(|row| row.method == Method::BruteDirect)?;
    let found = Match::best(&[row])?;
    let charged = charged(study, &found)?;
    Some(format!(
        "One search truly without tables ({}, {size} x {size}) took {} s for {} evaluations; the charge for them is {} s, {} times that.",
        text::cell(&row.material, &row.probe),
        text::significant(Some(row.cpu_seconds)),
        row.evaluations,
        text::significant(Some(charged)),
        text::fixed(Some(charged / row.cpu_seconds), 2),
        size = row.searched_size
    ))
}

/// The numbers of samples that `ours` has at the grid's size; all pixels last.
fn levels(study: &Study<'_>) -> Vec<Option<u32>> {
    let rows = study.data.rows.iter().filter(|row| row.method == Method::Ours && row.size == study.size());
    let levels: BTreeSet<Option<u32>> = rows.map(|row| row.samples).collect();
    let full = levels.contains(&None).then_some(None);
    levels.into_iter().filter(Option::is_some).chain(full).collect()
}

fn at<'a>(study: &Study<'a>, samples: Option<u32>) -> Vec<Match<'a>> {
    let find = |cell| study.find(&Pick { samples, ..study.pick(Method::Ours, cell) });
    study.cells().into_iter().filter_map(find).collect()
}

fn by_samples(study: &Study<'_>) -> Table {
    let columns = ["samples", "cells", "median CPU s", "mean CSSIM", "median evaluations"];
    let mut table = Table::new("Two stages without polish, by the pixels that stage one sees.", 1, columns);
    for samples in levels(study) {
        let found = at(study, samples);
        let of = |f: &dyn Fn(&Match<'_>) -> f64| found.iter().map(f).collect::<Vec<f64>>();
        if found.is_empty() {
            continue;
        }
        let evaluations = of(&|found| u32::try_from(found.evaluations).map_or(f64::NAN, f64::from));
        table.row([
            samples.map_or_else(|| "full".to_owned(), |samples| samples.to_string()),
            found.len().to_string(),
            text::significant(median(&of(&|found| found.cpu_seconds))),
            text::score(mean(&of(&|found| found.cssim))),
            text::fixed(median(&evaluations), 0),
        ]);
    }
    table
}

fn draw(study: &Study<'_>) -> anyhow::Result<String> {
    let median_at = |samples: Option<u32>| {
        let seconds: Vec<f64> = at(study, samples).iter().map(|found| found.cpu_seconds).collect();
        let pixels = samples.map_or_else(|| f64::from(study.size()) * f64::from(study.size()), f64::from);
        Some((pixels, median(&seconds)?))
    };
    let points = levels(study).into_iter().filter_map(median_at).collect();
    let series = vec![Series {
        name: text::method(Method::Ours).to_owned(),
        colour: method_colour(Method::OursPolished),
        points,
        joined: true,
        minimum: false,
    }];
    let x = Axis::log("pixels that stage one sees (log scale; full: all of the image)");
    let plot = Plot { title: "Cost over samples".to_owned(), x, y: Axis::from_zero("CPU seconds (median)"), series };
    plot.svg()
}

fn ratio_table(study: &Study<'_>) -> Table {
    let columns = [
        "material",
        "light",
        "ours, s",
        "ours + polish, s",
        "brute evaluations",
        "brute, charged s",
        "brute on tables, s",
        "charged / ours",
        "charged / polished",
    ];
    let mut table = Table::new("CPU seconds; brute force is the sum over its starts.", 2, columns);
    for cell in study.cells() {
        let Some(brute) = study.grid(Method::Brute, cell) else { continue };
        let seconds = |method| study.grid(method, cell).map(|found| found.cpu_seconds);
        let (ours, polished) = (seconds(Method::Ours), seconds(Method::OursPolished));
        let charged = charged(study, &brute);
        let ratio =
            |seconds: Option<f64>| text::significant(charged.zip(seconds).map(|(charged, seconds)| charged / seconds));
        table.row([
            cell.0.to_owned(),
            text::light(cell.1).to_owned(),
            text::significant(ours),
            text::significant(polished),
            brute.evaluations.to_string(),
            text::significant(charged),
            text::significant(Some(brute.cpu_seconds)),
            ratio(ours),
            ratio(polished),
        ]);
    }
    table
}
