//! The agreement of Eq. 1 with CSSIM in the ranking of matches, and the gain from more candidates.

use crate::{
    chart::{Axis, Plot, Series, colour},
    document::{Block, CsvText, Section, Table},
    measured::{Agreement, Method},
    statistics::{mean, median},
    study::{Match, Study},
    text,
    verdict::Verdict,
};

const MORE: [Method; 4] = [Method::Ours, Method::Subsets, Method::OursPolished, Method::SubsetsPolished];

pub(super) fn section(study: &Study<'_>) -> anyhow::Result<Section> {
    let mut section = Section::new("agreement", "Rank agreement, and more candidates");
    if study.data.agreements.is_empty() {
        section = section.missing("the experiment \"agreement\"");
    } else {
        ranks(study, &mut section)?;
    }
    more(study, &mut section);
    Ok(section)
}

fn ranks(study: &Study<'_>, section: &mut Section) -> anyhow::Result<()> {
    let agreements = &study.data.agreements;
    let mut csv = CsvText::new("rank-agreement", ["material", "light", "gamma", "spearman", "matches"]);
    for agreement in agreements {
        let (gamma, spearman) = (text::exact(Some(agreement.gamma)), text::exact(Some(agreement.spearman)));
        csv.row([agreement.material.clone(), agreement.probe.clone(), gamma, spearman, agreement.matches.to_string()]);
    }
    let probes = study.data.about.probes.iter().enumerate();
    let mut series: Vec<Series> = probes
        .map(|(i, probe)| (text::light(probe).to_owned(), colour(i + 1), by_gamma(agreements, |a| a.probe == *probe)))
        .map(|(name, colour, points)| Series { name, colour, points, joined: true, minimum: false })
        .filter(|series| !series.points.is_empty())
        .collect();
    let all = by_gamma(agreements, |_| true);
    series.insert(
        0,
        Series { name: "all cells".to_owned(), colour: colour(0), points: all.clone(), joined: true, minimum: false },
    );
    let plot = Plot {
        title: "Agreement of Eq. 1 with CSSIM".to_owned(),
        x: Axis::linear("γ of Eq. 1"),
        y: Axis::linear("Spearman's rank correlation (1: the same order)"),
        series,
    };
    section.figure("Mean rank correlation over the cells of each light.", plot.svg()?, csv.done());
    let best = all.iter().max_by(|a, b| a.1.total_cmp(&b.1));
    let worst = all.iter().min_by(|a, b| a.1.total_cmp(&b.1));
    if let Some((best, worst)) = best.zip(worst) {
        let words = format!(
            "Eq. 1 orders matches most like CSSIM at γ = {} (mean rank correlation {}) and least at γ = {} ({}).",
            text::fixed(Some(best.0), 2),
            text::fixed(Some(best.1), 2),
            text::fixed(Some(worst.0), 2),
            text::fixed(Some(worst.1), 2)
        );
        section.finding(Verdict::Measured, words);
    }
    Ok(())
}

/// Means by gamma, in ascending order.
fn by_gamma(agreements: &[Agreement], keep: impl Fn(&Agreement) -> bool) -> Vec<(f64, f64)> {
    let mut kept: Vec<(f64, f64)> =
        agreements.iter().filter(|a| keep(a) && a.spearman.is_finite()).map(|a| (a.gamma, a.spearman)).collect();
    kept.sort_by(|a, b| a.0.total_cmp(&b.0));
    let groups = kept.chunk_by(|a, b| (a.0 - b.0).abs() < 1e-9);
    groups.filter_map(|group| Some((group[0].0, mean(&group.iter().map(|pair| pair.1).collect::<Vec<_>>())?))).collect()
}

fn more(study: &Study<'_>, section: &mut Section) {
    let methods: Vec<Method> = MORE
        .into_iter()
        .filter(|method| study.cells().into_iter().any(|cell| study.grid(*method, cell).is_some()))
        .collect();
    let cells: Vec<Vec<Match<'_>>> = study
        .cells()
        .into_iter()
        .filter_map(|cell| methods.iter().map(|method| study.grid(*method, cell)).collect())
        .collect();
    if !methods.contains(&Method::Subsets) || cells.is_empty() {
        let needs = "More candidates: not in this study: STUDY.toml needs the experiments \"subsets\" and \"methods\".";
        return section.blocks.push(Block::Missing(needs.to_owned()));
    }
    let caption = format!(
        "More candidates from several subsets, over the {} that have every method.",
        text::count(cells.len(), "cell")
    );
    let mut table = Table::new(&caption, 1, ["method", "mean CSSIM", "median CPU s", "median evaluations", "of"]);
    let column = |i: usize, f: &dyn Fn(&Match<'_>) -> f64| cells.iter().map(|cell| f(&cell[i])).collect::<Vec<f64>>();
    for (i, method) in methods.iter().enumerate() {
        table.row([
            text::method(*method).to_owned(),
            text::score(mean(&column(i, &|found| found.cssim))),
            text::significant(median(&column(i, &|found| found.cpu_seconds))),
            text::fixed(median(&column(i, &|found| u32::try_from(found.evaluations).map_or(f64::NAN, f64::from))), 0),
            text::minimised(*method).to_owned(),
        ]);
    }
    let csv = table.csv("more-candidates");
    section.blocks.extend([Block::Table(table), Block::Data(csv)]);
    let of =
        |method| methods.iter().position(|other| *other == method).and_then(|i| mean(&column(i, &|found| found.cssim)));
    let (ours, subsets, polished) = (of(Method::Ours), of(Method::Subsets), of(Method::OursPolished));
    if let Some(((ours, subsets), polished)) = ours.zip(subsets).zip(polished) {
        let closed = (ours > polished).then(|| 100.0 * (ours - subsets) / (ours - polished));
        let words = format!(
            "More candidates lower the mean CSSIM by {}, polish by {}: they close {} % of the gap to polish; confirmed that they close it if the rest is at most 10 %.",
            text::score(Some(ours - subsets)),
            text::score(Some(ours - polished)),
            text::fixed(closed, 0)
        );
        section.finding(Verdict::of(closed.map(|closed| closed >= 90.0)), words);
    }
}
