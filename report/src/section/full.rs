//! The paper's Figure 3: the full image against 256 samples.

use crate::{
    chart::{Bars, Group, method_colour},
    differences::GAIN,
    document::{Block, Panel, Section, StripRow, Table},
    measured::{Method, Row},
    statistics::mean,
    study::{Match, Pick, Study},
    text,
    verdict::{self, CELL_SLACK, Verdict},
};
use std::collections::BTreeSet;

/// A cell and its scores from samples and from all pixels, for the same gammas.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pair<'a> {
    cell: (&'a str, &'a str),
    /// The score of the winner among the gammas that all pixels were tried with.
    pub(super) sampled: f64,
    pub(super) full: f64,
    /// Number of gammas that both were tried with.
    pub(super) gammas: u32,
    /// Whether samples were tried with more gammas.
    pub(super) is_restricted: bool,
}

impl Pair<'_> {
    /// The excess in CSSIM due to sampling; negative if samples are better.
    fn excess(&self) -> f64 {
        self.sampled - self.full
    }
}

/// The mean difference up to which a match from samples is close to one from all pixels.
const CLOSE: f64 = 0.005;

pub(super) fn section(study: &Study<'_>) -> anyhow::Result<Section> {
    let samples = study.samples.map_or_else(|| "256".to_owned(), |samples| samples.to_string());
    let mut section = Section::new("full", &format!("Figure 3: {samples} samples against the full image"));
    let pairs = pairs(study);
    if pairs.is_empty() {
        return Ok(section.missing("the experiments \"samples\" and \"methods\""));
    }
    let (material, light) = ("material".to_owned(), "light".to_owned());
    let columns =
        [material, light, "γs".to_owned(), format!("{samples} samples"), "full".to_owned(), "difference".to_owned()];
    let caption = format!(
        "CSSIM of two stages without polish, {}; a positive difference is the price of sampling.",
        exponents(&pairs)
    );
    let mut table = Table::new(&caption, 2, columns);
    for pair in &pairs {
        table.row([
            pair.cell.0.to_owned(),
            text::light(pair.cell.1).to_owned(),
            pair.gammas.to_string(),
            text::score(Some(pair.sampled)),
            text::score(Some(pair.full)),
            text::signed(Some(pair.excess())),
        ]);
    }
    let kinds = vec![
        (format!("{samples} samples"), method_colour(Method::Ours)),
        ("full image".to_owned(), method_colour(Method::OursPolished)),
    ];
    let groups = pairs.iter().map(|pair| Group {
        name: text::cell(pair.cell.0, pair.cell.1),
        bars: vec![Some(pair.sampled), Some(pair.full)],
    });
    let title = format!("{samples} samples against all pixels");
    let bars = Bars { title, label: "CSSIM (lower is better)".to_owned(), kinds, groups: groups.collect() };
    let caption = format!(
        "The photo, the matches of all exponents that each was tried with, and the absolute difference of each from the \
         photo, {GAIN} times as bright."
    );
    section.strip(&caption, strip(study, &samples));
    section.figure(
        "CSSIM of the match from samples and of the match from all pixels.",
        bars.svg()?,
        table.csv("fig3-full"),
    );
    section.blocks.push(Block::Table(table));
    let (verdict, words) = claim(&pairs);
    section.finding(verdict, words);
    Ok(section)
}

/// The cells of the six that have both.
pub(super) fn pairs<'a>(study: &Study<'a>) -> Vec<Pair<'a>> {
    let of = |cell| pair(study, cell, study.samples?);
    study.six().into_iter().filter_map(of).collect()
}

