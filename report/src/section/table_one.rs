//! The paper's Table 1: mean CSSIM over its six materials by the number of samples.

use super::full::{self, Pair};
use crate::{
    document::{Block, Section, Table},
    measured::Method,
    statistics::mean,
    study::{Pick, Study},
    text,
    verdict::{self, Verdict},
};
use std::collections::BTreeSet;

/// The numbers of samples in the paper's table; `None` is all pixels.
const LEVELS: [Option<u32>; 4] = [Some(32), Some(64), Some(256), None];
/// The values in the paper, by the file of the light.
const PAPER: [(&str, [f64; 4]); 3] = [
    ("grace_cross", [0.0735, 0.0656, 0.0631, 0.6282]),
    ("uffizi", [0.0684, 0.0579, 0.0532, 0.6115]),
    ("rnl_cross", [0.0449, 0.0410, 0.0410, 0.0436]),
];
/// The heading of the column of 256 samples with only the gammas that all pixels were tried with.
const OF_FULL: &str = "256, gammas of full";
/// Largest ratio of 32 samples to 256 that counts as usable; the largest ratio in the paper is 1.29.
const USABLE: f64 = 1.3;
/// A ratio above this counts as not usable.
const USELESS: f64 = 1.6;

pub(super) fn section(study: &Study<'_>) -> anyhow::Result<Section> {
    let mut section = Section::new("table-1", "Table 1: samples and lights");
    let lights: Vec<_> =
        study.data.about.probes.iter().filter_map(|probe| Some((probe, means(study, probe)?))).collect();
    if lights.is_empty() {
        return Ok(section.missing("the experiment \"samples\", and the materials of the six"));
    }
    let gammas: BTreeSet<u32> =
        study.six().into_iter().filter_map(|cell| restricted(study, cell)).map(|pair| pair.gammas).collect();
    let gammas: Vec<String> = gammas.into_iter().map(|gammas| gammas.to_string()).collect();
    let of_full = (!gammas.is_empty()).then(|| OF_FULL.to_owned());
    let mut caption =
        "Mean CSSIM of two stages without polish over the six materials, beside the paper's figures.".to_owned();
    if of_full.is_some() {
        let more = format!(
            " All pixels were tried with {} exponents only, samples with more: beside full stands 256 held to the same.",
            text::list(&gammas)
        );
        caption.push_str(&more);
    }
    let columns = ["light", "whose", "materials", "32", "64", "256"].map(str::to_owned).into_iter();
    let columns = columns.chain(of_full.clone()).chain(["full".to_owned()]);
    let mut table = Table::new(&caption, 2, columns);
    for (probe, means) in &lights {
        let mut add = |whose: &str, materials: String, scores: [Option<f64>; 4], same: Option<f64>| {
            let mut row = vec![text::light(probe).to_owned(), whose.to_owned(), materials];
            row.extend(scores[..3].iter().map(|score| text::score(*score)));
            row.extend(of_full.iter().map(|_| text::score(same)));
            row.push(text::score(scores[3]));
            table.row(row);
        };
        add("ours", means.materials.to_string(), means.scores, means.of_full);
        if let Some((_, paper)) = PAPER.iter().find(|(name, _)| name == probe) {
            add("the paper", "6".to_owned(), paper.map(Some), None);
        }
    }
    let csv = table.csv("table1");
    section.blocks.extend([Block::Table(table), Block::Data(csv)]);
    section.text("The paper's .6282 and .6115 are probably misprints of .06282 and .06115: a match from all pixels cannot be ten times as bad as one from 32 of them.");
    let (verdict, words) = claim(study);
    section.finding(verdict, words);
    Ok(section)
}

/// The paper's value for 256 samples under a light.
pub(super) fn paper_256(probe: &str) -> Option<f64> {
    PAPER.iter().find(|(name, _)| *name == probe).map(|(_, scores)| scores[2])
}

/// Means under one light, over the materials that have every number of samples that the study has there.
struct Means {
    materials: usize,
    /// In the order of [`LEVELS`].
    scores: [Option<f64>; 4],
    /// 256 samples with only the gammas that all pixels were tried with, if those are fewer.
    of_full: Option<f64>,
}

/// 256 samples and all pixels with the gammas of the latter, if those are fewer.
fn restricted<'a>(study: &Study<'a>, cell: (&'a str, &'a str)) -> Option<Pair<'a>> {
    full::pair(study, cell, 256).filter(|pair| pair.is_restricted)
}

fn means(study: &Study<'_>, probe: &str) -> Option<Means> {
    let six = &study.data.about.six;
    let score = |material: &str, samples| {
        Some(study.find(&Pick { samples, ..study.pick(Method::Ours, (material, probe)) })?.cssim)
    };
    let same = |material: &str| restricted(study, (material, probe)).map(|pair| pair.sampled);
    let measured = |samples: &Option<u32>| six.iter().any(|material| score(material, *samples).is_some());
    let levels: Vec<Option<u32>> = LEVELS.into_iter().filter(measured).collect();
    let is_restricted = six.iter().any(|material| same(material).is_some());
    let is_complete = |material: &&String| {
        levels.iter().all(|samples| score(material, *samples).is_some()) && (!is_restricted || same(material).is_some())
    };
    let complete: Vec<&String> = six.iter().filter(is_complete).collect();
    let over = |score: &dyn Fn(&str) -> Option<f64>| {
        mean(&complete.iter().filter_map(|material| score(material)).collect::<Vec<_>>())
    };
    let scores = LEVELS.map(|samples| over(&|material| score(material, samples)));
    let of_full = over(&same);
    (!complete.is_empty() && !levels.is_empty()).then_some(Means { materials: complete.len(), scores, of_full })
}

/// Whether 32 samples are usable, and the numbers.
pub(super) fn claim(study: &Study<'_>) -> (Verdict, String) {
    let both = |cell| {
        let at = |samples| Some(study.find(&Pick { samples: Some(samples), ..study.pick(Method::Ours, cell) })?.cssim);
        Some((at(32)?, at(256)?))
    };
    let pairs: Vec<(f64, f64)> = study.cells().into_iter().filter_map(both).collect();
    if pairs.is_empty() {
        return (Verdict::NotDecided, text::ABSENT.to_owned());
    }
    let few = mean(&pairs.iter().map(|pair| pair.0).collect::<Vec<_>>());
    let many = mean(&pairs.iter().map(|pair| pair.1).collect::<Vec<_>>());
    let ratio = few.zip(many).map(|(few, many)| few / many);
    let words = format!(
        "Mean CSSIM over {} is {} from 32 samples and {} from 256, a ratio of {} (the paper: 1.10 to 1.29); usable up to \
         {USABLE}, not above {USELESS}.",
        text::count(pairs.len(), "cell"),
        text::score(few),
        text::score(many),
        text::fixed(ratio, 2)
    );
    (verdict::between(ratio, USABLE, USELESS), words)
}
