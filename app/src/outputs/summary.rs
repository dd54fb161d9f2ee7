//! The table that a fit prints on stdout at its end.

use super::{
    FitRecord, Timing,
    fit_json::why,
    table::{CSSIM_HINT, aligned, counted, print_result},
};
use crate::wrap::wrap;
use lookalike::{
    brdf::{Channels, Model},
    fit::{Known, Method, Standing, Tried, Verdict, spread},
    light::FORMULA_LIGHTS,
    plan::FitOutcome,
    scene::Circle,
};
use std::{fmt::Write as _, io};

/// Prints the result: winner, parameters, scores, seconds.
pub(crate) fn print_summary(record: &FitRecord<'_>, timing: &Timing, out: &str) -> io::Result<()> {
    print_result(&summary(record, timing, out))
}

fn summary(record: &FitRecord<'_>, timing: &Timing, out: &str) -> String {
    let (method, outcome) = (record.method(), record.outcome);
    let usable = record.capture.counts().usable;
    let mut text = format!("{} on {} of {usable} usable pixels", method.model.name(), method.samples);
    let gammas = counted(method.gammas.len(), "gamma");
    let _ = writeln!(text, ", {gammas}, seed {}", method.seed);
    if let Some(Circle { x, y, radius }) = record.capture.geometry().circle() {
        let _ = writeln!(text, "sphere at {x:.1},{y:.1} with radius {radius:.1} in the photo, in pixels");
    }
    text.push('\n');
    text.push_str(&aligned(&rows(method, outcome)));
    let _ = writeln!(text, "\n  {CSSIM_HINT}");
    let _ = writeln!(text, "\n{}", wrap(&verdict(record)));
    text.push_str(&models(record));
    if let Some(other_lights) = other_lights(outcome) {
        let _ = writeln!(text, "\n{}", wrap(&other_lights));
    }
    for note in record.notes {
        let _ = writeln!(text, "\n{}", wrap(&format!("note: {note}")));
    }
    let seconds: Vec<String> = timing.seconds.iter().map(|(stage, s)| format!("{stage} {s:.1}")).collect();
    let workers = counted(timing.workers, "worker");
    let _ = writeln!(text, "\n{}", wrap(&format!("seconds: {} ({workers})", seconds.join(", "))));
    let _ = writeln!(text, "results: {out}");
    text
}

/// How good the match is, in a sentence, with what noise alone costs.
fn verdict(record: &FitRecord<'_>) -> String {
    let verdict = record.verdict();
    let meaning = match verdict {
        Verdict::Indistinguishable => "photo and match look the same side by side",
        Verdict::Close => "photo and match look alike; differences show where one looks for them",
        Verdict::VisibleDifference => "the same kind of material, but anyone sees differences",
        Verdict::NoMatch => "the material is another one, or the map, the camera or the object's place is wrong",
    };
    let noise = record.outcome.noise.map_or_else(String::new, |(noise, (_, object))| {
        format!(". The photo's noise of {:.1} % alone costs {object:.4} on the object", 100.0 * noise)
    });
    format!("verdict: {verdict} ({meaning}){noise}")
}

/// Whether matches that are as good look the same under other lights, in a sentence; `None` if there are none.
fn other_lights(outcome: &FitOutcome) -> Option<String> {
    let spread = spread(&outcome.neighbours)?;
    let names: Vec<&str> = outcome.neighbours.iter().map(|neighbour| &*neighbour.name).collect();
    let scores = outcome.neighbours.iter().flat_map(|neighbour| FORMULA_LIGHTS.iter().zip(&neighbour.cssim));
    let (light, most) = scores.max_by(|a, b| a.1.total_cmp(b.1))?;
    let so = match spread {
        Verdict::Indistinguishable => "look the same as the match",
        Verdict::Close => "look much like the match",
        _ => "differ from the match: the photo does not tell which is right",
    };
    Some(format!(
        "other lights: under three lights made by formula, matches that are as good ({}) {so} (CSSIM at most {most:.4}, light {:?})",
        names.join("; "),
        light.name
    ))
}

/// The models that were compared, one row each; empty for a single one.
fn models(record: &FitRecord<'_>) -> String {
    let (methods, FitOutcome { tried, chosen, .. }) = (record.methods, record.outcome);
    if tried.len() < 2 {
        return String::new();
    }
    let header = ["model", "CSSIM on object", "CSSIM on image", ""].map(str::to_owned).to_vec();
    let row = |(i, (method, tried)): (usize, (&Method, &Tried))| {
        let mark = if i == *chosen { "chosen: " } else { "" };
        // Scores on another picture cannot be compared.
        let shown = |score: f64| if tried.is_coarse { "-".to_owned() } else { format!("{score:.4}") };
        let scores = [tried.cssim_object, tried.cssim].map(shown);
        let name = methods.label(method);
        [name].into_iter().chain(scores).chain([format!("{mark}{}", why(tried, i, *chosen))]).collect()
    };
    let rows = std::iter::once(header).chain(methods.iter().zip(tried).enumerate().map(row)).collect::<Vec<_>>();
    format!("\n{}", aligned(&rows))
}

