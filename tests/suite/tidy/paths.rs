//! Names and paths in blanked code.

use super::source::{Source, is_word};

/// A name or path, and the line it is on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Found {
    pub(super) line: usize,
    pub(super) name: String,
}

/// Every path that starts with `root::`, use trees spelled out: `std::{fs, io::Read}` is `std::fs` and `std::io::Read`.
pub(super) fn paths(code: &str, root: &str) -> Vec<Found> {
    let start = format!("{root}::");
    let mut found = Vec::new();
    for (place, _) in code.match_indices(&start) {
        let before = place.checked_sub(1).map_or(b' ', |i| code.as_bytes()[i]);
        if is_word(before) || before == b':' && code[..place].ends_with(&format!("{root}::")) {
            continue;
        }
        let mut names = Vec::new();
        let mut rest = &code[place + start.len()..];
        tree(&mut rest, root, &mut names);
        let line = Source::line(code, place);
        found.extend(names.into_iter().map(|name| Found { line, name }));
    }
    found
}

/// Reads one branch of a use tree, after its `::`, and adds the paths it ends in.
fn tree(rest: &mut &str, prefix: &str, names: &mut Vec<String>) {
    *rest = rest.trim_start();
    if let Some(inside) = rest.strip_prefix('{') {
        *rest = inside;
        loop {
            *rest = rest.trim_start_matches([',', ' ', '\n']);
            if rest.is_empty() {
                return;
            }
            if let Some(after) = rest.strip_prefix('}') {
                *rest = after;
                return;
            }
            let length = rest.len();
            tree(rest, prefix, names);
            let renamed = rest.trim_start().strip_prefix("as ");
            *rest = renamed
                .map_or(*rest, |name| name.trim_start().trim_start_matches(|c: char| c.is_alphanumeric() || c == '_'));
            assert!(rest.len() < length, "cannot read the use tree at {:?}", &rest[..rest.len().min(40)]);
        }
    }
    let end = rest.bytes().position(|byte| !is_word(byte) && byte != b'*').unwrap_or(rest.len());
    let (name, after) = rest.split_at(end);
    let path = if name == "self" || name.is_empty() { prefix.to_owned() } else { format!("{prefix}::{name}") };
    *rest = after;
    match after.strip_prefix("::") {
        // A turbofish ends the path.
        Some(deeper) if !deeper.starts_with('<') => {
            *rest = deeper;
            tree(rest, &path, names);
        }
        _ => names.push(path),
    }
}

/// Every whole word, with the text right after it.
pub(super) fn words(code: &str) -> impl Iterator<Item = (Found, &str)> {
    let bytes = code.as_bytes();
    let mut i = 0;
    std::iter::from_fn(move || {
        while i < bytes.len() && !is_word(bytes[i]) {
            i += 1;
        }
        let start = i;
        while i < bytes.len() && is_word(bytes[i]) {
            i += 1;
        }
        (start < i).then(|| (Found { line: start, name: code[start..i].to_owned() }, &code[i..]))
    })
    .map(|(word, after)| (Found { line: Source::line(code, word.line), ..word }, after))
}

/// Calls of methods or associated functions: `.name(`, `.name::<`, `f64::name`, `f32::name`.
pub(super) fn calls(code: &str) -> Vec<Found> {
    let mut found: Vec<Found> = ["f64", "f32"].iter().flat_map(|float| paths(code, float)).collect();
    for found in &mut found {
        found.name = found.name[5..].to_owned();
    }
    for (place, _) in code.match_indices('.') {
        let rest = &code[place + 1..];
        let end = rest.bytes().position(|byte| !is_word(byte)).unwrap_or(rest.len());
        if rest[end..].starts_with('(') || rest[end..].starts_with("::<") {
            found.push(Found { line: Source::line(code, place), name: rest[..end].to_owned() });
        }
    }
    found
}

/// The chain of method names from a place to the end of its expression, without those inside arguments.
pub(super) fn chain(code: &str, place: usize) -> Vec<&str> {
    let (mut depth, mut names) = (0, Vec::new());
    for (i, byte) in code.bytes().enumerate().skip(place) {
        match byte {
            b'(' | b'[' | b'{' => depth += 1,
            b')' | b']' | b'}' => depth -= 1,
            b'.' if depth == 0 => {
                let rest = &code[i + 1..];
                names.push(&rest[..rest.bytes().position(|byte| !is_word(byte)).unwrap_or(rest.len())]);
            }
            b';' | b',' if depth == 0 => break,
            _ => {}
        }
        if depth < 0 {
            break;
        }
    }
    names
}
