//! The stored results of a cell, in the folder of results: numbers as JSON, images as OpenEXR and PNG. A cell that has a record
//! is complete and is not computed again.

use super::planner::Outcome;
use crate::outputs::OutFolder;
use anyhow::Context;
use lookalike::{
    fit::{Judged, Polished},
    image::{Image, decode, openexr, png},
    math::to_f32,
    plan::{FitOutcome, Work},
};
use serde::{Deserialize, Serialize};
use std::{collections::BTreeMap, fs};

/// The numbers of a cell.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Record {
    /// What its nodes computed, by label.
    pub(super) work: BTreeMap<String, Cost>,
    pub(super) content: Content,
}

/// The numbers, depending on the task of the cell.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) enum Content {
    Photo {
        /// Standard error of a typical pixel relative to its own luminance.
        noise: Option<f64>,
    },
    Table,
    Fit {
        candidates: Vec<Match>,
        winner: usize,
        polished: Option<Match>,
        /// Evaluations of the coarse picture before polish.
        explored: usize,
    },
    Survey {
        minima: Vec<Match>,
        appraisals: Vec<Appraised>,
        /// The points that were appraised.
        points: Vec<Vec<f64>>,
    },
}

/// What a node's seconds count for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Cost {
    Table,
    /// The search of the candidate or minimum at this place.
    Search(usize),
    StageTwo,
    StageThree,
    Pictures,
    Other,
}

impl From<Work> for Cost {
    fn from(work: Work) -> Self {
        match work {
            Work::Table => Self::Table,
            Work::Search(place) => Self::Search(place),
            Work::StageTwo => Self::StageTwo,
            Work::StageThree => Self::StageThree,
            Work::Pictures => Self::Pictures,
            Work::Other => Self::Other,
        }
    }
}

/// A match.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Match {
    pub(super) parameters: Vec<f64>,
    pub(super) cssim: f64,
    pub(super) cssim_object: f64,
    pub(super) evaluations: usize,
    /// `None` unless it is a candidate.
    pub(super) gamma: Option<f64>,
    /// `None` unless it is a candidate.
    pub(super) cost: Option<f64>,
}

/// A point with its scores.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Appraised {
    pub(super) cssim: f64,
    pub(super) cssim_object: f64,
    pub(super) costs: Vec<f64>,
}

impl Match {
    fn of_candidate(judged: &Judged) -> Self {
        let candidate = &judged.candidate;
        Self {
            parameters: candidate.parameters.clone(),
            cssim: judged.cssim,
            cssim_object: judged.cssim_object,
            evaluations: candidate.evaluations,
            gamma: Some(candidate.gamma),
            cost: Some(candidate.cost),
        }
    }

    fn of_polished(polished: &Polished) -> Self {
        Self {
            parameters: polished.parameters.clone(),
            cssim: polished.cssim,
            cssim_object: polished.cssim_object,
            evaluations: polished.evaluations,
            gamma: None,
            cost: None,
        }
    }
}

impl Content {
    /// The numbers of an outcome.
    pub(super) fn of(outcome: &Outcome, points: Vec<Vec<f64>>) -> Self {
        match outcome {
            Outcome::Photo(_, noise) => Self::Photo { noise: *noise },
            Outcome::Fit(outcome) => {
                let FitOutcome { judged, winner, polished, explored, .. } = &**outcome;
                Self::Fit {
                    candidates: judged.iter().map(Match::of_candidate).collect(),
                    winner: *winner,
                    polished: polished.as_ref().map(Match::of_polished),
                    explored: *explored,
                }
            }
            Outcome::Survey(outcome) => {
                let appraised = outcome.appraisals.iter().map(|a| Appraised {
                    cssim: a.cssim,
                    cssim_object: a.cssim_object,
                    costs: a.costs.clone(),
                });
                let minima = outcome.minima.iter().map(Match::of_polished).collect();
                Self::Survey { minima, appraisals: appraised.collect(), points }
            }
        }
    }

    /// The minimum with the lowest value.
    pub(super) fn minimum(&self) -> Option<&Match> {
        let Self::Survey { minima, .. } = self else { return None };
        minima.iter().min_by(|a, b| a.cssim.total_cmp(&b.cssim))
    }
}

/// Writes the record of a cell, which makes the cell complete.
pub(super) fn write(out: &OutFolder, name: &str, record: &Record) -> anyhow::Result<()> {
    let text = serde_json::to_string(record).context("a record")?;
    out.sub("cells")?.write(&format!("{name}.json"), text.as_bytes())
}

/// The record of a cell, if it is complete.
pub(super) fn read(out: &OutFolder, name: &str) -> anyhow::Result<Option<Record>> {
    let path = out.file("cells").join(format!("{name}.json"));
    if !path.exists() {
        return Ok(None);
    }
    let shown = path.display();
    let text = fs::read_to_string(&path).with_context(|| format!("cannot read {shown}"))?;
    let record = serde_json::from_str(&text);
    Ok(Some(
        record.with_context(|| {
            format!("{shown} is not a record of a study; remove it, and --resume computes it again")
        })?,
    ))
}

/// Writes a linear image of a cell.
pub(super) fn write_image(out: &OutFolder, name: &str, image: &Image) -> anyhow::Result<()> {
    let bytes = openexr::write(image, None, &[]).with_context(|| name.to_owned())?;
    out.sub("cells")?.write(&format!("{name}.exr"), &bytes)
}

/// An image of a cell, if it was written.
pub(super) fn read_image(out: &OutFolder, name: &str) -> anyhow::Result<Option<Image>> {
    let path = out.file("cells").join(format!("{name}.exr"));
    if !path.exists() {
        return Ok(None);
    }
    let shown = path.display().to_string();
    let bytes = fs::read(&path).with_context(|| format!("cannot read {shown}"))?;
    Ok(Some(decode(&shown, &bytes)?.image))
}

/// Writes an image as a display shows it.
pub(super) fn write_picture(out: &OutFolder, name: &str, image: &Image, exposure: f64) -> anyhow::Result<()> {
    let pixels = image.pixels().iter().map(|rgb| rgb.map(|x| to_f32(f64::from(x) * exposure))).collect();
    let shown = Image::from_pixels(image.width(), image.height(), pixels);
    let about = [("display_exposure".to_owned(), exposure.to_string())];
    let bytes = png::write(&shown, &about).with_context(|| name.to_owned())?;
    out.sub("pictures")?.write(&format!("{name}.png"), &bytes)
}