/// One row per score and parameter, one column per result. A model may have too many parameters for columns.
fn rows(method: &Method, outcome: &FitOutcome) -> Vec<Vec<String>> {
    let (model, held) = (method.model, method.ranges.held());
    let mut rows = names(model, |name| held.get(name).is_some());
    if let Some(j) = outcome.judged.iter().find(|j| j.candidate.gamma == 1.0) {
        add(&mut rows, column(model, "L2 baseline", "1", j.cssim, j.cssim_object, &j.candidate.parameters));
    }
    let j = &outcome.judged[outcome.winner];
    let gamma = j.candidate.gamma.to_string();
    add(&mut rows, column(model, "stage two", &gamma, j.cssim, j.cssim_object, &j.candidate.parameters));
    if let Some(p) = &outcome.polished {
        add(&mut rows, column(model, "polished", "", p.cssim, p.cssim_object, &p.parameters));
    }
    add(&mut rows, ranges(model, &outcome.uncertainty.entries));
    rows
}

/// Rows that have only their names.
fn names(model: &dyn Model, is_held: impl Fn(&str) -> bool) -> Vec<Vec<String>> {
    let scores = ["", "gamma", "CSSIM on object", "CSSIM on image"].map(str::to_owned).into_iter();
    let parameter = |name: &str| if is_held(name) { format!("{name} (held)") } else { name.to_owned() };
    scores.chain(model.parameters().iter().map(|p| parameter(p.name))).map(|name| vec![name]).collect()
}

fn add(rows: &mut [Vec<String>], column: Vec<String>) {
    rows.iter_mut().zip(column).for_each(|(row, cell)| row.push(cell));
}

/// The 95 % range of each parameter: of a colour half the range of its least certain channel.
fn ranges(model: &dyn Model, entries: &[Known]) -> Vec<String> {
    let mut column = ["95 % range", "", "", ""].map(str::to_owned).to_vec();
    let mut rest = entries;
    for parameter in model.parameters() {
        let (of_parameter, after) = rest.split_at(parameter.channels.count().min(rest.len()));
        rest = after;
        let are = |standing| of_parameter.iter().any(|known| known.standing == standing);
        let half = of_parameter.iter().map(|known| 0.5 * (known.high - known.low)).fold(0.0, f64::max);
        column.push(match of_parameter {
            _ if are(Standing::Held) => "held".to_owned(),
            _ if are(Standing::Undetermined) => "undetermined".to_owned(),
            [known] => format!("{:.4} to {:.4}", known.low, known.high),
            _ => format!("± {half:.3}"),
        });
    }
    column
}

fn column(model: &dyn Model, name: &str, gamma: &str, cssim: f64, object: f64, parameters: &[f64]) -> Vec<String> {
    let mut column = vec![name.to_owned(), gamma.to_owned(), format!("{object:.4}"), format!("{cssim:.4}")];
    let mut first = 0;
    for parameter in model.parameters() {
        let values = &parameters[first..first + parameter.channels.count()];
        column.push(match parameter.channels {
            Channels::Scalar => format!("{:.4}", values[0]),
            Channels::Rgb => values.iter().map(|v| format!("{v:.3}")).collect::<Vec<_>>().join(" "),
        });
        first += values.len();
    }
    column
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wrap::COLUMNS;
    use lookalike::brdf::{MODELS, flat_bounds};

    #[test]
    fn results_of_every_model_fit_in_100_columns() {
        for model in MODELS {
            let (_, upper) = flat_bounds(model.parameters());
            let results =
                ["L2 baseline", "stage two", "polished"].map(|name| column(*model, name, "1.5", 0.5, 0.5, &upper));
            let mut rows = names(*model, |_| true);
            results.into_iter().for_each(|result| add(&mut rows, result));
            let known = |&x: &f64| Known { low: 0.5 * x, high: x, standing: Standing::Undetermined };
            add(&mut rows, ranges(*model, &upper.iter().map(known).collect::<Vec<_>>()));
            let text = aligned(&rows);
            assert!(text.lines().all(|line| line.len() <= COLUMNS), "{text}");
        }
    }
}
