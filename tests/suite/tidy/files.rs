//! The form of every Rust file, tests included.

use super::{
    at, none,
    paths::words,
    source::{Source, sources},
};

/// Files longer than this are split.
const LONGEST_FILE: usize = 600;

#[test]
fn files_are_short_and_have_no_generic_names() {
    let mut offences = Vec::new();
    for source in sources() {
        let lines = source.text.lines().count();
        if lines > LONGEST_FILE {
            offences.push(format!("{}: {lines} lines; split it by concept", source.path));
        }
        let vague = ["helper", "helpers", "misc", "util", "utils"];
        if let Some(name) = source.path.split(['/', '.']).find(|name| vague.contains(name)) {
            offences.push(format!("{}: {name} names no concept", source.path));
        }
    }
    none(&format!("a file has at most {LONGEST_FILE} lines and a name that says what it holds"), offences);
}

#[test]
fn sources_have_no_unfinished_work_ignored_tests_or_bare_allows() {
    let marks = [concat!("TO", "DO"), concat!("FIX", "ME"), concat!("XX", "X")];
    let mut offences = Vec::new();
    for source in sources() {
        let marked = words(&source.text).filter(|(word, _)| marks.contains(&word.name.as_str()));
        offences.extend(marked.map(|(word, _)| at(&source, &word, "(do it, or file it)")));
        let macros = words(&source.code)
            .filter(|(word, after)| after.starts_with('!') && ["todo", "unimplemented"].contains(&word.name.as_str()));
        offences.extend(macros.map(|(word, _)| at(&source, &word, "is a placeholder")));
        let ignored =
            source.code.match_indices(concat!("#[", "ignore")).map(|(place, _)| Source::line(&source.code, place));
        offences.extend(ignored.map(|line| format!("{}:{line}: an ignored test; use --features slow", source.path)));
        offences.extend(allowances_without_reason(&source));
    }
    none("no marks for later, no placeholders, no ignored tests, no lint allowed without a reason", offences);
}

/// Attributes that silence a lint and do not say why.
fn allowances_without_reason(source: &Source) -> Vec<String> {
    let mut offences = Vec::new();
    for start in ["[allow(", "[expect("] {
        for (place, _) in source.code.match_indices(start) {
            let attribute = &source.code[place..];
            let attribute = &attribute[..attribute.find(")]").unwrap_or(attribute.len())];
            if !attribute.contains("reason =") {
                let line = Source::line(&source.code, place);
                offences.push(format!("{}:{line}: a lint is silenced without a reason", source.path));
            }
        }
    }
    offences
}
