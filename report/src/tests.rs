//! The report of a synthetic study: the numbers in its tables, its verdicts, its files.

mod files;
mod findings;
mod rules;
mod synthetic;

use super::{
    document::{Block, Section, Table},
    section,
    study::Study,
    verdict::Verdict,
};
use crate::measured::StudyData;
use std::collections::BTreeSet;

/// The sections of a study without pictures.
fn sections(data: &StudyData) -> Vec<Section> {
    section::all(&Study::new(data, BTreeSet::new())).unwrap()
}

/// One section of it.
fn section_of(data: &StudyData, id: &str) -> Section {
    sections(data).into_iter().find(|section| section.id == id).unwrap()
}

fn tables(section: &Section) -> Vec<&Table> {
    section.blocks.iter().filter_map(|block| if let Block::Table(table) = block { Some(table) } else { None }).collect()
}

fn findings(section: &Section) -> Vec<(Verdict, &str)> {
    let finding =
        |block| if let &Block::Finding(verdict, ref text) = block { Some((verdict, text.as_str())) } else { None };
    section.blocks.iter().filter_map(finding).collect()
}

/// The row of a table with this first entry.
fn row(table: &Table, start: &[&str]) -> Vec<String> {
    let texts = |row: &Vec<super::document::Entry>| row.iter().map(|entry| entry.text.clone()).collect::<Vec<_>>();
    let starts = |row: &Vec<String>| row.iter().zip(start).all(|(text, start)| text == start);
    table.rows.iter().map(texts).find(starts).unwrap_or_else(|| panic!("no row {start:?} in {table:#?}"))
}
