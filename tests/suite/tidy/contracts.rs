//! Names that other programs rely on are documented on their pages, and the pages list no others.

use super::{
    documents::{between, document},
    none,
    source::root,
};
use std::{collections::BTreeSet, fs};

fn source(path: &str) -> String {
    fs::read_to_string(root().join(path)).unwrap_or_else(|error| panic!("{path}: {error}"))
}

/// The names that only one side has.
fn differences<'a>(there: &BTreeSet<&'a str>, here: &BTreeSet<&'a str>, page: &str, code: &str) -> Vec<String> {
    let only = |one: &BTreeSet<&'a str>, other: &BTreeSet<&'a str>, text: &str| {
        one.difference(other).map(|word| format!("{word} is {text}")).collect::<Vec<_>>()
    };
    let lacks =
        [only(there, here, &format!("in {page} and not in {code}")), only(here, there, &format!("not in {page}"))];
    lacks.concat()
}

#[test]
fn events_of_the_stream_match_their_page() {
    let (page, code) = ("docs/progress.md", "app/src/progress/json.rs");
    let (text, program) = (document(page), source(code));
    let table = text.lines().skip_while(|line| !line.starts_with("| event |")).skip(2);
    let rows = table.take_while(|line| line.starts_with('|'));
    let told: BTreeSet<&str> = rows.filter_map(|row| row.strip_prefix("| `")?.split('`').next()).collect();
    let said = between(&program, "\"event\": \"", "\"").into_iter().chain(between(&program, "node(noun, \"", "\""));
    let of_parts = program.split('"').filter(|word| word.starts_with("fit-") || word.starts_with("cell-"));
    let said: BTreeSet<&str> = said.chain(of_parts).collect();
    assert!(told.len() > 20, "only {told:?}: does this test still read the table?");
    none("docs/progress.md has every event and no other", differences(&told, &said, page, code));
}

#[test]
fn metrics_match_their_page() {
    let (page, code) = ("docs/batch.md", "coordinator/src/metrics/text.rs");
    let (text, program) = (document(page), source(code) + &source("app/src/run/names.rs"));
    let told = text.split('`').filter(|word| word.starts_with("lookalike_"));
    let told: BTreeSet<&str> = told.collect();
    let said = program.split('"').filter(|word| word.starts_with("lookalike_"));
    let said: BTreeSet<&str> = said.collect();
    assert!(told.len() > 15, "only {told:?}: does this test still read the table?");
    none("docs/batch.md has every metric and no other", differences(&told, &said, page, code));
}
