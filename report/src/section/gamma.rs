//! The paper's Figure 2: CSSIM of the candidates over gamma.

use crate::{
    chart::{Axis, Plot, Series, colour},
    document::{Block, CsvText, Section, Table},
    measured::{Method, Row},
    statistics::range,
    study::Study,
    text,
    verdict::Verdict,
};

/// Number of materials in the paper's figure, and in the experiment with more gammas.
const SHOWN: usize = 3;
/// The largest gamma of the grid.
const LARGEST: f64 = 3.0;

pub(super) fn section(study: &Study<'_>) -> anyhow::Result<Section> {
    let mut section = Section::new("gamma", "Figure 2: CSSIM over γ");
    let mut minima = Vec::new();
    let mut table = Table::new(
        "The lowest CSSIM of each curve.",
        2,
        ["material", "light", "γ of the lowest", "CSSIM there", "γ from, to"],
    );
    let mut ends = 0;
    for probe in &study.data.about.probes {
        let curves: Vec<(&str, Vec<&Row>)> = materials(study)
            .into_iter()
            .map(|material| (material, candidates(study, (material, probe))))
            .filter(|(_, curve)| curve.len() > 1)
            .collect();
        if curves.is_empty() {
            continue;
        }
        for (material, curve) in &curves {
            let lowest = curve.iter().min_by(|a, b| a.cssim.total_cmp(&b.cssim)).and_then(|row| row.gamma);
            let ended = lowest.is_some() && (lowest == curve[0].gamma || lowest == curve[curve.len() - 1].gamma);
            ends += usize::from(ended);
            let (from, to) = (text::fixed(curve[0].gamma, 2), text::fixed(curve[curve.len() - 1].gamma, 2));
            let score = curve.iter().map(|row| row.cssim).min_by(f64::total_cmp);
            let (name, light) = ((*material).to_owned(), text::light(probe).to_owned());
            table.row([name, light, text::fixed(lowest, 2), text::score(score), format!("{from} to {to}")]);
            minima.extend(lowest);
        }
        let caption = format!(
            "CSSIM of the candidate of each γ under {}; the lowest of each material is circled.",
            text::light(probe)
        );
        let (svg, csv) = draw(probe, &curves)?;
        section.figure(&caption, svg, csv);
    }
    if minima.is_empty() {
        return Ok(
            section.missing("the experiment \"methods\" or \"gamma\", and one of the first three of the six materials")
        );
    }
    let csv = table.csv("fig2-minima");
    section.blocks.extend([Block::Table(table), Block::Data(csv)]);
    let (low, high) = range(&minima).unzip();
    section.finding(
        Verdict::Measured,
        format!(
            "The γ of the lowest CSSIM is from {} to {}; it is at an end of its range in {} curves.",
            text::fixed(low, 2),
            text::fixed(high, 2),
            text::share(ends, minima.len())
        ),
    );
    Ok(section)
}

/// The first materials of the six, for which the experiment has more gammas; the first of all if the study does not name the six.
fn materials<'a>(study: &Study<'a>) -> Vec<&'a str> {
    let about = &study.data.about;
    let from = if about.six.is_empty() { &about.materials } else { &about.six };
    from.iter().take(SHOWN).map(String::as_str).collect()
}

/// The candidates of the grid's seed by gamma; of several rows of one gamma the first.
pub(super) fn candidates<'a>(study: &Study<'a>, cell: (&str, &str)) -> Vec<&'a Row> {
    let mut rows: Vec<&Row> = study.rows(&study.pick(Method::Candidate, cell));
    rows.retain(|row| row.gamma.is_some_and(f64::is_finite));
    let gamma = |row: &Row| row.gamma.unwrap_or(f64::NAN);
    rows.sort_by(|a, b| gamma(a).total_cmp(&gamma(b)));
    rows.dedup_by(|a, b| (gamma(a) - gamma(b)).abs() < 1e-9);
    rows
}

/// The candidates of gammas that every cell has: without those above 3, which belong to a separate experiment.
pub(super) fn grid_candidates<'a>(study: &Study<'a>, cell: (&str, &str)) -> Vec<&'a Row> {
    let mut rows = candidates(study, cell);
    rows.retain(|row| row.gamma.is_some_and(|gamma| gamma <= LARGEST + 1e-9));
    rows
}

fn draw(probe: &str, curves: &[(&str, Vec<&Row>)]) -> anyhow::Result<(String, crate::document::Csv)> {
    let mut csv = CsvText::new(&format!("fig2-gamma-{probe}"), ["material", "gamma", "cssim", "cost", "evaluations"]);
    let mut series = Vec::new();
    for (i, (material, curve)) in curves.iter().enumerate() {
        for row in curve {
            let (gamma, cost) = (text::exact(row.gamma), text::exact(row.cost));
            csv.row([(*material).to_owned(), gamma, text::exact(Some(row.cssim)), cost, row.evaluations.to_string()]);
        }
        let points = curve.iter().filter_map(|row| Some((row.gamma?, row.cssim))).collect();
        series.push(Series { name: (*material).to_owned(), colour: colour(i), points, joined: true, minimum: true });
    }
    let title = format!("Candidates under {}", text::light(probe));
    let plot = Plot { title, x: Axis::linear("γ"), y: Axis::linear("CSSIM (lower is better)"), series };
    Ok((plot.svg()?, csv.done()))
}
