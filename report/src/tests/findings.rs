//! Numbers and verdicts of each section, confirmed and refuted.

use super::{
    super::verdict::Verdict,
    findings, row, section_of,
    synthetic::{empty, whole},
    tables,
};
use crate::measured::{Method, Row, StudyData};

/// The study with every CSSIM of a method changed by a function.
fn changed(keep: impl Fn(&Row) -> bool, by: f64) -> StudyData {
    let mut data = whole();
    data.rows.iter_mut().filter(|row| keep(row)).for_each(|row| row.cssim += by);
    data
}

fn verdict(data: &StudyData, claim: &str) -> String {
    row(tables(&section_of(data, "summary"))[0], &[claim])[1].clone()
}

#[test]
fn every_claim_of_the_synthetic_study_is_confirmed() {
    let summary = section_of(&whole(), "summary");
    let claims = tables(&summary)[0];
    for entry in &claims.rows {
        assert_eq!(entry[1].text, "Confirmed", "{}: {}", entry[0].text, entry[2].text);
    }
    let brute = &row(claims, &["Ours with polish is as good as brute force"])[2];
    // Means of .04 + .0015 + .01, and of .001 more.
    assert!(brute.starts_with("Mean CSSIM 0.0515 against 0.0525 over 12 cells, a difference of −0.0010."), "{brute}");
    // 900 evaluations of half a second against two; twice as many from both starts.
    let cost = &row(claims, &["The paper: ten times cheaper than brute force"])[2];
    assert!(
        cost.contains(
            "costs 225 times ours (median over 12 cells, lowest 225); from all its starts together 450 times"
        ),
        "{cost}"
    );
    // 40 seconds on tables against two.
    assert!(cost.contains("as run, on tables, 20.0 times") && cost.contains("64 samples per pixel"), "{cost}");
}

#[test]
fn each_claim_can_be_refuted() {
    let method = |method| move |row: &Row| row.method == method;
    let data = changed(method(Method::OursPolished), 0.0125);
    assert_eq!(verdict(&data, "Ours with polish is as good as brute force"), "Refuted");
    assert_eq!(tables(&section_of(&data, "summary"))[1].rows.len(), 12);
    let data = changed(method(Method::OursPolished), 0.03);
    assert_eq!(verdict(&data, "Ours with polish beats L2 on the fitting light"), "Refuted");
    assert_eq!(verdict(&data, "Ours with polish beats L2 under held-out lights"), "Refuted");
    let data = changed(|row| row.method == Method::Ours && row.shown != row.probe, 0.03);
    assert_eq!(verdict(&data, "The paper: robust under a third light"), "Refuted");
    let data = changed(|row| row.method == Method::Ours && row.samples.is_none(), -0.011);
    assert_eq!(verdict(&data, "The paper: 256 samples are close to the full image"), "Refuted");
    let data = changed(|row| row.method == Method::Ours && row.samples == Some(32), 0.04);
    assert_eq!(verdict(&data, "The paper: 32 samples are usable"), "Refuted");
    assert_eq!(verdict(&data, "The paper: sharper than low resolution"), "Refuted");
    let mut data = whole();
    data.rows.iter_mut().filter(|row| row.method == Method::Ours).for_each(|row| row.cpu_seconds = 100.0);
    assert_eq!(verdict(&data, "The paper: ten times cheaper than brute force"), "Refuted");
}

#[test]
fn a_claim_that_was_not_tried_has_no_row() {
    assert!(tables(&section_of(&empty(), "summary")).is_empty());
    let mut data = whole();
    data.rows.retain(|row| row.method != Method::LowRes);
    let summary = section_of(&data, "summary");
    let claims: Vec<&str> = tables(&summary)[0].rows.iter().map(|row| row[0].text.as_str()).collect();
    assert!(claims.contains(&"The paper: 32 samples are usable"), "{claims:?}");
    assert!(!claims.contains(&"The paper: sharper than low resolution"), "{claims:?}");
}

#[test]
fn cells_have_every_method_and_means() {
    let section = section_of(&whole(), "cells");
    let table = tables(&section)[0];
    assert_eq!((table.rows.len(), table.totals), (12 + 4, 4));
    assert_eq!(table.columns[2..8], ["ours + polish", "ours", "paper", "brute force", "low res. 32", "low res. 64"]);
    let aluminium = row(table, &["aluminium", "Uffizi Gallery"]);
    assert_eq!(aluminium[2..7], ["0.0510", "0.0550", "0.0630", "0.0520", "0.0810"]);
    assert_eq!(row(table, &["mean of 12", "all lights"])[2..4], ["0.0515", "0.0555"]);
    assert!(findings(&section)[0].1.contains("ours + polish 12, ours 0"));
}

