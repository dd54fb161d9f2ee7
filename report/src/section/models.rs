//! The BRDF models compared with each other, mainly GGX with Cook-Torrance.

use crate::{
    document::{Block, Entry, Section, Table},
    measured::Method,
    statistics::mean,
    study::{Pick, Study},
    text,
    verdict::{self, Verdict},
};
use lookalike::brdf::DEFAULT_MODEL;
use std::collections::BTreeSet;

/// The model of the paper's results.
const PAPER: &str = "cook-torrance";

const GGX: &str = "ggx";

pub(super) fn section(study: &Study<'_>) -> anyhow::Result<Section> {
    let mut section = Section::new("models", "BRDF models");
    let models: BTreeSet<&str> =
        study.data.rows.iter().filter(|row| row.method == Method::OursPolished).map(|row| row.model.as_str()).collect();
    let models: Vec<&str> = models.into_iter().collect();
    let scored = scored(study, &models);
    if scored.is_empty() {
        return Ok(section.missing(
            "\"models\" or \"more-models\" with names of models, and the experiments \"models\" and \"methods\"",
        ));
    }
    let everywhere: Vec<&str> = (0..models.len())
        .filter(|&i| study.cells().len() == scored.iter().filter(|(_, scores)| scores[i].is_some()).count())
        .map(|i| models[i])
        .collect();
    if everywhere.len() > 1 && everywhere.len() < models.len() {
        let caption = "CSSIM of ours + polish, mean over all lights, of the models that were tried everywhere.";
        let table = by_material(study, &everywhere, caption);
        let csv = table.csv("models-everywhere");
        section.blocks.extend([Block::Table(table), Block::Data(csv)]);
    }
    let caption =
        "CSSIM of ours + polish by model, mean over the lights that have every model of the row; the best in bold.";
    let table = by_material(study, &models, caption);
    let csv = table.csv("models");
    section.blocks.extend([Block::Table(table), Block::Data(csv)]);
    let wins = models.iter().enumerate().map(|(i, model)| {
        let has = scored.iter().filter(|(_, scores)| scores[i].is_some()).count();
        let wins = scored.iter().filter(|(_, scores)| best(scores) == Some(i)).count();
        format!("{model} in {}", text::share(wins, has))
    });
    let wins: Vec<String> = wins.collect();
    section.finding(
        Verdict::Measured,
        format!("Lowest CSSIM, of the cells that a model has beside another: {}.", wins.join(", ")),
    );
    if let Some(table) = cells(study) {
        let csv = table.csv("models-cells");
        section.blocks.extend([Block::Table(table), Block::Data(csv)]);
    }
    let (verdict, words) = claim(study);
    section.finding(verdict, words);
    Ok(section)
}

/// CSSIM of some models in a cell.
type Scored<'a> = ((&'a str, &'a str), Vec<Option<f64>>);

/// The cells that have more than one of the models.
fn scored<'a>(study: &Study<'a>, models: &[&str]) -> Vec<Scored<'a>> {
    let scored = study.cells().into_iter().map(|cell| (cell, scores(study, cell, models)));
    scored.filter(|(_, scores)| scores.iter().flatten().count() > 1).collect()
}

/// Means over the lights, a row for each material.
fn by_material(study: &Study<'_>, models: &[&str], caption: &str) -> Table {
    let scored = scored(study, models);
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
    table
}

fn scores(study: &Study<'_>, cell: (&str, &str), models: &[&str]) -> Vec<Option<f64>> {
    let score =
        |model: &&str| Some(study.find(&Pick { model: Some(*model), ..study.pick(Method::OursPolished, cell) })?.cssim);
    models.iter().map(score).collect()
}

/// The mean of each column over the rows that have all columns of the first row.
fn means(rows: &[&Vec<Option<f64>>], columns: usize) -> Vec<Option<f64>> {
    let has = |i: usize| rows.iter().any(|row| row[i].is_some());
    let complete: Vec<_> = rows.iter().filter(|row| (0..columns).all(|i| row[i].is_some() || !has(i))).collect();
    (0..columns).map(|i| mean(&complete.iter().filter_map(|row| row[i]).collect::<Vec<_>>())).collect()
}

