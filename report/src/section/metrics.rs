//! The same matches under variants of the metric and at another size: whether the conclusions hold, and which variant is nearest to the
//! numbers of the paper.

use super::table_one::paper_256;
use crate::{
    document::{Block, Section, Table},
    measured::Method,
    statistics::mean,
    study::{CSSIM, Pick, Study},
    text,
    verdict::Verdict,
};
use lookalike::brdf::PAPER_MODEL;
use std::collections::BTreeSet;

const METHODS: [Method; 3] = [Method::OursPolished, Method::Brute, Method::L2];

/// A material under a light.
type Cell<'a> = (&'a str, &'a str);

pub(super) fn section(study: &Study<'_>) -> anyhow::Result<Section> {
    let mut section = Section::new("metrics", "Variants of the metric");
    let named = named(study);
    let cells: Vec<(String, Vec<Cell<'_>>)> =
        named.into_iter().map(|name| (name.to_owned(), complete(study, name, study.size()))).collect();
    let Some(most) =
        cells.iter().map(|(_, cells)| cells).max_by_key(|cells| cells.len()).filter(|most| !most.is_empty())
    else {
        section = section.missing("the experiment \"methods\", on a grid of 44 pixels at least");
        sizes(study, &mut section);
        nearest(study, &mut section);
        return Ok(section);
    };
    let mut variants = vec![variant(study, CSSIM, most, study.size())];
    let (same, fewer): (Vec<_>, Vec<_>) = cells.iter().partition(|(_, cells)| cells == most);
    variants.extend(same.iter().map(|(name, _)| variant(study, name, most, study.size())));
    let methods: Vec<usize> =
        (0..METHODS.len()).filter(|i| variants.iter().all(|variant| variant.means[*i].is_some())).collect();
    let (table, orders) =
        table(&methods, &variants, "Mean score over the cells that every metric has; the best in bold.");
    let csv = table.csv("metrics");
    section.blocks.extend([Block::Table(table), Block::Data(csv)]);
    let fewer: Vec<Variant> = fewer
        .iter()
        .filter(|(_, cells)| !cells.is_empty())
        .map(|(name, cells)| variant(study, name, cells, study.size()))
        .collect();
    if !fewer.is_empty() {
        let caption = "Metrics that only some cells have, over those cells; they do not count for the verdict.";
        section.blocks.push(Block::Table(self::table(&methods, &fewer, caption).0));
    }
    let holds = (methods.len() > 1).then_some(orders.len() == 1);
    let words = format!(
        "The order of the methods is {} under {}; confirmed if it is the same under all.",
        orders.into_iter().collect::<Vec<_>>().join(", or "),
        text::count(variants.len(), "metric")
    );
    section.finding(Verdict::of(holds), words);
    sizes(study, &mut section);
    nearest(study, &mut section);
    Ok(section)
}

/// Mean scores by [`METHODS`].
struct Variant {
    name: String,
    cells: usize,
    means: [Option<f64>; 3],
}

/// The variants of the metric for matches of the grid's size.
fn named<'a>(study: &Study<'a>) -> BTreeSet<&'a str> {
    let is_variant =
        |row: &&crate::measured::Row| row.metric != CSSIM && row.size == study.size() && METHODS.contains(&row.method);
    study.data.rows.iter().filter(is_variant).map(|row| row.metric.as_str()).collect()
}

fn score(study: &Study<'_>, metric: &str, size: u32, method: Method, cell: Cell<'_>) -> Option<f64> {
    Some(study.find(&Pick { metric, size, model: Some(&study.model), ..study.pick(method, cell) })?.cssim)
}

/// The cells that have every method that some cell has.
fn complete<'a>(study: &Study<'a>, metric: &str, size: u32) -> Vec<Cell<'a>> {
    let has = |method: Method, cell: Cell<'_>| score(study, metric, size, method, cell).is_some();
    let places = study.places();
    let there: Vec<Method> =
        METHODS.into_iter().filter(|method| places.iter().any(|cell| has(*method, *cell))).collect();
    let is_complete = |cell: &Cell<'a>| !there.is_empty() && there.iter().all(|method| has(*method, *cell));
    places.iter().copied().filter(is_complete).collect()
}

fn variant(study: &Study<'_>, metric: &str, cells: &[Cell<'_>], size: u32) -> Variant {
    let means = METHODS.map(|method| {
        let scores: Vec<f64> = cells.iter().filter_map(|cell| score(study, metric, size, method, *cell)).collect();
        mean(&scores).filter(|_| scores.len() == cells.len())
    });
    Variant { name: metric.to_owned(), cells: cells.len(), means }
}

/// The table of some metrics, and the orders of the methods in it.
fn table(methods: &[usize], variants: &[Variant], caption: &str) -> (Table, BTreeSet<String>) {
    let names = methods.iter().map(|i| text::method(METHODS[*i]));
    let columns = ["metric", "order, best first", "cells"].into_iter().chain(names);
    let mut table = Table::new(caption, 2, columns);
    let mut orders = BTreeSet::new();
    for variant in variants {
        let means: Vec<Option<f64>> = methods.iter().map(|i| variant.means[*i]).collect();
        let order = order(methods, &means);
        table.scores([variant.name.clone(), order.clone(), variant.cells.to_string()], &means);
        orders.insert(order);
    }
    (table, orders)
}

