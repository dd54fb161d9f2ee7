//! The paper's Figure 4: matches under a light that was not used for the fit.

use crate::{
    chart::{Bars, Group, method_colour},
    document::{Block, Panel, Section, StripRow, Table},
    measured::{APART, Method},
    statistics::mean,
    study::{Pick, Study},
    text,
    verdict::{self, Verdict},
};
use std::collections::BTreeSet;

/// The methods, in the order of the bars.
const METHODS: [Method; 4] = [Method::L2, Method::RunnerUp, Method::Ours, Method::OursPolished];
/// Number of materials with pictures.
const SHOWN: usize = 4;

/// A match under another light: the cell, that light, and the scores by [`METHODS`].
type Case<'a> = ((&'a str, &'a str), &'a str, [Option<f64>; 4]);

pub(super) fn section(study: &Study<'_>) -> anyhow::Result<Section> {
    let mut section = Section::new("held-out", "Figure 4: under a light that the fit has not seen");
    let cases = cases(study);
    if cases.is_empty() {
        return Ok(section.missing("the experiment \"held-out\", and a light that is not the fitting one"));
    }
    let names = METHODS.map(text::method);
    let mut table = Table::new(
        "CSSIM under the held-out light; the best of each row in bold.",
        3,
        ["material", "fitted under", "shown under"].into_iter().chain(names),
    );
    for ((material, probe), shown, scores) in &cases {
        table.scores([*material, text::light(probe), text::light(shown)], scores);
    }
    let csv = table.csv("fig4-held-out");
    section.strip("Under the light that the fit has not seen.", strip(study, &cases));
    for material in &study.data.about.materials {
        let of: Vec<&Case<'_>> = cases.iter().filter(|case| case.0.0 == material).collect();
        if !of.is_empty() {
            let (svg, part) = (draw(material, &of)?, part(&table, material));
            section.figure(&format!("{material} under held-out lights."), svg, part);
        }
    }
    section.blocks.extend([Block::Table(table), Block::Data(csv)]);
    for method in [Method::Ours, Method::OursPolished] {
        let (verdict, words) = claim(study, method);
        section.finding(verdict, words);
    }
    if let Some((verdict, words)) = polish(&cases) {
        section.finding(verdict, words);
    }
    if let Some(words) = runner_up(&cases) {
        section.finding(Verdict::Measured, words);
    }
    Ok(section)
}

/// Every match that was scored under another light and has a rival.
fn cases<'a>(study: &Study<'a>) -> Vec<Case<'a>> {
    let about = &study.data.about;
    let lights: Vec<&str> = about.probes.iter().chain(&about.held_out).map(String::as_str).collect();
    let measured: BTreeSet<(&str, &str)> =
        study.data.rows.iter().map(|row| (row.material.as_str(), row.shown.as_str())).collect();
    let mut cases: Vec<Case<'a>> = Vec::new();
    for cell in study.cells() {
        for shown in lights.iter().copied().filter(|shown| *shown != cell.1 && measured.contains(&(cell.0, *shown))) {
            let score = |method| Some(study.find(&Pick { shown, ..study.pick(method, cell) })?.cssim);
            let scores = METHODS.map(score);
            let new = cases.iter().all(|case| (case.0, case.1) != (cell, shown));
            if new && scores.iter().flatten().count() > 1 {
                cases.push((cell, shown, scores));
            }
        }
    }
    cases
}

/// The difference by which a method's CSSIM is lower than that of L2, under held-out lights.
pub(super) fn margins(study: &Study<'_>, method: Method) -> Vec<f64> {
    let place = METHODS.iter().position(|other| *other == method);
    let margin = |case: &Case<'_>| Some(case.2[0]? - case.2[place?]?);
    cases(study).iter().filter_map(margin).collect()
}

