//! The file of a reflectance model is also its manual page.

use super::{common, none, paths::words, source::Source};
use lookalike::brdf::{MODELS, Model};
use std::collections::BTreeSet;

#[test]
fn the_head_of_a_models_file_is_its_manual_page() {
    let files: Vec<Source> = common().filter(|source| source.code.contains("impl Model for")).collect();
    let mut offences = Vec::new();
    let mut described = BTreeSet::new();
    for source in &files {
        let head = source.text.lines().next().unwrap_or_default();
        let name = head.strip_prefix("//! `").and_then(|rest| rest.split_once("`:")).map(|(name, _)| name);
        match name.and_then(|name| MODELS.iter().find(|model| model.name() == name)) {
            Some(model) => {
                described.insert(model.name());
                offences.extend(table_offences(source, *model));
            }
            None => offences.push(format!("{}:1: expected \"//! `NAME`: ...\" of a registered model", source.path)),
        }
    }
    let missing = MODELS.iter().filter(|model| !described.contains(model.name()));
    offences.extend(missing.map(|model| format!("common/src/brdf: no file whose head describes {}", model.name())));
    none(
        "a model's file opens with its name, formula, sources and a table of its parameters as they are in the code",
        offences,
    );
}

/// What is wrong with the table of parameters in the head comment.
fn table_offences(source: &Source, model: &dyn Model) -> Vec<String> {
    let head: Vec<&str> = source.text.lines().map_while(|line| line.strip_prefix("//!")).map(str::trim).collect();
    let cells = |row: &str| row.trim_matches('|').split('|').map(|cell| cell.trim().to_owned()).collect::<Vec<_>>();
    let rows: Vec<Vec<String>> = head.iter().filter(|line| line.starts_with("| `")).map(|row| cells(row)).collect();
    let mut offences = Vec::new();
    let documented: Vec<&str> = rows.iter().map(|row| row[0].trim_matches('`')).collect();
    let declared: Vec<&str> = model.parameters().iter().map(|parameter| parameter.name).collect();
    if documented != declared {
        offences.push(format!("{}: the table has {documented:?}, the model {declared:?}", source.path));
    }
    for (row, parameter) in rows.iter().zip(model.parameters()) {
        let bounds = row.last().and_then(|cell| cell.strip_prefix('[')?.strip_suffix(']')?.split_once(','));
        let bounds = bounds.and_then(|(low, high)| Some((low.trim().parse().ok()?, high.trim().parse().ok()?)));
        if bounds != Some((parameter.lower, parameter.upper)) {
            let (name, lower, upper) = (parameter.name, parameter.lower, parameter.upper);
            offences.push(format!("{}: expected bounds [{lower}, {upper}] of {name} in {row:?}", source.path));
        }
    }
    if !head.iter().any(|line| contains_a_year(line)) {
        offences.push(format!("{}: the head names no source with its year", source.path));
    }
    offences
}

fn contains_a_year(line: &str) -> bool {
    words(line).any(|(word, _)| word.name.len() == 4 && (word.name.starts_with("19") || word.name.starts_with("20")))
}