#[test]
fn figure_two_names_the_lowest_gamma_and_the_ends() {
    let mut data = whole();
    let (verdict, words) = (Verdict::Measured, "lowest CSSIM is from 1.50 to 1.50");
    let section = section_of(&data, "gamma");
    assert!(findings(&section)[0].0 == verdict && findings(&section)[0].1.contains(words));
    assert!(findings(&section)[0].1.contains("in 0 of 9 curves"));
    data.rows
        .iter_mut()
        .filter(|row| row.method == Method::Candidate)
        .for_each(|row| row.cssim = 0.2 - 0.01 * row.gamma.unwrap());
    assert!(findings(&section_of(&data, "gamma"))[0].1.contains("in 9 of 9 curves"));
}

#[test]
fn table_one_is_compared_with_the_papers_and_names_its_misprints() {
    let section = section_of(&whole(), "table-1");
    let table = tables(&section)[0];
    assert_eq!(row(table, &["Grace Cathedral", "the paper"])[3..], ["0.0735", "0.0656", "0.0631", "0.6282"]);
    // Mean of the three materials of the six: .041, and the seed of the grid.
    assert_eq!(row(table, &["Grace Cathedral", "ours"])[2..], ["3", "0.0500", "0.0462", "0.0450", "0.0440"]);
    assert!(section.blocks.iter().any(|block| format!("{block:?}").contains("misprints of .06282 and .06115")));
}

#[test]
fn trends_and_ranks_have_their_signs() {
    let mut data = whole();
    let section = section_of(&data, "trends");
    assert_eq!(row(tables(&section)[0], &["delrin", "Uffizi Gallery"])[2..], ["1.00", "−1.00"]);
    assert_eq!(findings(&section)[0].0, Verdict::Confirmed);
    for row in data.rows.iter_mut().filter(|row| row.method == Method::Candidate) {
        row.parameters.insert("alpha".to_owned(), -row.gamma.unwrap());
    }
    assert_eq!(findings(&section_of(&data, "trends"))[0].0, Verdict::Refuted);
    let agreement = section_of(&data, "agreement");
    assert!(findings(&agreement)[0].1.contains("at γ = 2.00 (mean rank correlation 0.90)"));
    // Polish gains .004, more candidates .002.
    assert!(findings(&agreement)[1].1.contains("they close 50 % of the gap"));
}

#[test]
fn models_sampling_seeds_and_clamping_are_judged() {
    let data = whole();
    let models = section_of(&data, "models");
    assert!(
        findings(&models)[0].1.contains("cook-torrance in 0 of 12, ggx in 9 of 12, ward in 3 of 12"),
        "{}",
        findings(&models)[0].1
    );
    assert!(findings(&models)[1].1.contains("ggx beats cook-torrance by 0.0060 in mean CSSIM (0.0515 against 0.0575;"));
    assert_eq!(findings(&models).len(), 2);
    let sampling = section_of(&data, "sampling");
    assert_eq!(row(tables(&sampling)[0], &["256", "12"])[2..], ["0.0555", "0.0575", "0.0645"]);
    assert_eq!(findings(&sampling)[0].0, Verdict::Confirmed);
    let clamped = section_of(&data, "clamped");
    assert_eq!(findings(&clamped)[0].0, Verdict::Confirmed);
    assert_eq!(row(tables(&clamped)[0], &["delrin", "clamped"])[2], "20");
    let seeds = section_of(&data, "seeds");
    assert_eq!(row(tables(&seeds)[0], &["256"])[1..3], ["12", "240"]);
    assert!(findings(&seeds)[1].1.contains("lowers CSSIM by 0.0040 on average and 0.0040 in the median of 12 cells"));
}

#[test]
fn metrics_keep_their_order_or_not() {
    let mut data = whole();
    let section = section_of(&data, "metrics");
    assert_eq!(tables(&section)[0].rows.len(), 3);
    assert_eq!(findings(&section)[0].0, Verdict::Confirmed);
    // Means of .045, .055 and .065 against .0631, .0532 and .0410.
    let nearest = findings(&section)[1].1;
    assert!(nearest.contains("is ours with ggx by cssim: 0.0146 from them"), "{nearest}");
    data.rows
        .iter_mut()
        .filter(|row| row.metric == "multi-scale" && row.method == Method::L2)
        .for_each(|row| row.cssim = 0.0);
    assert_eq!(findings(&section_of(&data, "metrics"))[0].0, Verdict::Refuted);
}

#[test]
fn low_resolution_is_charged_by_pixels() {
    let section = section_of(&whole(), "low-resolution");
    // 500 evaluations of half a second, a sixteenth of it at a quarter of the side.
    let at = |size: &str| row(tables(&section)[0], &[size])[6].clone();
    assert_eq!((at("32 x 32"), at("128 x 128")), ("15.6".to_owned(), "250".to_owned()));
}
