//! The measurements as a table for people.

use serde_json::Value;

/// One row per figure.
pub(super) fn table(found: &[Value]) -> String {
    let mut rows = String::from("| measurement | figure | value |\n|---|---|---|");
    for measured in found {
        let name = measured["measurement"].as_str().unwrap_or_default();
        for (figure, value) in measured.as_object().into_iter().flatten() {
            if figure != "measurement" {
                rows += &format!("\n| {name} | {} | {value} |", figure.replace('_', " "));
            }
        }
    }
    rows
}
