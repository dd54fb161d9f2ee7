//! Formats numbers and names for readers.

use crate::measured::Method;

/// A CSSIM, to four decimals.
pub(super) fn score(score: Option<f64>) -> String {
    fixed(score, 4)
}

/// A number with this many decimals; a dash for `None`.
pub(super) fn fixed(number: Option<f64>, decimals: usize) -> String {
    match number.filter(|number| number.is_finite()) {
        Some(number) => without_negative_zero(format!("{number:.decimals$}")).replace('-', "−"),
        None => "–".to_owned(),
    }
}

/// A difference, with its sign, to four decimals.
pub(super) fn signed(difference: Option<f64>) -> String {
    match difference.filter(|difference| difference.is_finite()) {
        Some(difference) => {
            let printed = without_negative_zero(format!("{difference:+.4}"));
            if printed == "+0.0000" { "0.0000".to_owned() } else { printed.replace('-', "−") }
        }
        None => "–".to_owned(),
    }
}

/// A number of a table in a form for programs: with a hyphen as minus, empty for `None`.
pub(super) fn plain(shown: &str) -> String {
    match shown.strip_prefix('−') {
        Some(digits) => format!("-{digits}"),
        None if shown == "–" => String::new(),
        None => shown.strip_prefix('+').unwrap_or(shown).to_owned(),
    }
}

/// Replaces the numbers of a claim if the study has none.
pub(super) const ABSENT: &str = "Not in this study.";

/// A number to three significant digits, for quantities over several orders of magnitude: seconds, ratios.
pub(super) fn significant(number: Option<f64>) -> String {
    let Some(number) = number.filter(|number| number.is_finite()) else { return "–".to_owned() };
    let decimals = match number.abs() {
        x if x >= 100.0 || x == 0.0 => 0,
        x if x >= 10.0 => 1,
        x if x >= 1.0 => 2,
        x if x >= 0.1 => 3,
        _ => 4,
    };
    format!("{number:.decimals$}")
}

/// A probability to three significant digits; below 0.0001 only that bound.
pub(super) fn probability(p: f64) -> String {
    if p < 1e-4 { "p < 0.0001".to_owned() } else { format!("p = {}", significant(Some(p))) }
}

/// The function that a method evaluates.
pub(super) const fn minimised(method: Method) -> &'static str {
    match method {
        Method::Ours
        | Method::RunnerUp
        | Method::Candidate
        | Method::Subsets
        | Method::Paper
        | Method::L2
        | Method::Log
        | Method::CubeRoot => "Eq. 1",
        Method::OursPolished | Method::SubsetsPolished | Method::Brute | Method::LowRes | Method::BruteDirect => {
            "CSSIM"
        }
    }
}

/// A number for a CSV: the shortest text that reads back as the same number; empty for `None`.
pub(super) fn exact(number: Option<f64>) -> String {
    number.filter(|number| number.is_finite()).map_or_else(String::new, |number| number.to_string())
}

/// A part of a whole, `3 of 4`.
pub(super) fn share(part: usize, whole: usize) -> String {
    format!("{part} of {whole}")
}

/// `1 cell`, `2 cells`.
pub(super) fn count(number: usize, one: &str) -> String {
    if number == 1 { format!("1 {one}") } else { format!("{number} {one}s") }
}

/// Names as a list: `a, b and c`.
pub(super) fn list(names: &[String]) -> String {
    match names {
        [] => "none".to_owned(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

fn without_negative_zero(text: String) -> String {
    match text.strip_prefix('-') {
        Some(digits) if digits.chars().all(|c| c == '0' || c == '.') => digits.to_owned(),
        _ => text,
    }
}

/// The name of a light in the paper, otherwise that of its file.
pub(super) fn light(probe: &str) -> &str {
    match probe {
        "grace_cross" => "Grace Cathedral",
        "rnl_cross" => "Eucalyptus Grove",
        "uffizi" => "Uffizi Gallery",
        other => other,
    }
}

/// A material under a light.
pub(super) fn cell(material: &str, probe: &str) -> String {
    format!("{material}, {}", light(probe))
}

/// A method's name in words.
pub(super) const fn method(method: Method) -> &'static str {
    match method {
        Method::Ours => "ours",
        Method::OursPolished => "ours + polish",
        Method::RunnerUp => "runner-up",
        Method::Candidate => "candidate",
        Method::Subsets => "more subsets",
        Method::SubsetsPolished => "more subsets + polish",
        Method::Paper => "paper",
        Method::L2 => "L2 (γ = 1)",
        Method::Log => "log",
        Method::CubeRoot => "cube root (γ = 3)",
        Method::Brute => "brute force",
        Method::LowRes => "low resolution",
        Method::BruteDirect => "brute force, no tables",
    }
}