/// A cell's scores from `samples` pixels and from all pixels. If all pixels were tried with fewer gammas, only these gammas are used for
/// the samples as well.
pub(super) fn pair<'a>(study: &Study<'a>, cell: (&'a str, &'a str), samples: u32) -> Option<Pair<'a>> {
    let full = study.find(&Pick { samples: None, ..study.pick(Method::Ours, cell) })?;
    let sampled = study.find(&Pick { samples: Some(samples), ..study.pick(Method::Ours, cell) })?;
    let of = |sampled, is_restricted| Pair { cell, sampled, full: full.cssim, gammas: full.row.gammas, is_restricted };
    if full.row.gammas >= sampled.row.gammas {
        return Some(of(sampled.cssim, false));
    }
    let candidates = |samples| study.rows(&Pick { samples, ..study.pick(Method::Candidate, cell) });
    let tried: Vec<f64> = candidates(None).iter().filter_map(|row| row.gamma).collect();
    let is_tried = |row: &&Row| row.gamma.is_some_and(|gamma| tried.iter().any(|tried| (tried - gamma).abs() < 1e-9));
    // Of several rows of the same match the first counts, as everywhere.
    let mut same: Vec<&Row> = Vec::new();
    for row in candidates(Some(samples)).into_iter().filter(is_tried) {
        if same.iter().all(|known| known.gamma != row.gamma) {
            same.push(row);
        }
    }
    let is_whole = !same.is_empty() && tried.iter().all(|gamma| same.iter().any(|row| row.gamma == Some(*gamma)));
    let best = same.iter().map(|row| row.cssim).min_by(f64::total_cmp);
    best.filter(|_| is_whole).map(|best| of(best, true))
}

/// The number of gammas of the comparison, in words.
fn exponents(pairs: &[Pair<'_>]) -> String {
    let gammas: BTreeSet<u32> = pairs.iter().map(|pair| pair.gammas).collect();
    let gammas: Vec<String> = gammas.into_iter().map(|gammas| gammas.to_string()).collect();
    let why = if pairs.iter().any(|pair| pair.is_restricted) {
        ", which are all that the full image was tried with; samples are held to the same"
    } else {
        ""
    };
    format!("the best of {} exponents{why}", text::list(&gammas))
}

/// Whether samples come close to all pixels, and the numbers.
pub(super) fn claim(pairs: &[Pair<'_>]) -> (Verdict, String) {
    let excess: Vec<f64> = pairs.iter().map(Pair::excess).collect();
    let off: Vec<f64> = excess.iter().map(|excess| excess.abs()).collect();
    let Some(worst) = pairs.iter().max_by(|a, b| a.excess().abs().total_cmp(&b.excess().abs())) else {
        return (Verdict::NotDecided, text::ABSENT.to_owned());
    };
    let words = format!(
        "CSSIM from samples differs from that from all pixels by {} on average over {} (with sign, positive worse: {}), at most by {} \
         ({}); each is {}. Confirmed if the mean absolute difference is at most {CLOSE:.3} and no difference is above \
         {CELL_SLACK:.2}; refuted if the mean is above {CELL_SLACK:.2}.",
        text::score(mean(&off)),
        text::count(pairs.len(), "cell"),
        text::signed(mean(&excess)),
        text::signed(Some(worst.excess())),
        text::cell(worst.cell.0, worst.cell.1),
        exponents(pairs)
    );
    let verdict = match verdict::between(mean(&off), CLOSE, CELL_SLACK) {
        Verdict::Confirmed if worst.excess().abs() > CELL_SLACK => Verdict::NotDecided,
        verdict => verdict,
    };
    (verdict, words)
}

/// For each material, the first light with pictures of both.
fn strip(study: &Study<'_>, samples: &str) -> Vec<StripRow> {
    let mut rows: Vec<StripRow> = Vec::new();
    let mut done: Vec<&str> = Vec::new();
    for cell in study.six() {
        let picture = |what| study.picture(cell, study.size(), what);
        let find = |samples| study.find(&Pick { samples, ..study.pick(Method::Ours, cell) });
        let Some((sampled, full)) = find(study.samples).zip(find(None)) else { continue };
        if done.contains(&cell.0) || picture("full").is_none() {
            continue;
        }
        done.push(cell.0);
        let note = |found: &Match<'_>| {
            let gammas = if found.row.gammas > 0 { format!(" · {} γs", found.row.gammas) } else { String::new() };
            text::score(Some(found.cssim)) + &gammas
        };
        let panels = vec![
            Panel::new("photo", String::new(), picture("photo")),
            Panel::new(&format!("{samples} samples"), note(&sampled), picture("ours")),
            Panel::new("full image", note(&full), picture("full")),
            Panel::new(&format!("difference of {samples}"), String::new(), picture("difference-ours")),
            Panel::new("difference of full", String::new(), picture("difference-full")),
        ];
        rows.push(StripRow { label: text::cell(cell.0, cell.1), panels });
    }
    rows
}