/// Plain CSSIM at other sizes, compared with the same cells at the grid's size.
fn sizes(study: &Study<'_>, section: &mut Section) {
    let rows = study.data.rows.iter().filter(|row| row.method == Method::OursPolished && row.metric == CSSIM);
    let others: BTreeSet<u32> = rows.map(|row| row.size).filter(|size| *size != study.size()).collect();
    let names = METHODS.map(text::method);
    let mut table = Table::new(
        "How CSSIM depends on the size of the image: the same cells at two sizes.",
        2,
        ["size", "cells"].into_iter().chain(names),
    );
    for size in others {
        let grid = |cell: &Cell<'_>| score(study, CSSIM, study.size(), Method::OursPolished, *cell).is_some();
        let cells: Vec<Cell<'_>> = complete(study, CSSIM, size).into_iter().filter(grid).collect();
        for size in [study.size(), size].into_iter().filter(|_| !cells.is_empty()) {
            let means = variant(study, CSSIM, &cells, size).means;
            table.scores([format!("{size} x {size}"), cells.len().to_string()], &means);
        }
    }
    if !table.rows.is_empty() {
        let csv = table.csv("metric-sizes");
        section.blocks.extend([Block::Table(table), Block::Data(csv)]);
    }
}

/// A comparison with the paper's means: a metric, a method and a model.
type Rival<'a> = (&'a str, Method, &'a str);

/// Means over the six materials under each light with the paper's, and which of them are nearest.
fn nearest(study: &Study<'_>, section: &mut Section) {
    let model = study.model.as_str();
    let mut rivals: Vec<Rival<'_>> = vec![
        (CSSIM, Method::Ours, model),
        (CSSIM, Method::OursPolished, model),
        (CSSIM, Method::Ours, PAPER_MODEL.name()),
        (CSSIM, Method::Paper, PAPER_MODEL.name()),
    ];
    rivals.dedup();
    rivals.extend(named(study).into_iter().map(|metric| (metric, Method::OursPolished, model)));
    let about = &study.data.about;
    let lights: Vec<(&str, f64)> =
        about.probes.iter().filter_map(|probe| Some((probe.as_str(), paper_256(probe)?))).collect();
    let names = lights.iter().map(|(probe, _)| text::light(probe).to_owned());
    let columns = ["metric", "method", "model", "cells"].map(str::to_owned).into_iter().chain(names);
    let mut table = Table::new(
        "Mean score over the six materials under each light beside the paper's, of 256 samples without polish.",
        3,
        columns.chain(["mean |difference|".to_owned()]),
    );
    let mut add = |names: [&str; 3], cells: usize, means: &[Option<f64>], off: Option<f64>| {
        let names = names.map(str::to_owned).into_iter().chain([cells.to_string()]);
        table.row(names.chain(means.iter().map(|mean| text::score(*mean))).chain([text::score(off)]));
    };
    let paper: Vec<Option<f64>> = lights.iter().map(|(_, score)| Some(*score)).collect();
    add(["cssim", "the paper's", PAPER_MODEL.name()], 6 * lights.len(), &paper, None);
    let mut found: Vec<(Rival<'_>, f64)> = Vec::new();
    for rival in rivals {
        let (cells, means) = by_light(study, rival, &lights);
        let differences: Vec<f64> =
            means.iter().zip(&lights).filter_map(|(mean, (_, paper))| Some(((*mean)? - paper).abs())).collect();
        let off = mean(&differences).filter(|_| differences.len() == lights.len());
        if cells > 0 {
            add([rival.0, text::method(rival.1), rival.2], cells, &means, off);
        }
        found.extend(off.map(|off| (rival, off)));
    }
    let Some(((metric, method, model), off)) = found.into_iter().min_by(|a, b| a.1.total_cmp(&b.1)) else { return };
    let csv = table.csv("nearest-to-paper");
    section.blocks.extend([Block::Table(table), Block::Data(csv)]);
    let words = format!(
        "Nearest to the paper's means of 256 samples is {} with {model} by {metric}: {} from them on average over {}.",
        text::method(method),
        text::score(Some(off)),
        text::count(lights.len(), "light")
    );
    section.finding(Verdict::Measured, words);
}

/// The number of cells, and their mean under each light.
fn by_light(
    study: &Study<'_>,
    (metric, method, model): Rival<'_>,
    lights: &[(&str, f64)],
) -> (usize, Vec<Option<f64>>) {
    let of = |probe: &str| -> Vec<f64> {
        let cells = study.six().into_iter().filter(|cell| cell.1 == probe);
        let score = |cell| Some(study.find(&Pick { metric, model: Some(model), ..study.pick(method, cell) })?.cssim);
        cells.filter_map(score).collect()
    };
    let scores: Vec<Vec<f64>> = lights.iter().map(|(probe, _)| of(probe)).collect();
    (scores.iter().map(Vec::len).sum(), scores.iter().map(|scores| mean(scores)).collect())
}

/// The methods, by ascending mean.
fn order(methods: &[usize], means: &[Option<f64>]) -> String {
    let mut order: Vec<(f64, &str)> =
        methods.iter().zip(means).filter_map(|(i, mean)| Some(((*mean)?, text::method(METHODS[*i])))).collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0));
    order.into_iter().map(|pair| pair.1).collect::<Vec<_>>().join(" < ")
}
