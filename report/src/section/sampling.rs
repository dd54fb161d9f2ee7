//! How pixels are drawn: by importance, stratified, uniformly.

use crate::{
    chart::{Bars, Group, colour},
    document::{Block, Section, Table},
    measured::Method,
    statistics::mean,
    study::{Pick, Study},
    text, verdict,
};

const SAMPLES: [u32; 3] = [32, 64, 256];
const KINDS: [&str; 3] = ["importance", "stratified", "uniform"];

pub(super) fn section(study: &Study<'_>) -> anyhow::Result<Section> {
    let mut section = Section::new("sampling", "Importance, stratified and uniform sampling");
    let measured =
        |samples: u32, kind: &str| study.cells().into_iter().any(|cell| score(study, cell, samples, kind).is_some());
    let kinds: Vec<&str> =
        KINDS.into_iter().filter(|kind| SAMPLES.iter().any(|samples| measured(*samples, kind))).collect();
    if kinds.len() < 2 {
        return Ok(section.missing("the experiment \"sampling\""));
    }
    let mut table = Table::new(
        "Mean CSSIM over the cells that have each; the best in bold.",
        2,
        ["samples", "cells"].into_iter().chain(kinds.iter().copied()),
    );
    let mut groups = Vec::new();
    let mut margins = Vec::new();
    for samples in SAMPLES {
        let complete: Vec<Vec<f64>> = study
            .cells()
            .into_iter()
            .filter_map(|cell| kinds.iter().map(|kind| score(study, cell, samples, kind)).collect())
            .collect();
        if complete.is_empty() {
            continue;
        }
        let means: Vec<Option<f64>> =
            (0..kinds.len()).map(|i| mean(&complete.iter().map(|scores| scores[i]).collect::<Vec<_>>())).collect();
        margins.extend(complete.iter().flat_map(|scores| scores[1..].iter().map(move |other| other - scores[0])));
        table.scores([samples.to_string(), complete.len().to_string()], &means);
        groups.push(Group { name: format!("{samples} samples"), bars: means });
    }
    let bars = Bars {
        title: "Sampling".to_owned(),
        label: "mean CSSIM (lower is better)".to_owned(),
        kinds: kinds.iter().zip([0, 4, 3]).map(|(kind, i)| ((*kind).to_owned(), colour(i))).collect(),
        groups,
    };
    section.figure("Mean CSSIM by how pixels are drawn.", bars.svg()?, table.csv("sampling"));
    section.blocks.push(Block::Table(table));
    let wins = margins.iter().filter(|margin| **margin > 0.0).count();
    let words = format!(
        "{} beats the others in {} comparisons, by a CSSIM of {} on average; {}.",
        capitalised(kinds[0]),
        text::share(wins, margins.len()),
        text::signed(mean(&margins)),
        verdict::rule(&margins)
    );
    section.finding(verdict::paired(&margins), words);
    Ok(section)
}

fn capitalised(word: &str) -> String {
    let mut letters = word.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect()) + " sampling"
}

fn score(study: &Study<'_>, cell: (&str, &str), samples: u32, sampling: &str) -> Option<f64> {
    Some(study.find(&Pick { samples: Some(samples), sampling, ..study.pick(Method::Ours, cell) })?.cssim)
}
