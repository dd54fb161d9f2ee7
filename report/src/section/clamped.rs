//! Eq. 1 on values clamped to [0, 1]: does the dependence on the subset go away?

use crate::{
    chart::{Spread, SpreadRow, colour},
    document::{Block, CsvText, Section, Table},
    measured::{Method, Row},
    statistics::{deviation, mean, range},
    study::{CSSIM, Study},
    text,
    verdict::Verdict,
};

/// The paper's setting.
const SAMPLES: u32 = 32;
/// The entries that a study needs for this section.
const NEEDS: &str = "the experiment \"clamped\" with several seeds, in the paper under Grace Cathedral";
/// Share of the unclamped spread from which on the spread counts as remaining.
const REMAINS: f64 = 0.25;

pub(super) fn section(study: &Study<'_>) -> anyhow::Result<Section> {
    let mut section = Section::new("clamped", "Equation 1 on clamped values");
    let Some(probe) = probe(study) else { return Ok(section.missing(NEEDS)) };
    let mut table = Table::new(
        &format!("Spread over seeds: {SAMPLES} samples, {}.", text::light(probe)),
        2,
        ["material", "Eq. 1 on", "seeds", "mean γ", "sd of γ", "lowest γ", "highest γ", "mean CSSIM", "sd of CSSIM"],
    );
    let mut csv = CsvText::new("clamped", ["material", "clamped", "seed", "gamma", "cssim"]);
    let mut spread = Vec::new();
    let mut deviations = [Vec::new(), Vec::new()];
    for material in &study.data.about.materials {
        let both = [false, true].map(|clamped| rows(study, (material, probe), clamped));
        if both.iter().any(|rows| rows.len() < 2) {
            continue;
        }
        for (clamped, rows) in [false, true].into_iter().zip(&both) {
            let name = if clamped { "clamped" } else { "radiance" };
            let gammas: Vec<f64> = rows.iter().filter_map(|row| row.gamma).collect();
            let scores: Vec<f64> = rows.iter().map(|row| row.cssim).collect();
            let (low, high) = range(&gammas).unzip();
            table.row([
                material.clone(),
                name.to_owned(),
                rows.len().to_string(),
                text::fixed(mean(&gammas), 2),
                text::fixed(deviation(&gammas), 2),
                text::fixed(low, 2),
                text::fixed(high, 2),
                text::score(mean(&scores)),
                text::score(deviation(&scores)),
            ]);
            deviations[usize::from(clamped)].push((deviation(&gammas), deviation(&scores)));
            for row in rows {
                let (seed, gamma) = (row.seed.to_string(), text::exact(row.gamma));
                csv.row([material.clone(), clamped.to_string(), seed, gamma, text::exact(Some(row.cssim))]);
            }
            spread.push(SpreadRow {
                name: format!("{material}, {name}"),
                colour: colour(usize::from(clamped)),
                values: gammas,
            });
        }
    }
    if table.rows.is_empty() {
        return Ok(section.missing(NEEDS));
    }
    let chart =
        Spread { title: "Winning γ over seeds".to_owned(), label: "γ of the winner".to_owned(), rows: spread };
    section.figure("Each dot is a seed; the box is the middle half, the line the median.", chart.svg()?, csv.done());
    section.blocks.push(Block::Table(table));
    let (verdict, words) = judged(&deviations);
    section.finding(verdict, words);
    Ok(section)
}

/// The claim of the paper: the dependence on the subset remains, but is less visible.
fn judged(deviations: &[Vec<(Option<f64>, Option<f64>)>; 2]) -> (Verdict, String) {
    let of = |i: usize| {
        let gammas: Vec<f64> = deviations[i].iter().filter_map(|pair| pair.0).collect();
        let scores: Vec<f64> = deviations[i].iter().filter_map(|pair| pair.1).collect();
        (mean(&gammas), mean(&scores))
    };
    let ((gamma, score), (clamped_gamma, clamped_score)) = (of(0), of(1));
    let holds = score.zip(clamped_score).map(|(free, clamped)| clamped <= free);
    let share = |free: Option<f64>, clamped: Option<f64>| {
        let ratio = free.zip(clamped).filter(|(free, _)| *free > 0.0).map(|(free, clamped)| 100.0 * clamped / free);
        text::fixed(ratio, 0)
    };
    // Less spread, but most of it remains, in both gamma and score.
    let remains = gamma.zip(clamped_gamma).map(|(free, clamped)| clamped >= REMAINS * free);
    let remains =
        remains.zip(score.zip(clamped_score)).map(|(gamma, (free, clamped))| gamma && clamped >= REMAINS * free);
    let holds = holds.zip(remains).map(|(less, remains)| less && remains);
    let words = format!(
        "Clamping takes the spread over seeds of the winning γ from {} to {} ({} %) and that of CSSIM from {} to {} ({} %; mean \
         of the standard deviations over {}). The paper says that the dependence on the subset remains, less visibly: confirmed \
         if both keep at least {} % of the unclamped spread and CSSIM spreads no more than unclamped.",
        text::fixed(gamma, 2),
        text::fixed(clamped_gamma, 2),
        share(gamma, clamped_gamma),
        text::score(score),
        text::score(clamped_score),
        share(score, clamped_score),
        text::count(deviations[0].len(), "material"),
        text::fixed(Some(100.0 * REMAINS), 0)
    );
    (Verdict::of(holds), words)
}

/// The light with clamped measurements; the paper's if it is among them.
fn probe<'a>(study: &Study<'a>) -> Option<&'a str> {
    let measured = |probe: &&String| study.data.rows.iter().any(|row| row.clamped && row.probe == **probe);
    let mut probes: Vec<&String> = study.data.about.probes.iter().filter(measured).collect();
    probes.sort_by_key(|probe| *probe != "grace_cross");
    probes.first().map(|probe| probe.as_str())
}

/// One match for each seed.
fn rows<'a>(study: &Study<'a>, (material, probe): (&str, &str), clamped: bool) -> Vec<&'a Row> {
    let meant = |row: &&Row| {
        row.method == Method::Ours
            && row.material == material
            && (row.probe == probe && row.shown == probe)
            && row.samples == Some(SAMPLES)
            && row.sampling == "importance"
            && (row.clamped == clamped && row.subsets <= 1)
            && (row.size == study.size() && row.metric == CSSIM && row.model == study.model)
    };
    let mut rows: Vec<&Row> = study.data.rows.iter().filter(meant).collect();
    rows.sort_by_key(|row| row.seed);
    rows.dedup_by_key(|row| row.seed);
    rows
}
