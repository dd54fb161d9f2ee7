//! `summary.csv`, `summary.json` and the table at the end: one row per fit.

use super::row::{Row, State};
use crate::{
    outputs::{BATCH_MARK, CSSIM_HINT, OutFolder, aligned, parameters_json},
    progress::PartCount,
    wrap::wrap,
};
use anyhow::Context;
use lookalike::brdf::flat_names;
use serde_json::{Value, json};
use std::fmt::Write as _;

/// The schema of `summary.json`.
const SCHEMA: &str = "lookalike.batch/1";

/// The name of the summary for spreadsheets.
pub(super) const CSV: &str = "summary.csv";

/// The state of all fits at one time.
#[derive(Debug)]
pub(super) struct Summary {
    pub(super) rows: Vec<Row>,
    pub(super) count: PartCount,
    /// `running`, `finished` or `stopped`.
    pub(super) state: &'static str,
    pub(super) seconds: f64,
}

/// Writes both summaries, each atomically.
pub(super) fn write(summary: &Summary, out: &OutFolder) -> anyhow::Result<()> {
    let text = serde_json::to_string_pretty(&summary.json()).context(BATCH_MARK)? + "\n";
    out.write(CSV, summary.csv().as_bytes())?;
    out.write(BATCH_MARK, text.as_bytes())
}

impl Summary {
    fn json(&self) -> Value {
        let PartCount { total, running, done, missed, failed } = self.count;
        json!({
            "schema": SCHEMA,
            "software": { "name": "lookalike", "version": env!("CARGO_PKG_VERSION") },
            "state": self.state,
            "seconds": milliseconds(self.seconds),
            "count": { "total": total, "running": running, "done": done, "missed": missed, "failed": failed },
            "fits": self.rows.iter().map(of_row).collect::<Vec<_>>(),
        })
    }

    fn csv(&self) -> String {
        let parameters = self.parameters();
        let fixed = [
            "name",
            "photo",
            "env",
            "model",
            "state",
            "cssim",
            "cssim_object",
            "gamma",
            "polished",
            "seconds",
            "error",
        ];
        let header = fixed.iter().map(|name| (*name).to_owned()).chain(parameters.iter().cloned());
        let mut text = header.collect::<Vec<_>>().join(",") + "\n";
        for row in &self.rows {
            let numbers = match &row.state {
                State::Done(scores) => [
                    scores.cssim.to_string(),
                    scores.cssim_object.to_string(),
                    scores.gamma.to_string(),
                    scores.is_polished.to_string(),
                ],
                _ => Default::default(),
            };
            let error = if let State::Failed(error) = &row.state { error.as_str() } else { "" };
            let seconds = row.seconds.map(|seconds| milliseconds(seconds).to_string()).unwrap_or_default();
            let texts = [&row.name, &row.photo, &row.env, &*row.model(), row.state.name()].map(quoted);
            let cells = texts.into_iter().chain(numbers).chain([seconds, quoted(error)]);
            let cells = cells.chain(parameters.iter().map(|name| parameter(row, name)));
            text.push_str(&cells.collect::<Vec<_>>().join(","));
            text.push('\n');
        }
        text
    }

    /// The parameters of all models, each once.
    fn parameters(&self) -> Vec<String> {
        let mut all: Vec<String> = Vec::new();
        let models = self.rows.iter().flat_map(|row| row.models.iter());
        for name in models.flat_map(|method| flat_names(method.model.parameters())) {
            if !all.contains(&name) {
                all.push(name);
            }
        }
        all
    }

    /// The table for the terminal.
    pub(super) fn table(&self) -> String {
        let header = ["fit", "state", "CSSIM on object", "CSSIM on image", "gamma", "seconds"];
        let mut rows = vec![header.map(str::to_owned).to_vec()];
        let has_begun = |row: &&Row| !matches!(row.state, State::Waiting | State::Stopped);
        for row in self.rows.iter().filter(has_begun) {
            let mut cells = vec![row.name.clone(), row.state.name().to_owned()];
            match &row.state {
                State::Done(scores) => cells.extend([
                    format!("{:.4}", scores.cssim_object),
                    format!("{:.4}", scores.cssim),
                    scores.gamma.to_string(),
                ]),
                _ => cells.extend(std::iter::repeat_n(String::new(), 3)),
            }
            cells.push(row.seconds.map(|seconds| format!("{seconds:.1}")).unwrap_or_default());
            rows.push(cells);
        }
        let mut text = aligned(&rows);
        let _ = writeln!(text, "\n  {CSSIM_HINT}");
        for row in &self.rows {
            if let State::Failed(error) = &row.state {
                let _ = writeln!(text, "\n{}", wrap(&format!("{} failed: {error}", row.name)));
            }
        }
        let stopped = self.rows.iter().filter(|row| matches!(row.state, State::Stopped)).count();
        let stopped = if stopped > 0 { format!(", {stopped} not done") } else { String::new() };
        let _ = writeln!(text, "\n{}{stopped} in {:.1} s", self.count.text(), self.seconds);
        text
    }
}

fn of_row(row: &Row) -> Value {
    let mut object = json!({
        "name": row.name, "photo": row.photo, "env": row.env, "model": row.model(), "state": row.state.name(),
        "seconds": row.seconds.map(milliseconds),
    });
    let (scores, error) = match &row.state {
        State::Done(scores) => (Some(scores), None),
        State::Failed(error) => (None, Some(error)),
        State::Waiting | State::Running | State::Stopped => (None, None),
    };
    object["cssim"] = json!(scores.map(|scores| scores.cssim));
    object["cssim_object"] = json!(scores.map(|scores| scores.cssim_object));
    object["gamma"] = json!(scores.map(|scores| scores.gamma));
    object["parameters"] = json!(scores.map(|scores| parameters_json(scores.model, &scores.parameters)));
    object["polished"] = json!(scores.map(|scores| scores.is_polished));
    object["error"] = json!(error);
    object
}

