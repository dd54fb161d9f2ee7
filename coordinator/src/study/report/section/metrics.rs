//! The same matches under variants of the metric: do the conclusions hold, and which comes near the paper's figures?

use crate::study::{
    report::{
        document::{Block, Section, Table},
        statistics::mean,
        study::{CSSIM, Pick, Study},
        text,
        verdict::Verdict,
    },
    row::Method,
};
use std::collections::BTreeSet;

const METHODS: [Method; 3] = [Method::OursPolished, Method::Brute, Method::L2];
/// Between these lie most of the paper's scores.
const PAPER: (f64, f64) = (0.04, 0.07);

pub(super) fn section(study: &Study<'_>) -> anyhow::Result<Section> {
    let mut section = Section::new("metrics", "Variants of the metric");
    let variants = variants(study);
    if variants.len() < 2 {
        return Ok(section.missing("variants of the metric for the methods \"ours+polish\", \"l2\" or \"brute\""));
    }
    let methods: Vec<usize> =
        (0..METHODS.len()).filter(|i| variants.iter().all(|variant| variant.means[*i].is_some())).collect();
    let names = methods.iter().map(|i| text::method(METHODS[*i]));
    let columns = ["metric", "order, best first"].into_iter().chain(["cells"]).chain(names);
    let mut table = Table::new("Mean score over the cells that have each method; the best in bold.", 2, columns);
    let mut orders = BTreeSet::new();
    for variant in &variants {
        let means: Vec<Option<f64>> = methods.iter().map(|i| variant.means[*i]).collect();
        let order = order(&methods, &means);
        table.scores([variant.name.clone(), order.clone(), variant.cells.to_string()], &means);
        orders.insert(order);
    }
    let csv = table.csv("metrics");
    section.blocks.extend([Block::Table(table), Block::Data(csv)]);
    let holds = (methods.len() > 1).then_some(orders.len() == 1);
    let words = format!(
        "The order of the methods is {} under {}; confirmed if it is the same under all.",
        orders.into_iter().collect::<Vec<_>>().join(", or "),
        text::count(variants.len(), "metric")
    );
    section.finding(Verdict::of(holds), words);
    let ours = |variant: &Variant| variant.means[0];
    let near = variants.iter().filter_map(|variant| Some((variant, ours(variant)?)));
    if let Some((variant, score)) = near.min_by(|a, b| distance(a.1).total_cmp(&distance(b.1))) {
        let words = format!(
            "Nearest to the paper's scores of {} to {} is {}: {} for ours + polish.",
            PAPER.0,
            PAPER.1,
            variant.name,
            text::score(Some(score))
        );
        section.finding(Verdict::Measured, words);
    }
    Ok(section)
}

/// Mean scores by [`METHODS`].
struct Variant {
    name: String,
    cells: usize,
    means: [Option<f64>; 3],
}

fn variants(study: &Study<'_>) -> Vec<Variant> {
    let named: BTreeSet<&str> = study
        .data
        .rows
        .iter()
        .filter(|row| row.metric != CSSIM && METHODS.contains(&row.method))
        .map(|row| row.metric.as_str())
        .collect();
    let all = std::iter::once(CSSIM).chain(named);
    all.map(|metric| variant(study, metric)).filter(|variant| variant.cells > 0).collect()
}

fn variant(study: &Study<'_>, metric: &str) -> Variant {
    let about = &study.data.about;
    let cells: Vec<(&str, &str)> =
        about.materials.iter().flat_map(|m| about.probes.iter().map(move |p| (m.as_str(), p.as_str()))).collect();
    let at = |method: Method, cell: (&str, &str)| {
        // A variant may be of another size than the grid.
        let pick = Pick { metric, ..study.pick(method, cell) };
        let sizes = study.data.rows.iter().filter(|row| row.metric == metric).map(|row| row.size).max();
        let found = study.find(&pick).or_else(|| study.find(&Pick { size: sizes?, ..pick }));
        Some(found?.cssim)
    };
    let has = |method: &Method| cells.iter().any(|cell| at(*method, *cell).is_some());
    let methods: Vec<bool> = METHODS.iter().map(has).collect();
    let complete = |cell: &(&str, &str)| {
        let scores = METHODS.map(|method| at(method, *cell));
        let all = scores.iter().zip(&methods).all(|(score, wanted)| score.is_some() || !wanted);
        (all && scores.iter().any(Option::is_some)).then_some(scores)
    };
    let scores: Vec<[Option<f64>; 3]> = cells.iter().filter_map(complete).collect();
    let column = |i: usize| mean(&scores.iter().filter_map(|scores| scores[i]).collect::<Vec<_>>());
    Variant { name: metric.to_owned(), cells: scores.len(), means: [column(0), column(1), column(2)] }
}

/// The methods from the lowest mean on.
fn order(methods: &[usize], means: &[Option<f64>]) -> String {
    let mut order: Vec<(f64, &str)> =
        methods.iter().zip(means).filter_map(|(i, mean)| Some(((*mean)?, text::method(METHODS[*i])))).collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0));
    order.into_iter().map(|pair| pair.1).collect::<Vec<_>>().join(" < ")
}

/// From the paper's range, then from its middle.
fn distance(score: f64) -> f64 {
    let outside = (PAPER.0 - score).max(score - PAPER.1).max(0.0);
    outside + 1e-3 * (score - f64::midpoint(PAPER.0, PAPER.1)).abs()
}
