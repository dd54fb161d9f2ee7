//! The cost of a match by the number of samples, and compared with brute force.

use crate::{
    chart::{Axis, Plot, Series, method_colour},
    document::{Block, Section, Table},
    measured::{DirectCost, Method},
    statistics::{mean, median, range},
    study::{Match, Pick, Study},
    text,
    verdict::Verdict,
};
use std::collections::BTreeSet;

/// The paper's speed-up of 256 samples over brute force.
pub(super) const PAPER_RATIO: f64 = 10.0;

/// The definition of a second.
pub(super) const SECONDS: &str = "CPU seconds are the wall time from the start of a node on a worker to the arrival of its \
                                  output. Local workers have one thread each. If a worker shares a core with other work, its \
                                  seconds include that work; if a remote worker has several threads, they are counted as one.";
/// The time that the charged seconds do not include.
const SCORE: &str = "about a millisecond at 128 x 128";
/// The paper's start of brute force.
const PAPER_START: &str = "paper";

pub(super) fn section(study: &Study<'_>) -> anyhow::Result<Section> {
    let mut section = Section::new("cost", "Cost");
    let samples = by_samples(study);
    let ratios = ratio_table(study);
    if samples.rows.is_empty() && ratios.rows.is_empty() {
        return Ok(section.missing("the experiment \"methods\", and \"samples\" for the cost of more and fewer pixels"));
    }
    section.text(SECONDS);
    if !samples.rows.is_empty() {
        let (svg, csv) = (draw(study)?, samples.csv("cost-samples"));
        section.figure("Median CPU seconds of a match over the number of samples, tables included.", svg, csv);
        section.blocks.push(Block::Table(samples));
        if let Some(words) = left_out(study) {
            section.text(words);
        }
    }
    if let Some(words) = stage_two(study) {
        section.finding(Verdict::Measured, words);
    }
    if ratios.rows.is_empty() {
        section.blocks.push(Block::Missing(
            "Against brute force: not in this study: STUDY.toml needs the experiment \"methods\".".to_owned(),
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

/// Core-seconds that a search would have taken without tables: its evaluations times the median time of a direct rendering of its cell,
/// otherwise under its light, otherwise of its size. If its size was not measured, the time is scaled by pixels from another size. The
/// time to score each rendering is not included.
pub(super) fn charged(study: &Study<'_>, found: &Match<'_>) -> Option<f64> {
    let row = found.row;
    let direct = &study.data.direct;
    let same_light = |cost: &&DirectCost| cost.probe == row.probe;
    let same_cell = |cost: &&DirectCost| same_light(cost) && cost.material == row.material;
    let seconds = |size: u32| {
        let of = |keep: &dyn Fn(&&DirectCost) -> bool| {
            let costs = direct.iter().filter(|cost| cost.size == size).filter(keep);
            median(&costs.flat_map(|cost| cost.seconds.iter().copied()).collect::<Vec<_>>())
        };
        let with_model = || of(&|cost| same_cell(cost) && cost.model == row.model);
        with_model().or_else(|| of(&same_cell)).or_else(|| of(&same_light)).or_else(|| of(&|_| true))
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

/// Brute force from the paper's start alone.
fn one_start<'a>(study: &Study<'a>, cell: (&str, &str)) -> Option<Match<'a>> {
    let mut rows = study.rows(&study.pick(Method::Brute, cell));
    rows.retain(|row| row.start.as_deref() == Some(PAPER_START));
    Match::best(&rows)
}

/// Charged seconds of brute force, from the paper's start or from all starts, divided by the seconds of a method, for every cell that
/// has both starts and the method.
fn ratios(study: &Study<'_>, method: Method, all_starts: bool) -> Vec<f64> {
    let ratio = |cell| {
        let (ours, one, all) = (study.grid(method, cell)?, one_start(study, cell)?, study.grid(Method::Brute, cell)?);
        let ratio = charged(study, if all_starts { &all } else { &one })? / ours.cpu_seconds;
        ratio.is_finite().then_some(ratio)
    };
    study.cells().into_iter().filter_map(ratio).collect()
}

/// The median over the cells, of one start.
pub(super) fn median_ratio(study: &Study<'_>, method: Method) -> Option<f64> {
    median(&ratios(study, method, false))
}

/// Whether two stages are ten times as cheap as brute force, and the numbers.
pub(super) fn claim(study: &Study<'_>, method: Method) -> (Verdict, String) {
    let ratios = |all_starts| ratios(study, method, all_starts);
    let one = ratios(false);
    if one.is_empty() {
        return (Verdict::NotDecided, text::ABSENT.to_owned());
    }
    let lowest = one.iter().copied().min_by(f64::total_cmp);
    let on_tables = |cell| Some(one_start(study, cell)?.cpu_seconds / study.grid(method, cell)?.cpu_seconds);
    let on_tables: Vec<f64> = study.cells().into_iter().filter_map(on_tables).collect();
    let words = format!(
        "Brute force from one start, the paper's, charged one direct rendering of {} for each evaluation, costs {} times {} \
         (median over {}, lowest {}); from all its starts together {} times; from one start as run, on tables, {} times. The \
         charge does not include the score of each rendering, {SCORE}. The paper has {PAPER_RATIO}; a lower ratio refutes it.",
        samples_per_pixel(study),
        text::significant(median(&one)),
        text::method(method),
        text::count(one.len(), "cell"),
        text::significant(lowest),
        text::significant(median(&ratios(true))),
        text::significant(median(&on_tables))
    );
    (Verdict::of(median(&one).map(|median| median >= PAPER_RATIO)), words)
}

/// As a part of a sentence.
fn samples_per_pixel(study: &Study<'_>) -> String {
    let samples: BTreeSet<u32> = study.data.direct.iter().map(|cost| cost.samples_per_pixel).collect();
    let samples: Vec<String> = samples.into_iter().map(|samples| samples.to_string()).collect();
    format!("{} samples per pixel", text::list(&samples))
}

/// The share of stage two in the time of both stages; the paper calls it negligible.
fn stage_two(study: &Study<'_>) -> Option<String> {
    let share = |cell| {
        let found = study.grid(Method::Ours, cell)?;
        Some(100.0 * found.row.stage_two_seconds? / found.row.cpu_seconds)
    };
    let shares: Vec<f64> = study.cells().into_iter().filter_map(share).filter(|share| share.is_finite()).collect();
    let (low, high) = range(&shares)?;
    Some(format!(
        "Stage two, its table included, takes {} % of the CPU seconds of ours without polish on average over {}, from {} % to \
         {} %; the paper calls it negligible.",
        text::fixed(mean(&shares), 1),
        text::count(shares.len(), "cell"),
        text::fixed(Some(low), 1),
        text::fixed(Some(high), 1)
    ))
}

/// Compares the measured time of a search without tables with its charged time.
fn direct_check(study: &Study<'_>) -> Option<String> {
    let row = study.data.rows.iter().find(|row| row.method == Method::BruteDirect)?;
    let found = Match::best(&[row])?;
    let charged = charged(study, &found)?;
    Some(format!(
        "One search without tables ({}, {size} x {size}) took {} s for {} evaluations of CSSIM; the charge for them is {} s, {} times that.",
        text::cell(&row.material, &row.probe),
        text::significant(Some(row.cpu_seconds)),
        row.evaluations,
        text::significant(Some(charged)),
        text::fixed(Some(charged / row.cpu_seconds), 2),
        size = row.searched_size
    ))
}

/// The numbers of samples that `ours` has in some cell of the grid. All pixels come last, and only if they were tried with as many
/// gammas, because fewer gammas cost less.
fn levels(study: &Study<'_>) -> Vec<Option<u32>> {
    let rows = study.data.rows.iter().filter(|row| row.method == Method::Ours && row.size == study.size());
    let levels: BTreeSet<Option<u32>> = rows.map(|row| row.samples).collect();
    let full = (levels.contains(&None) && left_out(study).is_none()).then_some(None);
    let some = |samples: &Option<u32>| study.cells().into_iter().any(|cell| sampled(study, *samples, cell).is_some());
    levels.into_iter().filter(Option::is_some).chain(full).filter(some).collect()
}

/// Why the column of all pixels is missing, if it is.
fn left_out(study: &Study<'_>) -> Option<String> {
    let gammas = |samples| {
        let of = |cell| Some(sampled(study, samples, cell)?.row.gammas);
        study.cells().into_iter().filter_map(of).min()
    };
    let (full, drawn) = (gammas(None)?, gammas(study.samples)?);
    (full < drawn).then(|| {
        format!(
            "All pixels are left out: they were tried with {full} exponents, samples with {drawn}, which costs more."
        )
    })
}

fn sampled<'a>(study: &Study<'a>, samples: Option<u32>, cell: (&str, &str)) -> Option<Match<'a>> {
    study.find(&Pick { samples, ..study.pick(Method::Ours, cell) })
}

/// The matches of a number of samples in the cells that have all numbers.
fn at<'a>(study: &Study<'a>, samples: Option<u32>) -> Vec<Match<'a>> {
    let levels = levels(study);
    let is_complete = |cell: &(&str, &str)| levels.iter().all(|samples| sampled(study, *samples, *cell).is_some());
    let cells = study.cells().into_iter().filter(is_complete);
    cells.filter_map(|cell| sampled(study, samples, cell)).collect()
}

