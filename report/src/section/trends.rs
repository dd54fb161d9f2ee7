//! The dependence of the candidates' parameters on gamma.

use super::gamma::grid_candidates;
use crate::{
    chart::{Axis, Plot, Series, colour},
    document::{Block, CsvText, Section, Table},
    measured::Row,
    statistics::{mean, number, spearman},
    study::Study,
    text,
    verdict::{self, Verdict},
};

/// A parameter: its name and its value in a row.
type Parameter = (&'static str, fn(&Row) -> Option<f64>);

const PARAMETERS: [Parameter; 2] = [("width", width), ("diffuse", diffuse)];

pub(super) fn section(study: &Study<'_>) -> anyhow::Result<Section> {
    let mut section = Section::new("trends", "Parameters over γ");
    let cells = study.cells();
    let curves: Vec<_> =
        cells.iter().map(|cell| (*cell, grid_candidates(study, *cell))).filter(|curve| curve.1.len() > 2).collect();
    if curves.is_empty() {
        return Ok(section.missing("the experiment \"methods\", whose candidates have at least three gammas"));
    }
    let mut table = Table::new(
        "Spearman's rank correlation with γ: above 0, the parameter grows with it.",
        2,
        ["material", "light", "width of the lobe", "mean diffuse"],
    );
    let mut trends: [Vec<f64>; 2] = [Vec::new(), Vec::new()];
    for (cell, rows) in &curves {
        let of = PARAMETERS.map(|(_, value)| spearman(&points(rows, value)));
        trends.iter_mut().zip(of).for_each(|(trends, trend)| trends.extend(trend));
        table.row([cell.0.to_owned(), text::light(cell.1).to_owned(), text::fixed(of[0], 2), text::fixed(of[1], 2)]);
    }
    for (name, value) in PARAMETERS {
        let (svg, csv) = draw(study, &curves, name, value)?;
        section.figure(&format!("Mean over the cells of each light: {} over γ.", label(name)), svg, csv);
    }
    let csv = table.csv("trends");
    section.blocks.extend([Block::Table(table), Block::Data(csv)]);
    let signs = |trends: &[f64]| {
        let up = trends.iter().filter(|trend| **trend > 0.0).count();
        let down = trends.iter().filter(|trend| **trend < 0.0).count();
        format!(
            "grows in {up} and shrinks in {down} of {}, with a mean correlation of {}",
            text::count(trends.len(), "cell"),
            text::fixed(mean(trends), 2)
        )
    };
    let words = format!(
        "The width of the lobe {} (the paper: low γ sharp, high γ blurry); {}.",
        signs(&trends[0]),
        verdict::rule(&trends[0])
    );
    section.finding(verdict::paired(&trends[0]), words.replace("margin", "correlation"));
    section.finding(Verdict::Measured, format!("The mean diffuse albedo {}.", signs(&trends[1])));
    Ok(section)
}

/// The microfacet width, whatever the model calls it.
fn width(row: &Row) -> Option<f64> {
    let named = |name: &str| row.parameters.get(name).copied();
    named("alpha").or_else(|| named("m")).or_else(|| named("roughness").map(|roughness| roughness * roughness))
}

/// The mean of the diffuse channels.
fn diffuse(row: &Row) -> Option<f64> {
    let channels: Vec<f64> = row
        .parameters
        .iter()
        .filter(|(name, _)| *name == "kd" || name.starts_with("kd."))
        .map(|(_, value)| *value)
        .collect();
    mean(&channels)
}

fn label(name: &str) -> &'static str {
    if name == "width" { "width of the lobe (alpha, m, roughness squared)" } else { "mean diffuse albedo (kd)" }
}

fn points(rows: &[&Row], value: fn(&Row) -> Option<f64>) -> Vec<(f64, f64)> {
    rows.iter().filter_map(|row| Some((row.gamma?, value(row)?))).collect()
}

fn draw(
    study: &Study<'_>,
    curves: &[((&str, &str), Vec<&Row>)],
    name: &str,
    value: fn(&Row) -> Option<f64>,
) -> anyhow::Result<(String, crate::document::Csv)> {
    let mut csv = CsvText::new(&format!("trend-{name}"), ["light", "gamma", "mean", "cells"]);
    let mut series = Vec::new();
    for (i, probe) in study.data.about.probes.iter().enumerate() {
        let of: Vec<Vec<(f64, f64)>> =
            curves.iter().filter(|curve| curve.0.1 == probe).map(|curve| points(&curve.1, value)).collect();
        let longest = of.iter().max_by_key(|points| points.len());
        let mut means = Vec::new();
        for (gamma, _) in longest.into_iter().flatten() {
            let there = |points: &Vec<(f64, f64)>| {
                points.iter().find(|point| (point.0 - gamma).abs() < 1e-9).map(|point| point.1)
            };
            let values: Vec<f64> = of.iter().filter_map(there).collect();
            // Only gammas that every curve has: a mean over fewer materials would jump where a curve ends.
            if let Some(mean) = mean(&values).filter(|_| values.len() == of.len()) {
                csv.row([
                    probe.clone(),
                    text::exact(Some(*gamma)),
                    text::exact(Some(mean)),
                    text::exact(Some(number(values.len()))),
                ]);
                means.push((*gamma, mean));
            }
        }
        if !means.is_empty() {
            series.push(Series {
                name: text::light(probe).to_owned(),
                colour: colour(i),
                points: means,
                joined: true,
                minimum: false,
            });
        }
    }
    let title = format!("{} over γ", if name == "width" { "Lobe width" } else { "Diffuse albedo" });
    let plot = Plot { title, x: Axis::linear("γ"), y: Axis::linear(label(name)), series };
    Ok((plot.svg()?, csv.done()))
}
