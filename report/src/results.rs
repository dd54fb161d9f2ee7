//! `results.json`: one line per match, for comparisons by programs; `data.json`: the whole study.

use super::study::{CSSIM, Match, Study};
use crate::measured::{Method, Row, StudyData};
use serde::Serialize;
use std::collections::BTreeMap;

/// A line of `results.json`.
#[derive(Debug, Serialize)]
struct ResultRow<'a> {
    material: &'a str,
    probe: &'a str,
    method: &'static str,
    samples: Option<u32>,
    size: u32,
    cssim: f64,
    cpu_seconds: f64,
    seed: u64,
    model: &'a str,
    gamma: Option<f64>,
    searched_size: u32,
    sampling: &'a str,
    clamped: bool,
    gammas: u32,
}

/// The methods in `results.json`, in order.
const METHODS: [Method; 8] = [
    Method::Ours,
    Method::OursPolished,
    Method::Paper,
    Method::L2,
    Method::Brute,
    Method::LowRes,
    Method::Log,
    Method::CubeRoot,
];

/// The text of `results.json`: matches under the light of the fit; of several starts only the best.
///
/// # Errors
/// If a row cannot be written.
pub(super) fn json(study: &Study<'_>) -> serde_json::Result<String> {
    let mut groups: BTreeMap<_, Vec<&Row>> = BTreeMap::new();
    let published = |row: &&Row| row.shown == row.probe && row.metric == CSSIM && row.cssim.is_finite();
    for row in study.data.rows.iter().filter(published) {
        if let Some(method) = METHODS.iter().position(|method| *method == row.method) {
            groups.entry(key(study, row, method)).or_default().push(row);
        }
    }
    let lines = groups.values().filter_map(|rows| Match::best(rows)).map(|best| line(&best));
    Ok(format!("[\n{}\n]\n", lines.collect::<serde_json::Result<Vec<_>>>()?.join(",\n")))
}

/// The text of `data.json`: the whole study, one line per measurement.
///
/// # Errors
/// If it cannot be written.
pub(super) fn data(data: &StudyData) -> serde_json::Result<String> {
    let about = serde_json::to_string_pretty(&data.about)?.replace('\n', "\n  ");
    let lists = [
        ("photos", lines(&data.photos)?),
        ("rows", lines(&data.rows)?),
        ("direct", lines(&data.direct)?),
        ("agreements", lines(&data.agreements)?),
    ];
    let lists = lists.map(|(name, lines)| format!("  \"{name}\": [{lines}]"));
    Ok(format!("{{\n  \"about\": {about},\n{}\n}}\n", lists.join(",\n")))
}

fn lines<T: Serialize>(list: &[T]) -> serde_json::Result<String> {
    let lines = list.iter().map(serde_json::to_string).collect::<serde_json::Result<Vec<_>>>()?;
    Ok(if lines.is_empty() { String::new() } else { format!("\n    {}\n  ", lines.join(",\n    ")) })
}

/// The sort key of a result: everything that identifies it, except the start.
fn key<'a>(study: &Study<'a>, row: &'a Row, method: usize) -> impl Ord + use<'a> {
    let place = |names: &[String], name: &str| names.iter().position(|other| other == name).unwrap_or(names.len());
    let about = &study.data.about;
    let cell = (place(&about.materials, &row.material), &row.material, place(&about.probes, &row.probe), &row.probe);
    let drawn = (row.samples, row.sampling.as_str(), row.clamped, row.subsets, row.seed);
    (cell, method, row.model.as_str(), row.size, row.searched_size, drawn)
}

fn line(best: &Match<'_>) -> serde_json::Result<String> {
    let row = best.row;
    serde_json::to_string(&ResultRow {
        material: &row.material,
        probe: &row.probe,
        method: row.method.name(),
        samples: row.samples,
        size: row.size,
        cssim: row.cssim,
        cpu_seconds: best.cpu_seconds,
        seed: row.seed,
        model: &row.model,
        gamma: row.gamma,
        searched_size: row.searched_size,
        sampling: &row.sampling,
        clamped: row.clamped,
        gammas: row.gammas,
    })
}
