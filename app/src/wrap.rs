//! Wraps results for people to lines of at most 100 columns.

use textwrap::{Options, WordSplitter};

/// The most columns of a result, on a terminal and in a pipe alike.
pub(crate) const COLUMNS: usize = 100;

/// The further indent of the lines that continue a wrapped one.
const HANGING: &str = "    ";

/// Breaks the lines that are longer than [`COLUMNS`] at spaces and indents their continuations. A word that is longer, such as a path,
/// stays whole, so that it can be copied.
pub(crate) fn wrap(text: &str) -> String {
    text.split('\n').map(wrap_line).collect::<Vec<_>>().join("\n")
}

fn wrap_line(line: &str) -> String {
    let indent = &line[..line.len() - line.trim_start_matches(' ').len()];
    let hanging = format!("{indent}{HANGING}");
    let options = Options::new(COLUMNS).initial_indent(indent).subsequent_indent(&hanging);
    let options = options.break_words(false).word_splitter(WordSplitter::NoHyphenation);
    textwrap::fill(&line[indent.len()..], options)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_lines_stay_and_long_ones_hang() {
        let short = "one\n\n  two  columns\n";
        assert_eq!(wrap(short), short);
        let long = format!("  {} --max-cssim", "word ".repeat(19).trim_end());
        let wrapped = wrap(&long);
        assert_eq!(wrapped, format!("  {}\n      --max-cssim", "word ".repeat(19).trim_end()));
    }

    #[test]
    fn word_that_is_too_long_stays_whole() {
        let path = "/folder".repeat(20);
        assert_eq!(wrap(&format!("results: {path}")), format!("results:\n    {path}"));
    }
}
