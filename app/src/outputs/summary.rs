//! The table that a fit prints on stdout at its end.

use super::{FitRecord, Timing};
use lookalike::brdf::{Channels, Model};
use std::{
    fmt::Write as _,
    io::{self, Write as _},
};

/// Prints the result: winner, parameters, scores, seconds.
pub(crate) fn print_summary(record: &FitRecord<'_>, timing: &Timing, out: &str) -> io::Result<()> {
    print_result(&summary(record, timing, out))
}

/// Writes a result to stdout. A closed pipe (`| head`) is not an error.
pub(crate) fn print_result(text: &str) -> io::Result<()> {
    let mut stdout = io::stdout().lock();
    match stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        outcome => outcome,
    }
}

fn summary(record: &FitRecord<'_>, timing: &Timing, out: &str) -> String {
    let (model, outcome) = (record.method.model, record.outcome);
    let usable = record.capture.counts().usable;
    let mut text = format!("{} on {} of {usable} usable pixels", model.name(), record.method.samples);
    let gammas = counted(record.method.gammas.len(), "gamma");
    let _ = writeln!(text, ", {gammas}, seed {}\n", record.method.seed);
    let mut rows = vec![header(model)];
    let first = outcome.judged.iter().find(|j| j.candidate.gamma == 1.0);
    if let Some(j) = first {
        rows.push(row(model, "L2 baseline", "1", j.cssim, j.cssim_object, &j.candidate.parameters));
    }
    let winner = &outcome.judged[outcome.winner];
    let gamma = winner.candidate.gamma.to_string();
    let scores = (winner.cssim, winner.cssim_object);
    rows.push(row(model, "stage two", &gamma, scores.0, scores.1, &winner.candidate.parameters));
    if let Some(p) = &outcome.polished {
        rows.push(row(model, "polished", "", p.cssim, p.cssim_object, &p.parameters));
    }
    text.push_str(&aligned(&rows));
    text.push_str("\n  CSSIM is a difference: 0 = identical, larger = worse.\n");
    for note in record.notes {
        let _ = writeln!(text, "\nnote: {note}");
    }
    let seconds: Vec<String> = timing.seconds.iter().map(|(stage, s)| format!("{stage} {s:.1}")).collect();
    let workers = counted(timing.workers, "worker");
    let _ = writeln!(text, "\nseconds: {} ({workers})", seconds.join(", "));
    let _ = writeln!(text, "results: {out}");
    text
}

/// `1 gamma`, `2 gammas`.
pub(crate) fn counted(count: usize, noun: &str) -> String {
    format!("{count} {noun}{}", if count == 1 { "" } else { "s" })
}

fn header(model: &dyn Model) -> Vec<String> {
    let fixed = ["", "gamma", "CSSIM on object", "on image"].map(str::to_owned);
    fixed.into_iter().chain(model.parameters().iter().map(|p| p.name.to_owned())).collect()
}

fn row(model: &dyn Model, name: &str, gamma: &str, cssim: f64, object: f64, parameters: &[f64]) -> Vec<String> {
    let mut row = vec![name.to_owned(), gamma.to_owned(), format!("{object:.4}"), format!("{cssim:.4}")];
    let mut first = 0;
    for parameter in model.parameters() {
        let values = &parameters[first..first + parameter.channels.count()];
        row.push(match parameter.channels {
            Channels::Scalar => format!("{:.4}", values[0]),
            Channels::Rgb => values.iter().map(|v| format!("{v:.3}")).collect::<Vec<_>>().join(" "),
        });
        first += values.len();
    }
    row
}

/// Aligns columns to their widest entries: the first column left, the others right.
pub(crate) fn aligned(rows: &[Vec<String>]) -> String {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |c: usize| rows.iter().filter_map(|r| r.get(c)).map(String::len).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let mut text = String::new();
    for row in rows {
        let mut line = format!("  {:<1$}", row[0], widths[0]);
        for (cell, width) in row.iter().zip(&widths).skip(1) {
            let _ = write!(line, "  {cell:>width$}");
        }
        text.push_str(line.trim_end());
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_line_up() {
        let rows = [vec!["".into(), "gamma".into()], vec!["stage two".into(), "1.5".into()]].map(|r: Vec<String>| r);
        assert_eq!(aligned(&rows), "             gamma\n  stage two    1.5\n");
    }
}
