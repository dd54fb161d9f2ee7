//! How the study was made, so that it can be repeated.

use super::cost;
use crate::{
    document::{Block, Section, Table},
    statistics::median,
    study::Study,
    text,
};
use std::collections::BTreeSet;

pub(super) fn section(study: &Study<'_>) -> anyhow::Result<Section> {
    let mut section = Section::new("about", "How it was made");
    let about = &study.data.about;
    let seeds: BTreeSet<u64> = study.data.rows.iter().map(|row| row.seed).collect();
    let seeds: Vec<String> = seeds.into_iter().map(|seed| seed.to_string()).collect();
    let mut table = Table::new("The run.", 2, ["what", "value"]);
    for (what, value) in [
        ("version", about.version.clone()),
        ("machine", about.machine.clone()),
        ("seconds of the run", text::significant(Some(about.seconds))),
        ("workers", about.workers.to_string()),
        ("size of the grid", format!("{size} x {size}", size = about.size)),
        ("model of the grid", study.model.clone()),
        ("samples of the grid", study.samples.map_or_else(|| "full".to_owned(), |samples| samples.to_string())),
        ("seed of the grid", study.seed.to_string()),
        ("seeds", seeds.join(", ")),
        ("matches scored", study.data.rows.len().to_string()),
        (
            "held-out lights",
            text::list(&about.held_out.iter().map(|light| text::light(light).to_owned()).collect::<Vec<_>>()),
        ),
    ] {
        table.row([what.to_owned(), value]);
    }
    section.blocks.push(Block::Table(table));
    section.text(cost::SECONDS);
    section.text("The command:");
    section.blocks.push(Block::Code(about.command.clone()));
    photos(study, &mut section);
    if !study.data.direct.is_empty() {
        section.blocks.push(Block::Table(direct(study)));
    }
    section.text("The study file, with the sources of the materials and lights:");
    section.blocks.push(Block::Code(about.study.clone()));
    Ok(section)
}

fn photos(study: &Study<'_>, section: &mut Section) {
    if study.data.photos.is_empty() {
        return section.blocks.push(Block::Missing("Photos: not in this study.".to_owned()));
    }
    let caption = "The photos; noise is the standard error of a typical pixel relative to its luminance.";
    let mut table = Table::new(caption, 2, ["material", "light", "size", "noise, %", "exposure"]);
    for photo in &study.data.photos {
        let noise = text::fixed(photo.noise.map(|noise| 100.0 * noise), 2);
        let (light, size) = (text::light(&photo.probe).to_owned(), photo.size.to_string());
        table.row([photo.material.clone(), light, size, noise, text::significant(Some(photo.exposure))]);
    }
    let csv = table.csv("photos");
    section.blocks.extend([Block::Table(table), Block::Data(csv)]);
}

fn direct(study: &Study<'_>) -> Table {
    let columns = ["material", "light", "model", "size", "samples per pixel", "renderings", "median s"];
    let mut table = Table::new("Direct renderings, without their score, by which brute force is charged.", 3, columns);
    for cost in &study.data.direct {
        table.row([
            cost.material.clone(),
            text::light(&cost.probe).to_owned(),
            cost.model.clone(),
            cost.size.to_string(),
            cost.samples_per_pixel.to_string(),
            cost.seconds.len().to_string(),
            text::significant(median(&cost.seconds)),
        ]);
    }
    table
}
