//! Rules of comparison: which rows are compared, and which are left out.

use super::{
    super::{study::Study, verdict::Verdict},
    findings, row, section_of,
    synthetic::{self, base, whole},
    tables,
};
use crate::measured::{Method, Row, StudyData};
use std::collections::BTreeSet;

/// The finding of a section that contains these words.
fn finding(data: &StudyData, id: &str, words: &str) -> (Verdict, String) {
    let section = section_of(data, id);
    let found = findings(&section).into_iter().find(|(_, text)| text.contains(words));
    let (verdict, text) = found.unwrap_or_else(|| panic!("no finding with {words:?} in {:#?}", findings(&section)));
    (verdict, text.to_owned())
}

/// All pixels with three gammas, with CSSIM higher than that of polish by this much.
fn with_few_gammas(more: f64) -> StudyData {
    let mut data = whole();
    let mut candidates = Vec::new();
    for row in
        data.rows.iter_mut().filter(|row| row.method == Method::Ours && row.samples.is_none() && row.shown == row.probe)
    {
        // It is .003 above the base of its cell.
        row.cssim += more - 0.003;
        row.gammas = 3;
        let of = |gamma| Row { method: Method::Candidate, gamma: Some(gamma), ..row.clone() };
        candidates.extend([1.0, 2.0, 3.0].map(of));
    }
    data.rows.extend(candidates);
    data
}

#[test]
fn all_pixels_of_few_exponents_are_compared_with_samples_of_the_same() {
    // At gamma 1, 2 and 3 samples are at best .009 above the base, .004 at all of their exponents.
    let (verdict, words) = finding(&with_few_gammas(0.0095), "full", "differs from that from all pixels");
    assert_eq!(verdict, Verdict::Confirmed, "{words}");
    assert!(words.contains("by 0.0005 on average over 9 cells") && words.contains("best of 3 exponents"), "{words}");
    assert_eq!(finding(&with_few_gammas(0.003), "full", "differs").0, Verdict::NotDecided);
    assert_eq!(finding(&with_few_gammas(-0.002), "full", "differs").0, Verdict::Refuted);
    // Better and worse cells do not cancel.
    let mut data = whole();
    let full = data.rows.iter_mut().filter(|row| row.method == Method::Ours && row.samples.is_none());
    full.enumerate().for_each(|(i, row)| row.cssim += if i % 2 == 0 { 0.03 } else { -0.03 });
    assert_eq!(finding(&data, "full", "differs").0, Verdict::Refuted);
}

#[test]
fn all_pixels_of_few_exponents_have_a_column_and_no_cost() {
    let data = with_few_gammas(0.0095);
    let section = section_of(&data, "table-1");
    let table = tables(&section)[0];
    assert_eq!(table.columns[5..], ["256", "256, gammas of full", "full"]);
    assert_eq!(row(table, &["Grace Cathedral", "ours"])[5..], ["0.0450", "0.0500", "0.0505"]);
    assert!(table.caption.contains("tried with 3 exponents only"), "{}", table.caption);
    assert_eq!(tables(&section_of(&whole(), "table-1"))[0].columns[5..], ["256", "full"]);
    let levels = |data: &StudyData| {
        tables(&section_of(data, "cost"))[0].rows.iter().map(|row| row[0].text.clone()).collect::<Vec<_>>()
    };
    assert_eq!(levels(&data), ["32", "64", "256"]);
    assert_eq!(levels(&whole()), ["32", "64", "256", "full"]);
}

#[test]
fn costs_over_samples_are_of_the_cells_that_have_all() {
    let mut data = whole();
    data.rows.retain(|row| row.samples != Some(32) || row.material != "delrin");
    let section = section_of(&data, "cost");
    assert_eq!(row(tables(&section)[0], &["256"])[1], "9");
    let (_, words) = finding(&data, "cost", "Stage two");
    assert!(words.contains("takes 25.0 % of the CPU seconds") && words.contains("12 cells"), "{words}");
}

