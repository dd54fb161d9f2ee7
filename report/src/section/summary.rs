//! The claims, each with its numbers, its rule and its verdict.

use super::{cost, full, held_out, low_resolution, models, table_one};
use crate::{
    document::{Block, Entry, Section, Table},
    measured::Method,
    statistics::mean,
    study::Study,
    text,
    verdict::{self, CELL_SLACK, MEAN_SLACK, Verdict},
};

/// A claim, its verdict and the numbers.
type Claim = (&'static str, (Verdict, String));

pub(super) fn section(study: &Study<'_>) -> anyhow::Result<Section> {
    let mut section = Section::new("summary", "Summary");
    let claims: [Claim; 10] = [
        ("The study's model against the paper's", models::claim(study)),
        ("Ours with polish is as good as brute force", brute(study)),
        ("Ours with polish beats L2 on the fitting light", fitting(study)),
        ("Ours with polish beats L2 under held-out lights", held_out::claim(study, Method::OursPolished)),
        ("The paper: robust under a third light", held_out::claim(study, Method::Ours)),
        ("The paper: 256 samples are close to the full image", full::claim(&full::pairs(study))),
        ("The paper: 32 samples are usable", table_one::claim(study)),
        ("The paper: sharper than low resolution", low_resolution::claim(study)),
        ("The paper: ten times cheaper than brute force", cost::claim(study, Method::Ours)),
        ("The same with polish", cost::claim(study, Method::OursPolished)),
    ];
    let mut table = Table::new(
        "The claims, the verdict on each, and the numbers and the rule of the verdict.",
        3,
        ["claim", "verdict", "numbers and rule"],
    );
    let tried = |(_, (_, numbers)): &&Claim| numbers != text::ABSENT;
    for (claim, (verdict, numbers)) in claims.iter().filter(tried).cloned() {
        table.rows.push(vec![Entry::of(claim), Entry::verdict(verdict), Entry::of(numbers)]);
    }
    if table.rows.is_empty() {
        return Ok(section.missing("an experiment that judges a claim, such as \"methods\""));
    }
    let csv = table.csv("claims");
    section.blocks.extend([Block::Table(table), Block::Data(csv)]);
    worse(study, &mut section);
    Ok(section)
}

/// Ours with polish against the best start of brute force.
fn brute(study: &Study<'_>) -> (Verdict, String) {
    let pairs = study.pairs(Method::OursPolished, Method::Brute);
    if pairs.is_empty() {
        return (Verdict::NotDecided, text::ABSENT.to_owned());
    }
    let scores: Vec<(f64, f64)> = pairs.iter().map(|(_, ours, brute)| (*ours, *brute)).collect();
    let ours = mean(&scores.iter().map(|pair| pair.0).collect::<Vec<_>>());
    let rival = mean(&scores.iter().map(|pair| pair.1).collect::<Vec<_>>());
    let worst = pairs.iter().max_by(|a, b| (a.1 - a.2).total_cmp(&(b.1 - b.2)));
    let worst = worst.map_or_else(String::new, |((material, probe), ours, brute)| {
        format!(" Worst cell: {} at {}.", text::signed(Some(ours - brute)), text::cell(material, probe))
    });
    let words = format!(
        "Mean CSSIM {} against {} over {}, a difference of {}.{worst} Confirmed if the mean difference is at most {MEAN_SLACK} \
         and no difference is above {CELL_SLACK}.",
        text::score(ours),
        text::score(rival),
        text::count(pairs.len(), "cell"),
        text::signed(ours.zip(rival).map(|(ours, rival)| ours - rival))
    );
    (verdict::no_worse(&scores), words)
}

fn fitting(study: &Study<'_>) -> (Verdict, String) {
    let margins: Vec<f64> =
        study.pairs(Method::OursPolished, Method::L2).iter().map(|(_, ours, l2)| l2 - ours).collect();
    if margins.is_empty() {
        return (Verdict::NotDecided, text::ABSENT.to_owned());
    }
    let wins = margins.iter().filter(|margin| **margin > 0.0).count();
    let words = format!(
        "Lower CSSIM in {} cells, by {} on average; {}.",
        text::share(wins, margins.len()),
        text::signed(mean(&margins)),
        verdict::rule(&margins)
    );
    (verdict::paired(&margins), words)
}

/// Every cell where ours is worse by more than [`CELL_SLACK`].
fn worse(study: &Study<'_>, section: &mut Section) {
    let pairs = study.pairs(Method::OursPolished, Method::Brute);
    if pairs.is_empty() {
        let needs = "Against brute force: not in this study: STUDY.toml needs the experiment \"methods\".";
        return section.blocks.push(Block::Missing(needs.to_owned()));
    }
    let losing: Vec<_> = pairs.iter().filter(|(_, ours, brute)| ours - brute > CELL_SLACK).collect();
    if losing.is_empty() {
        return section
            .text(format!("No cell of {} is worse than brute force by more than {CELL_SLACK}.", pairs.len()));
    }
    let mut table = Table::new(
        &format!("Cells worse than brute force by more than {CELL_SLACK}."),
        2,
        ["material", "light", "ours + polish", "brute force", "difference"],
    );
    for ((material, probe), ours, brute) in losing {
        let difference = text::signed(Some(ours - brute));
        table.row([
            (*material).to_owned(),
            text::light(probe).to_owned(),
            text::score(Some(*ours)),
            text::score(Some(*brute)),
            difference,
        ]);
    }
    section.blocks.push(Block::Table(table));
}