/// Whether a method is robust under a third light, and the numbers.
pub(super) fn claim(study: &Study<'_>, method: Method) -> (Verdict, String) {
    let margins = margins(study, method);
    if margins.is_empty() {
        return (Verdict::NotDecided, text::ABSENT.to_owned());
    }
    let wins = margins.iter().filter(|margin| **margin > 0.0).count();
    let words = format!(
        "Under held-out lights {} beats L2 in {} cases, by a CSSIM of {} on average; {}.",
        text::method(method),
        text::share(wins, margins.len()),
        text::signed(mean(&margins)),
        verdict::rule(&margins)
    );
    (verdict::paired(&margins), words)
}

/// Whether polish on the fitting light helps under another, and the numbers.
fn polish(cases: &[Case<'_>]) -> Option<(Verdict, String)> {
    let margins: Vec<f64> =
        cases.iter().filter_map(|(_, _, [.., ours, polished])| Some((*ours)? - (*polished)?)).collect();
    let mean = mean(&margins)?;
    let wins = margins.iter().filter(|margin| **margin > 0.0).count();
    let verb = if mean > 0.0 { "helps" } else { "hurts" };
    let words = format!(
        "Polish on the fitting light {verb} under held-out lights: it {} CSSIM by {} on average, and lowers it in {} cases; that \
         it helps is judged so: {}.",
        if mean > 0.0 { "lowers" } else { "raises" },
        text::score(Some(mean.abs())),
        text::share(wins, margins.len()),
        verdict::rule(&margins)
    );
    Some((verdict::paired(&margins), words))
}

/// Whether the winner of stage two, which judges under the light of the fit, is also the best under another light.
fn runner_up(cases: &[Case<'_>]) -> Option<String> {
    let pairs: Vec<(f64, f64)> =
        cases.iter().filter_map(|(_, _, [_, runner_up, ours, _])| Some(((*runner_up)?, (*ours)?))).collect();
    let wins = pairs.iter().filter(|(runner_up, ours)| ours < runner_up).count();
    let column = |value: fn(&(f64, f64)) -> f64| mean(&pairs.iter().map(value).collect::<Vec<_>>());
    Some(format!(
        "The winner of stage two scores {} under held-out lights on average, its runner-up (the best of the γs that are at least \
         {APART} from the winner's) {}; the winner is the better one in {} cases.",
        text::score(Some(column(|pair| pair.1)?)),
        text::score(Some(column(|pair| pair.0)?)),
        text::share(wins, pairs.len())
    ))
}

fn draw(material: &str, cases: &[&Case<'_>]) -> anyhow::Result<String> {
    let groups = cases.iter().map(|((_, probe), shown, scores)| Group {
        name: format!("{} → {}", text::light(probe), text::light(shown)),
        bars: scores.to_vec(),
    });
    let kinds = METHODS.map(|method| (text::method(method).to_owned(), method_colour(method))).to_vec();
    let title = format!("{material}, fitted under → shown under");
    Bars { title, label: "CSSIM (lower is better)".to_owned(), kinds, groups: groups.collect() }.svg()
}

/// The rows of one material, as the data of its figure.
fn part(table: &Table, material: &str) -> crate::document::Csv {
    let rows = table.rows.iter().filter(|row| row[0].text == material).cloned().collect();
    Table { rows, ..table.clone() }.csv(&format!("fig4-held-out-{material}"))
}

/// The first case of each material that has pictures.
fn strip(study: &Study<'_>, cases: &[Case<'_>]) -> Vec<StripRow> {
    let mut rows = Vec::new();
    let mut done: Vec<&str> = Vec::new();
    for (cell, shown, [l2, .., polished]) in cases {
        let picture = |what| study.held_out_picture(*cell, shown, what);
        if done.contains(&cell.0) || done.len() == SHOWN || picture("photo").is_none() {
            continue;
        }
        done.push(cell.0);
        let panels = vec![
            Panel::new("photo", String::new(), picture("photo")),
            Panel::new(text::method(Method::OursPolished), text::score(*polished), picture("ours+polish")),
            Panel::new(text::method(Method::L2), text::score(*l2), picture("l2")),
        ];
        rows.push(StripRow { label: format!("{} → {}", text::cell(cell.0, cell.1), text::light(shown)), panels });
    }
    rows
}
