//! Text for stdout: printing a result, aligned columns, counts with their nouns.

use std::{
    fmt::{Display, Write as _},
    io::{self, Write as _},
};

/// How to read a score. It follows every table with scores.
pub(crate) const CSSIM_HINT: &str = "CSSIM is a difference: 0 = identical, larger = worse.";

/// Writes a result to stdout. A closed pipe (`| head`) is not an error.
pub(crate) fn print_result(text: &str) -> io::Result<()> {
    let mut stdout = io::stdout().lock();
    match stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        outcome => outcome,
    }
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

/// `1 gamma`, `2 gammas`.
pub(crate) fn counted<N: Display + PartialEq + From<u8>>(count: N, noun: &str) -> String {
    let ending = if count == N::from(1) { "" } else { "s" };
    format!("{count} {noun}{ending}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_thing_is_not_plural() {
        assert_eq!([0_u64, 1, 2].map(|count| counted(count, "result")), ["0 results", "1 result", "2 results"]);
        assert_eq!(counted(1_usize, "more fit"), "1 more fit");
    }

    #[test]
    fn columns_line_up() {
        let rows = [vec!["".into(), "gamma".into()], vec!["stage two".into(), "1.5".into()]].map(|r: Vec<String>| r);
        assert_eq!(aligned(&rows), "             gamma\n  stage two    1.5\n");
    }
}
