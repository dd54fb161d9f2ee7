//! The sections, in the order of the report, each with its question, its numbers and the rule that judges them.

mod about;
mod agreement;
mod cells;
mod clamped;
mod cost;
mod full;
mod gamma;
mod held_out;
mod low_resolution;
mod metrics;
mod models;
mod sampling;
mod seeds;
mod summary;
mod table_one;
mod trends;
mod two_stage;

use super::{
    document::{Block, Csv, Figure, Panel, Section, Strip, StripRow},
    study::Study,
};

/// All sections.
///
/// # Errors
/// If a figure cannot be drawn.
pub(super) fn all(study: &Study<'_>) -> anyhow::Result<Vec<Section>> {
    let sections = [
        summary::section,
        cells::section,
        two_stage::section,
        gamma::section,
        full::section,
        table_one::section,
        held_out::section,
        low_resolution::section,
        cost::section,
        sampling::section,
        clamped::section,
        trends::section,
        models::section,
        seeds::section,
        agreement::section,
        metrics::section,
        about::section,
    ];
    sections.into_iter().map(|section| section(study)).collect()
}

impl Section {
    /// Adds a chart and its data.
    fn figure(&mut self, caption: &str, svg: String, csv: Csv) {
        self.blocks.push(Block::Figure(Figure { caption: caption.to_owned(), svg, csv }));
    }

    /// Adds pictures, or a line of text if there are none.
    fn strip(&mut self, caption: &str, rows: Vec<StripRow>) {
        let some = rows.iter().any(|row| row.panels.iter().any(|panel| panel.file.is_some()));
        self.blocks.push(if some {
            Block::Strip(Strip { caption: caption.to_owned(), rows })
        } else {
            Block::Text("Pictures: not in this study.".to_owned())
        });
    }
}

impl Panel {
    fn new(caption: &str, note: String, file: Option<String>) -> Self {
        Self { caption: caption.to_owned(), note, file }
    }
}