#[test]
fn a_rendering_is_charged_as_its_own_light_before_others() {
    let mut data = whole();
    data.direct.retain(|cost| cost.material == "aluminium");
    for cost in data.direct.iter_mut().filter(|cost| cost.probe == "uffizi") {
        cost.seconds = vec![2.0; 3];
    }
    let section = section_of(&data, "cost");
    let charged = |light: &str| row(tables(&section)[1], &["delrin", light])[5].clone();
    // 900 evaluations.
    assert_eq!((charged("Uffizi Gallery"), charged("Grace Cathedral")), ("1800".to_owned(), "450".to_owned()));
}

#[test]
fn the_study_says_what_its_grid_is() {
    let mut data = whole();
    data.about.seed = 3;
    let study = Study::new(&data, BTreeSet::new());
    assert_eq!((study.model.as_str(), study.seed, study.samples), ("ggx", 3, Some(256)));
    data.about.model = "ward".to_owned();
    assert_eq!(Study::new(&data, BTreeSet::new()).model, "ward");
    data.about.model.clear();
    let study = Study::new(&data, BTreeSet::new());
    assert_eq!((study.model.as_str(), study.seed), ("ggx", 0));
}

#[test]
fn a_default_model_that_loses_is_reported_as_such() {
    let claim = "The study's model against the paper's";
    let summary = |data: &StudyData| row(tables(&section_of(data, "summary"))[0], &[claim]);
    assert!(summary(&whole())[2].starts_with("The default model ggx beats cook-torrance by 0.0060"));
    let mut data = whole();
    data.rows.iter_mut().filter(|row| row.model == "cook-torrance").for_each(|row| row.cssim -= 0.02);
    let said = summary(&data);
    assert_eq!(said[1], "Refuted");
    assert!(said[2].starts_with("The default model ggx loses to cook-torrance by 0.0140 in mean CSSIM"), "{}", said[2]);
    let models = section_of(&data, "models");
    assert_eq!(row(tables(&models)[1], &["aluminium", "Uffizi Gallery"])[2..], ["0.0510", "0.0370", "+0.0140"]);
    // .012 - .02, with the paper's method, over all materials.
    assert!(
        said[2].contains("loses to cook-torrance by 0.0080") && said[2].contains("in 0 of 12 cells"),
        "{}",
        said[2]
    );
}

#[test]
fn polish_under_held_out_lights_helps_or_hurts() {
    let (verdict, words) = finding(&whole(), "held-out", "Polish on the fitting light");
    assert!(
        verdict == Verdict::Confirmed && words.contains("helps") && words.contains("lowers CSSIM by 0.0020"),
        "{words}"
    );
    let mut data = whole();
    let polished = |row: &&mut Row| row.method == Method::OursPolished && row.shown != row.probe;
    data.rows.iter_mut().filter(polished).for_each(|row| row.cssim += 0.01);
    let (verdict, words) = finding(&data, "held-out", "Polish on the fitting light");
    assert!(
        verdict == Verdict::Refuted && words.contains("hurts") && words.contains("it raises CSSIM by 0.0080"),
        "{words}"
    );
}

#[test]
fn the_winner_is_compared_with_its_runner_up_under_held_out_lights() {
    let (_, words) = finding(&whole(), "held-out", "The winner of stage two");
    assert!(
        words.contains("0.0635 under") && words.contains("winner's) 0.0655; the winner is the better one in 36 of 36"),
        "{words}"
    );
}

