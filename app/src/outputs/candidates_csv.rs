//! `candidates.csv`: one row per candidate of stage one, for spreadsheets and plots.

use lookalike::{
    brdf::{Model, flat_names},
    fit::Judged,
};
use std::fmt::Write as _;

/// The table as text. Numbers have all their digits.
pub(crate) fn candidates_csv(model: &dyn Model, judged: &[Judged]) -> String {
    let mut text = String::from("gamma,subset,cost,cssim,cssim_object,evaluations,termination");
    for name in flat_names(model.parameters()) {
        let _ = write!(text, ",{name}");
    }
    text.push('\n');
    for Judged { candidate: c, cssim, cssim_object } in judged {
        let (gamma, cost, why) = (c.gamma, c.cost, c.termination.name());
        let _ = write!(text, "{gamma},{},{cost},{cssim},{cssim_object},{},{why}", c.subset, c.evaluations);
        for value in &c.parameters {
            let _ = write!(text, ",{value}");
        }
        text.push('\n');
    }
    text
}
