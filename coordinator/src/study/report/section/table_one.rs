//! The paper's Table 1: mean CSSIM over its six materials by the number of samples.

use crate::study::{
    report::{
        document::{Block, Section, Table},
        statistics::mean,
        study::{Pick, Study},
        text,
        verdict::{self, Verdict},
    },
    row::Method,
};

/// The columns of the table; none is all pixels.
const LEVELS: [Option<u32>; 4] = [Some(32), Some(64), Some(256), None];
/// What the paper prints, by the file of the light.
const PAPER: [(&str, [f64; 4]); 3] = [
    ("grace_cross", [0.0735, 0.0656, 0.0631, 0.6282]),
    ("uffizi", [0.0684, 0.0579, 0.0532, 0.6115]),
    ("rnl_cross", [0.0449, 0.0410, 0.0410, 0.0436]),
];
/// How much worse 32 samples may be than 256: the paper's own largest ratio is 1.29.
const USABLE: f64 = 1.3;
/// More than this is not usable.
const USELESS: f64 = 1.6;

pub(super) fn section(study: &Study<'_>) -> anyhow::Result<Section> {
    let mut section = Section::new("table-1", "Table 1: samples and lights");
    let lights: Vec<_> =
        study.data.about.probes.iter().filter_map(|probe| Some((probe, means(study, probe)?))).collect();
    if lights.is_empty() {
        return Ok(
            section.missing("the method \"ours\" with samples 32, 64, 256 or \"full\" on the materials of the six")
        );
    }
    let columns = ["light", "whose", "materials", "32", "64", "256", "full"];
    let mut table = Table::new(
        "Mean CSSIM of two stages without polish over the six materials, beside the paper's figures.",
        2,
        columns,
    );
    for (probe, (materials, means)) in &lights {
        let mut row = vec![text::light(probe).to_owned(), "ours".to_owned(), materials.to_string()];
        row.extend(means.map(text::score));
        table.row(row);
        if let Some((_, paper)) = PAPER.iter().find(|(name, _)| name == probe) {
            let mut row = vec![text::light(probe).to_owned(), "the paper".to_owned(), "6".to_owned()];
            row.extend(paper.map(|score| text::score(Some(score))));
            table.row(row);
        }
    }
    let csv = table.csv("table1");
    section.blocks.extend([Block::Table(table), Block::Data(csv)]);
    section.text("The paper's .6282 and .6115 are surely misprints of .06282 and .06115: ten times as bad from all pixels as from 32 of them is no result.");
    let (verdict, words) = claim(study);
    section.finding(verdict, words);
    Ok(section)
}

/// The number of materials that have every level that the study has, and their means.
fn means(study: &Study<'_>, probe: &str) -> Option<(usize, [Option<f64>; 4])> {
    let six = &study.data.about.six;
    let score = |material: &str, samples| {
        Some(study.find(&Pick { samples, ..study.pick(Method::Ours, (material, probe)) })?.cssim)
    };
    let measured = |samples: &Option<u32>| six.iter().any(|material| score(material, *samples).is_some());
    let levels: Vec<Option<u32>> = LEVELS.into_iter().filter(measured).collect();
    let complete: Vec<&String> =
        six.iter().filter(|material| levels.iter().all(|samples| score(material, *samples).is_some())).collect();
    let of = |samples: Option<u32>| {
        let scores: Vec<f64> = complete.iter().filter_map(|material| score(material, samples)).collect();
        mean(&scores)
    };
    (!complete.is_empty() && !levels.is_empty()).then(|| (complete.len(), LEVELS.map(of)))
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