/// A parameter of a fit by its flat name; empty if its model has no such parameter.
fn parameter(row: &Row, name: &str) -> String {
    let State::Done(scores) = &row.state else { return String::new() };
    let place = flat_names(scores.model.parameters()).iter().position(|known| known == name);
    place.and_then(|place| scores.parameters.get(place)).map(f64::to_string).unwrap_or_default()
}

fn milliseconds(seconds: f64) -> f64 {
    (seconds * 1000.0).round() / 1000.0
}

/// A text as a CSV cell: quoted if it contains commas, quotes or line feeds.
fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::{super::row::Scores, *};
    use lookalike::{
        brdf,
        fit::{JudgedBy, Method},
    };

    fn row(name: &str, model: &str, state: State) -> Row {
        let (photo, env) = ("a, b.exr".to_owned(), "m.hdr".to_owned());
        let models = Method { model: brdf::model(model).unwrap(), ..Method::default() }.into();
        Row { name: name.to_owned(), photo, env, models, state, seconds: Some(1.23456) }
    }

    fn scores(model: &str, parameters: Vec<f64>, is_missed: bool) -> State {
        let model = brdf::model(model).unwrap();
        let (cssim, cssim_object, gamma) = (0.25, 0.125, 1.5);
        let judge = JudgedBy::Object;
        let files = Vec::new();
        State::Done(Scores {
            cssim,
            cssim_object,
            judge,
            model,
            gamma,
            parameters,
            is_polished: true,
            is_missed,
            files,
        })
    }

    fn summary() -> Summary {
        let rows = vec![
            row("one", "ggx", scores("ggx", (1..=8).map(f64::from).collect(), false)),
            row("two", "cook-torrance", scores("cook-torrance", (1..=8).map(f64::from).collect(), true)),
            row("three", "ggx", State::Failed("it said \"no\"".to_owned())),
        ];
        let count = PartCount { total: 3, running: 0, done: 2, missed: 1, failed: 1 };
        Summary { rows, count, state: "finished", seconds: 9.0 }
    }

    #[test]
    fn csv_has_a_column_for_every_parameter_of_every_model() {
        let csv = summary().csv();
        let lines: Vec<&str> = csv.lines().collect();
        let parameters = "kd.r,kd.g,kd.b,f0.r,f0.g,f0.b,f90,alpha,ks.r,ks.g,ks.b,f0,m";
        assert!(lines[0].ends_with(&format!(",seconds,error,{parameters}")), "{csv}");
        assert_eq!(lines[1], "one,\"a, b.exr\",m.hdr,ggx,done,0.25,0.125,1.5,true,1.235,,1,2,3,4,5,6,7,8,,,,,");
        assert_eq!(
            lines[2],
            "two,\"a, b.exr\",m.hdr,cook-torrance,missed,0.25,0.125,1.5,true,1.235,,1,2,3,,,,,,4,5,6,7,8"
        );
        assert_eq!(lines[3], "three,\"a, b.exr\",m.hdr,ggx,failed,,,,,1.235,\"it said \"\"no\"\"\",,,,,,,,,,,,,");
    }

    #[test]
    fn missing_values_are_null_in_json() {
        let json = summary().json();
        assert_eq!((&json["schema"], &json["count"]["failed"]), (&json!("lookalike.batch/1"), &json!(1)));
        assert_eq!(
            json["fits"][0]["parameters"],
            json!({ "kd": [1.0, 2.0, 3.0], "f0": [4.0, 5.0, 6.0], "f90": 7.0, "alpha": 8.0 })
        );
        assert_eq!((&json["fits"][1]["state"], &json["fits"][1]["error"]), (&json!("missed"), &Value::Null));
        assert_eq!((&json["fits"][2]["cssim"], &json["fits"][2]["parameters"]), (&Value::Null, &Value::Null));
    }

    #[test]
    fn score_of_the_object_comes_first_and_the_table_says_how_to_read_it() {
        let table = summary().table();
        let lines: Vec<Vec<&str>> = table.lines().map(|line| line.split("  ").map(str::trim).collect()).collect();
        let cells = |line: &[&str]| line.iter().filter(|cell| !cell.is_empty()).map(|it| (*it).to_owned()).collect();
        let rows: Vec<Vec<String>> = lines.iter().map(|line| cells(line)).collect();
        assert_eq!(rows[0], ["fit", "state", "CSSIM on object", "CSSIM on image", "gamma", "seconds"]);
        assert_eq!(rows[1], ["one", "done", "0.1250", "0.2500", "1.5", "1.2"]);
        assert!(table.contains("\n\n  CSSIM is a difference: 0 = identical, larger = worse.\n"), "{table}");
        assert!(table.lines().all(|line| line.len() <= crate::wrap::COLUMNS), "{table}");
    }

    #[test]
    fn score_in_the_journal_is_the_judged_one() {
        assert_eq!(summary().rows[0].journal_row(0).status.score, Some(0.125));
    }

    #[test]
    fn failures_are_listed_below_the_table() {
        let table = summary().table();
        assert!(
            table.contains("three failed: it said \"no\"\n\n2 of 3 done, 1 missed, 1 failed in 9.0 s\n"),
            "{table}"
        );
    }
}
