//! The report of a study: turns its measurements into pages, figures and files for programs.
//!
//! Every verdict and every number is computed from the data. A section without data says which entries of the study file
//! it needs.

mod chart;
mod differences;
mod document;
mod folder;
mod html;
mod markdown;
pub mod measured;
mod results;
mod section;
mod statistics;
mod study;
mod text;
mod verdict;

#[cfg(test)]
mod tests;

use crate::measured::StudyData;
use document::{Block, Section};
use std::path::Path;
use study::Study;

/// The heading of both pages.
const TITLE: &str = "Lookalike against Bieron and Peers 2020";

/// Makes the report of the study in `out`: `results.md`, `report.html`, `results.json`, `data.json` and `figures/`. Each file is passed
/// to `write` with its name below `out`. The pictures must already be in `out/pictures/`; pictures of differences are added.
///
/// # Errors
/// If a picture cannot be read, or the error of `write`.
pub fn write(
    data: &StudyData,
    out: &Path,
    mut write: impl FnMut(&str, &[u8]) -> anyhow::Result<()>,
) -> anyhow::Result<()> {
    let pictures = out.join("pictures");
    let mut names = folder::names(&pictures)?;
    differences::write(&pictures, &mut names, &mut write)?;
    let study = Study::new(data, names);
    let sections = section::all(&study)?;
    let lead = lead(&study);
    for (name, text) in figure_files(&sections) {
        write(&format!("figures/{name}"), text.as_bytes())?;
    }
    write("results.json", results::json(&study)?.as_bytes())?;
    write("data.json", results::data(data)?.as_bytes())?;
    write("results.md", markdown::page(TITLE, &lead, &sections).as_bytes())?;
    write("report.html", html::page(TITLE, &lead, &sections, &pictures)?.as_bytes())
}

/// The subject of the study, in two sentences.
fn lead(study: &Study<'_>) -> String {
    let about = &study.data.about;
    let probes: Vec<String> = about.probes.iter().map(|probe| text::light(probe).to_owned()).collect();
    format!(
        "The tables and figures of the paper, measured again by lookalike study {} on {} under {}, at {size} x {size} \
         pixels. CSSIM is a difference: 0 is a perfect match, and lower is better.",
        about.version,
        text::count(about.materials.len(), "material"),
        text::list(&probes),
        size = about.size,
    )
}

/// The drawings and the data of all sections, by file name.
fn figure_files(sections: &[Section]) -> Vec<(String, &str)> {
    let blocks = sections.iter().flat_map(|section| &section.blocks);
    blocks
        .flat_map(|block| match block {
            Block::Figure(figure) => vec![
                (format!("{}.svg", figure.csv.stem), figure.svg.as_str()),
                (format!("{}.csv", figure.csv.stem), figure.csv.text.as_str()),
            ],
            Block::Data(csv) => vec![(format!("{}.csv", csv.stem), csv.text.as_str())],
            _ => Vec::new(),
        })
        .collect()
}