fn by_samples(study: &Study<'_>) -> Table {
    let columns = ["samples", "cells", "median CPU s", "mean CSSIM", "median evaluations of Eq. 1"];
    let caption =
        "Two stages without polish, by the pixels that stage one sees, over the cells that have all numbers of them.";
    let mut table = Table::new(caption, 1, columns);
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
        "one start: evaluations of CSSIM",
        "one start: charged s",
        "one start: on tables, s",
        "charged / ours",
        "charged / polished",
        "all starts: charged s",
        "all starts / ours",
        "all starts / polished",
    ];
    let caption = "CPU seconds of brute force from the paper's start, then of all its starts together; charged one direct \
                   rendering for each evaluation, without its score.";
    let mut table = Table::new(caption, 2, columns);
    for cell in study.cells() {
        let Some((one, all)) = one_start(study, cell).zip(study.grid(Method::Brute, cell)) else { continue };
        let seconds = |method| study.grid(method, cell).map(|found| found.cpu_seconds);
        let (ours, polished) = (seconds(Method::Ours), seconds(Method::OursPolished));
        let (charged_one, charged_all) = (charged(study, &one), charged(study, &all));
        let ratio = |charged: Option<f64>, seconds: Option<f64>| {
            text::significant(charged.zip(seconds).map(|(charged, seconds)| charged / seconds))
        };
        table.row([
            cell.0.to_owned(),
            text::light(cell.1).to_owned(),
            text::significant(ours),
            text::significant(polished),
            one.evaluations.to_string(),
            text::significant(charged_one),
            text::significant(Some(one.cpu_seconds)),
            ratio(charged_one, ours),
            ratio(charged_one, polished),
            text::significant(charged_all),
            ratio(charged_all, ours),
            ratio(charged_all, polished),
        ]);
    }
    table
}