#[test]
fn metrics_of_fewer_cells_and_other_sizes_have_separate_tables() {
    let mut data = whole();
    data.rows.retain(|row| row.metric != "multi-scale" || row.material == "aluminium");
    // The order among the few cells is different, but does not count.
    let few = |row: &&mut Row| row.metric == "multi-scale" && row.method == Method::L2;
    data.rows.iter_mut().filter(few).for_each(|row| row.cssim = 0.0);
    let large =
        |method, cssim| Row { size: 256, searched_size: 256, ..synthetic::row(method, "aluminium", "uffizi", cssim) };
    data.rows.push(Row { start: Some("paper".to_owned()), samples: None, ..large(Method::Brute, 0.08) });
    data.rows.push(large(Method::OursPolished, 0.07));
    data.rows.push(Row { metric: "five scales".to_owned(), ..large(Method::OursPolished, 0.01) });
    let section = section_of(&data, "metrics");
    let tables = tables(&section);
    assert_eq!((tables[0].rows.len(), tables[1].rows.len()), (2, 1));
    assert_eq!(row(tables[1], &["multi-scale"])[2], "3");
    assert_eq!(findings(&section)[0].0, Verdict::Confirmed);
    assert_eq!(row(tables[2], &["128 x 128"])[1..], ["1", "0.0510", "0.0520", "0.0710"]);
    assert_eq!(row(tables[2], &["256 x 256"])[1..], ["1", "0.0700", "0.0800", "–"]);
    assert_eq!(row(tables[3], &["cssim", "paper", "cook-torrance"])[3..5], ["9", "0.0530"]);
    assert!(tables.iter().all(|table| table.rows.iter().all(|row| row[0].text != "five scales")));
}

#[test]
fn low_resolution_is_judged_at_the_large_size_as_well() {
    let mut data = whole();
    for (m, material) in synthetic::MATERIALS[..3].iter().enumerate() {
        let large = |method, cssim| Row { size: 256, ..synthetic::row(method, material, "uffizi", cssim) };
        data.rows.push(Row { samples: Some(32), ..large(Method::Ours, base(m, 1)) });
        for searched_size in [32, 64] {
            data.rows.push(Row { searched_size, samples: None, ..large(Method::LowRes, base(m, 1) - 0.01) });
        }
    }
    let (verdict, words) = finding(&data, "low-resolution", "On images of 256 x 256");
    assert!(verdict == Verdict::Refuted && words.contains("n = 6, sign test p = 0.03"), "{words}");
    assert_eq!(finding(&data, "low-resolution", "On images of 128 x 128").0, Verdict::Confirmed);
    let section = section_of(&data, "low-resolution");
    assert_eq!(row(tables(&section)[0], &["32 x 32", "256 x 256"])[2], "3");
}

#[test]
fn trends_leave_out_the_exponents_of_an_experiment_of_its_own() {
    let mut data = whole();
    let before = section_of(&data, "trends");
    for gamma in [4.0, 5.0] {
        let parameters = [("alpha".to_owned(), 0.0), ("kd".to_owned(), 1.0)].into();
        let candidate = synthetic::row(Method::Candidate, "aluminium", "uffizi", 0.1);
        data.rows.push(Row { gamma: Some(gamma), parameters, ..candidate });
    }
    assert_eq!(section_of(&data, "trends"), before);
    assert_ne!(section_of(&data, "gamma"), section_of(&whole(), "gamma"));
}

#[test]
fn figure_two_shows_the_first_of_the_six() {
    let mut data = whole();
    data.about.six = ["delrin", "aluminium", "red-metallic-paint"].map(str::to_owned).to_vec();
    let section = section_of(&data, "gamma");
    let shown: BTreeSet<&str> = tables(&section)[0].rows.iter().map(|row| row[0].text.as_str()).collect();
    assert_eq!(shown, ["aluminium", "delrin", "red-metallic-paint"].into());
}

#[test]
fn clamping_that_stops_the_spread_or_adds_to_it_refutes_the_paper() {
    let spread = |scale: f64| {
        let mut data = whole();
        for row in data.rows.iter_mut().filter(|row| row.clamped) {
            row.cssim = 0.05 + scale * (row.cssim - 0.05);
            row.gamma = row.gamma.map(|gamma| 1.5 + scale * (gamma - 1.5));
        }
        finding(&data, "clamped", "Clamping takes").0
    };
    assert_eq!([0.1, 1.0, 3.0].map(spread), [Verdict::Refuted, Verdict::Confirmed, Verdict::Refuted]);
}