fn best(scores: &[Option<f64>]) -> Option<usize> {
    let there = scores.iter().enumerate().filter_map(|(i, score)| Some((i, (*score)?)));
    there.min_by(|a, b| a.1.total_cmp(&b.1)).map(|best| best.0)
}

/// CSSIM of the study's model with polish, and of the paper's, in the cells that have both.
type Pairs<'a> = Vec<((&'a str, &'a str), f64, f64)>;

/// The paper's model with a method, and the study's model with polish, in some cells.
fn pairs<'a>(study: &Study<'a>, cells: Vec<(&'a str, &'a str)>, rival: Method) -> Pairs<'a> {
    let score = |method, model, cell| Some(study.find(&Pick { model: Some(model), ..study.pick(method, cell) })?.cssim);
    let pair = |cell| Some((cell, score(Method::OursPolished, &study.model, cell)?, score(rival, PAPER, cell)?));
    cells.into_iter().filter_map(pair).collect()
}

/// The scores of both models by cell.
fn cells(study: &Study<'_>) -> Option<Table> {
    let pairs = pairs(study, study.cells(), Method::OursPolished);
    let model = study.model.as_str();
    let caption = format!(
        "CSSIM of ours + polish with {model} and with {PAPER}, the better in bold; a positive difference: {model} is worse."
    );
    let mut table = Table::new(&caption, 2, ["material", "light", model, PAPER, "difference"]);
    for ((material, probe), ours, rival) in &pairs {
        table.scores([*material, text::light(probe)], &[Some(*ours), Some(*rival)]);
        table.rows.last_mut()?.push(Entry::of(text::signed(Some(ours - rival))));
    }
    (model != PAPER && !pairs.is_empty()).then_some(table)
}

/// Whether the study's model is the better one, as GGX is better than Cook-Torrance according to [BP20a], and the numbers.
pub(super) fn claim(study: &Study<'_>) -> (Verdict, String) {
    if study.model == PAPER {
        return (Verdict::NotDecided, format!("{PAPER} is the model of this study."));
    }
    let polished = pairs(study, study.cells(), Method::OursPolished);
    let paper = pairs(study, study.cells(), Method::Paper);
    let margins = |pairs: &Pairs<'_>| pairs.iter().map(|(_, ours, rival)| rival - ours).collect::<Vec<f64>>();
    let (rival, all) = (margins(&polished), margins(&paper));
    let parts: Vec<String> = [
        compared(study, &polished, "both with polish, where both were tried"),
        compared(study, &paper, "the paper's method without polish against ours with it, on all materials"),
    ]
    .into_iter()
    .flatten()
    .collect();
    // The paper's method has no polish, so it is compared only if there is no comparison of the models alone.
    let judged = if rival.is_empty() { &all } else { &rival };
    if parts.is_empty() {
        return (Verdict::NotDecided, text::ABSENT.to_owned());
    }
    let held = if study.model == GGX { " According to [BP20a], GGX is the better model." } else { "" };
    let words = format!("{}{held} Judged by the first: {}.", parts.join(" "), verdict::rule(judged));
    (verdict::paired(judged), words)
}

/// Which of the two models wins, by how much, and where most; `None` if no cell has both.
fn compared(study: &Study<'_>, pairs: &Pairs<'_>, how: &str) -> Option<String> {
    let ours = mean(&pairs.iter().map(|pair| pair.1).collect::<Vec<_>>())?;
    let rival = mean(&pairs.iter().map(|pair| pair.2).collect::<Vec<_>>())?;
    let wins = pairs.iter().filter(|(_, ours, rival)| ours < rival).count();
    let (cell, worst_ours, worst_rival) = pairs.iter().max_by(|a, b| (a.1 - a.2).total_cmp(&(b.1 - b.2)))?;
    let verb = if ours > rival { "loses to" } else { "beats" };
    Some(format!(
        "{} {} {verb} {PAPER} by {} in mean CSSIM ({} against {}; {how}): it is the better one in {} cells, and \
         does worst against it at {} ({} against {}).",
        if study.model == DEFAULT_MODEL.name() { "The default model" } else { "The model" },
        study.model,
        text::score(Some((rival - ours).abs())),
        text::score(Some(ours)),
        text::score(Some(rival)),
        text::share(wins, pairs.len()),
        text::cell(cell.0, cell.1),
        text::score(Some(*worst_ours)),
        text::score(Some(*worst_rival))
    ))
}
