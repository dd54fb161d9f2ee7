//! The BRDF models against each other, GGX against Cook-Torrance above all.

use crate::study::{
    report::{
        document::{Block, Section, Table},
        statistics::mean,
        study::{Pick, Study},
        text,
        verdict::{self, PAIRED_RULE, Verdict},
    },
    row::Method,
};
use std::collections::BTreeSet;

pub(super) fn section(study: &Study<'_>) -> anyhow::Result<Section> {
    let mut section = Section::new("models", "BRDF models");
    let models: BTreeSet<&str> =
        study.data.rows.iter().filter(|row| row.method == Method::OursPolished).map(|row| row.model.as_str()).collect();
    let models: Vec<&str> = models.into_iter().collect();
    let scored: Vec<_> = study.cells().into_iter().map(|cell| (cell, scores(study, cell, &models))).collect();
    let scored: Vec<_> = scored.into_iter().filter(|(_, scores)| scores.iter().flatten().count() > 1).collect();
    if scored.is_empty() {
        return Ok(section.missing("more than one model with the method \"ours+polish\""));
    }
    let caption =
        "CSSIM of ours + polish by model, mean over the lights that have every model of the row; the best in bold.";
    let mut table = Table::new(caption, 1, std::iter::once("material").chain(models.iter().copied()));
    let mut all = Vec::new();
    for material in &study.data.about.materials {
        let of: Vec<&Vec<Option<f64>>> =
            scored.iter().filter(|(cell, _)| cell.0 == material).map(|(_, scores)| scores).collect();
        if of.is_empty() {
            continue;
        }
        let means = means(&of, models.len());
        all.push(means.clone());
        table.scores([material.as_str()], &means);
    }
    let complete: Vec<&Vec<Option<f64>>> = all.iter().filter(|means| means.iter().all(Option::is_some)).collect();
    if !complete.is_empty() {
        table.scores([format!("mean of {}", complete.len())], &means(&complete, models.len()));
        table.totals = 1;
    }
    let csv = table.csv("models");
    section.blocks.extend([Block::Table(table), Block::Data(csv)]);
    let wins = models
        .iter()
        .enumerate()
        .map(|(i, model)| format!("{model} {}", scored.iter().filter(|(_, scores)| best(scores) == Some(i)).count()));
    let words =
        format!("Lowest CSSIM, of {}: {}.", text::count(scored.len(), "cell"), wins.collect::<Vec<_>>().join(", "));
    section.finding(Verdict::Measured, words);
    let (verdict, words) = ggx(&models, &scored);
    section.finding(verdict, words);
    Ok(section)
}

fn scores(study: &Study<'_>, cell: (&str, &str), models: &[&str]) -> Vec<Option<f64>> {
    let score =
        |model: &&str| Some(study.find(&Pick { model: Some(*model), ..study.pick(Method::OursPolished, cell) })?.cssim);
    models.iter().map(score).collect()
}

/// The mean of each column over the rows that have every column that the first has.
fn means(rows: &[&Vec<Option<f64>>], columns: usize) -> Vec<Option<f64>> {
    let has = |i: usize| rows.iter().any(|row| row[i].is_some());
    let complete: Vec<_> = rows.iter().filter(|row| (0..columns).all(|i| row[i].is_some() || !has(i))).collect();
    (0..columns).map(|i| mean(&complete.iter().filter_map(|row| row[i]).collect::<Vec<_>>())).collect()
}

fn best(scores: &[Option<f64>]) -> Option<usize> {
    let there = scores.iter().enumerate().filter_map(|(i, score)| Some((i, (*score)?)));
    there.min_by(|a, b| a.1.total_cmp(&b.1)).map(|best| best.0)
}

/// A cell and its scores by model.
type Scored<'a> = ((&'a str, &'a str), Vec<Option<f64>>);

/// [BP20a] holds GGX to be the better of the two.
fn ggx(models: &[&str], scored: &[Scored<'_>]) -> (Verdict, String) {
    let place = |name: &str| models.iter().position(|model| *model == name);
    let margin = |scores: &Vec<Option<f64>>| Some(scores[place("cook-torrance")?]? - scores[place("ggx")?]?);
    let margins: Vec<f64> = scored.iter().filter_map(|(_, scores)| margin(scores)).collect();
    if margins.is_empty() {
        return (Verdict::NotDecided, "GGX against Cook-Torrance: not in this study.".to_owned());
    }
    let wins = margins.iter().filter(|margin| **margin > 0.0).count();
    let words = format!(
        "GGX beats Cook-Torrance in {} cells, by a CSSIM of {} in the mean, on the claim of [BP20a] that GGX is the better model; \
         {PAIRED_RULE}.",
        text::share(wins, margins.len()),
        text::signed(mean(&margins))
    );
    (verdict::paired(&margins), words)
}
