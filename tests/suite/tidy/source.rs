//! Sources as the rules read them: text without comments, contents of strings and test items.

use super::paths::Found;
use std::{
    collections::BTreeSet,
    fs,
    path::{Path, PathBuf},
};

/// One file of Rust.
pub(super) struct Source {
    /// Relative to the workspace root, with `/`.
    pub(super) path: String,
    /// As it is in the file.
    pub(super) text: String,
    /// The text with comments, the contents of strings and everything under `#[cfg(test)]` blanked; lines stay where
    /// they are. Empty for a file that is a test module.
    pub(super) code: String,
}

impl Source {
    /// The line, from 1, of a place in [`Source::text`] or [`Source::code`].
    pub(super) fn line(text: &str, place: usize) -> usize {
        text[..place].matches('\n').count() + 1
    }

    /// The first folder or file below `src` of a member; `None` elsewhere, for `lib.rs` itself and for a program.
    pub(super) fn module_of(&self, member: &str) -> Option<&str> {
        let inside = self.path.strip_prefix(member)?.strip_prefix("/src/")?;
        let first = inside.split('/').next()?;
        let name = first.strip_suffix(".rs").unwrap_or(first);
        (!["lib", "main"].contains(&name)).then_some(name)
    }
}

/// The folder of the workspace.
pub(super) fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the tests are a folder of the workspace").to_owned()
}

/// All Rust files of the project, by path.
pub(super) fn sources() -> Vec<Source> {
    let root = root();
    let mut paths = Vec::new();
    for member in ["app", "common", "coordinator", "fuzz", "report", "tests", "worker"] {
        collect(&root, member, &mut paths);
    }
    assert!(paths.len() > 100, "found only {} files of Rust below {}", paths.len(), root.display());
    let mut test_modules = BTreeSet::new();
    let mut sources: Vec<Source> = paths.into_iter().map(|path| read(&root, path, &mut test_modules)).collect();
    for source in &mut sources {
        if test_modules.iter().any(|module| is_of_module(&source.path, module)) {
            source.code.clear();
        }
    }
    sources
}

/// Adds the Rust files below a folder, sorted, as paths relative to the root. Build output and hidden folders are skipped.
fn collect(root: &Path, folder: &str, paths: &mut Vec<String>) {
    let entries = fs::read_dir(root.join(folder)).unwrap_or_else(|error| panic!("{folder}: {error}"));
    let mut names: Vec<_> = entries
        .map(|entry| entry.expect("a folder can be listed").file_name().into_string().expect("names are UTF-8"))
        .collect();
    names.sort();
    for name in names.iter().filter(|name| !name.starts_with('.') && *name != "target") {
        let path = format!("{folder}/{name}");
        if root.join(&path).is_dir() {
            collect(root, &path, paths);
        } else if name.ends_with(".rs") {
            paths.push(path);
        }
    }
}

fn read(root: &Path, path: String, test_modules: &mut BTreeSet<String>) -> Source {
    let text = fs::read_to_string(root.join(&path)).unwrap_or_else(|error| panic!("{path}: {error}"));
    let (code, modules) = without_test_items(without_comments_and_strings(&text));
    let folder = path.strip_suffix("/mod.rs").or(path.strip_suffix("/lib.rs")).or(path.strip_suffix("/main.rs"));
    let folder = folder.or(path.strip_suffix(".rs")).unwrap_or(&path);
    test_modules.extend(modules.iter().map(|module| format!("{folder}/{module}")));
    Source { path, text, code }
}

/// Whether a file is `module.rs` or lies in the folder `module`.
fn is_of_module(path: &str, module: &str) -> bool {
    path.strip_prefix(module).is_some_and(|rest| rest == ".rs" || rest.starts_with('/'))
}

/// The contents of the string literals outside comments and test items, each with its closing quote.
pub(super) fn literals(source: &Source) -> Vec<Found> {
    // Blanking keeps the opening quotes of literals and the place of every byte.
    let text = source.text.as_bytes();
    let literal = |place: usize| {
        let raw = source.text[..place].trim_end_matches('#').strip_suffix('r').map(str::len);
        let (from, to) = raw.and_then(|start| opaque(text, start)).or_else(|| opaque(text, place))?;
        Some(Found { line: Source::line(&source.text, place), name: source.text[from..to].to_owned() })
    };
    source.code.match_indices('"').filter_map(|(place, _)| literal(place)).collect()
}

/// Blanks comments and the contents of string and character literals.
pub(super) fn without_comments_and_strings(text: &str) -> String {
    let bytes = text.as_bytes();
    let mut code = bytes.to_vec();
    let mut i = 0;
    while i < bytes.len() {
        let (from, to) = opaque(bytes, i).unwrap_or((i + 1, i + 1));
        for byte in code[from.min(to)..to].iter_mut().filter(|byte| **byte != b'\n') {
            *byte = b' ';
        }
        i = to;
    }
    String::from_utf8(code).expect("whole literals and comments are blanked")
}

/// The range to blank of the comment or literal that starts here, and where scanning continues.
fn opaque(bytes: &[u8], i: usize) -> Option<(usize, usize)> {
    let rest = &bytes[i..];
    if rest.starts_with(b"//") {
        return Some((i, i + rest.iter().position(|&byte| byte == b'\n').unwrap_or(rest.len())));
    }
    if rest.starts_with(b"/*") {
        return Some((i, block_comment_end(bytes, i)));
    }
    let follows_word = i > 0 && is_word(bytes[i - 1]) && bytes[i - 1] != b'b';
    match rest[0] {
        b'r' if !follows_word => {
            let hashes = rest[1..].iter().take_while(|&&byte| byte == b'#').count();
            let open = i + 1 + hashes;
            (bytes.get(open) == Some(&b'"')).then(|| {
                let close = [b"\"".as_slice(), &vec![b'#'; hashes]].concat();
                let length = bytes[open + 1..].windows(close.len()).position(|window| window == close);
                let end = length.map_or(bytes.len(), |length| open + 1 + length + close.len());
                (open + 1, end)
            })
        }
        b'"' => Some((i + 1, literal_end(bytes, i, b'"'))),
        // A lifetime has no closing quote after its one character.
        b'\'' if rest.get(1) == Some(&b'\\') || char_literal(rest) => Some((i + 1, literal_end(bytes, i, b'\''))),
        _ => None,
    }
}

/// Whether a quote opens a character literal without a backslash: one character of any width, then a quote.
fn char_literal(rest: &[u8]) -> bool {
    let width = rest[1..].iter().skip(1).take_while(|&&byte| byte & 0xc0 == 0x80).count() + 1;
    rest.get(1 + width) == Some(&b'\'')
}

/// One past the closing quote.
fn literal_end(bytes: &[u8], open: usize, quote: u8) -> usize {
    let mut i = open + 1;
    while i < bytes.len() && bytes[i] != quote {
        i += if bytes[i] == b'\\' { 2 } else { 1 };
    }
    (i + 1).min(bytes.len())
}

/// One past the end of a block comment, which may hold others.
fn block_comment_end(bytes: &[u8], open: usize) -> usize {
    let (mut depth, mut i) = (1, open + 2);
    while i < bytes.len() && depth > 0 {
        match &bytes[i..] {
            [b'/', b'*', ..] => (depth, i) = (depth + 1, i + 2),
            [b'*', b'/', ..] => (depth, i) = (depth - 1, i + 2),
            _ => i += 1,
        }
    }
    i
}

/// Blanks the items that exist in tests only, and names the modules among them that are files of their own.
fn without_test_items(code: String) -> (String, Vec<String>) {
    const GATES: [&str; 2] = ["#[cfg(test)]", "#[cfg(all(test, unix))]"];
    let (mut code, mut modules) = (code, Vec::new());
    while let Some((place, gate)) = GATES.iter().find_map(|gate| Some((code.find(gate)?, gate))) {
        let end = item_end(code.as_bytes(), place + gate.len());
        let item = &code[place + gate.len()..end];
        if let Some((_, name)) = item.trim().strip_suffix(';').and_then(|head| head.rsplit_once("mod ")) {
            modules.push(name.trim().to_owned());
        }
        let blank: String = code[place..end].chars().map(|c| if c == '\n' { '\n' } else { ' ' }).collect();
        code.replace_range(place..end, &blank);
    }
    (code, modules)
}

/// One past the item that starts here: its `;`, or the brace that closes its body.
fn item_end(bytes: &[u8], from: usize) -> usize {
    let mut depth = 0;
    for (i, byte) in bytes.iter().enumerate().skip(from) {
        match byte {
            b'(' | b'[' | b'{' => depth += 1,
            b')' | b']' => depth -= 1,
            b'}' => {
                depth -= 1;
                if depth <= 0 {
                    return i + 1;
                }
            }
            b';' if depth == 0 => return i + 1,
            _ => {}
        }
    }
    bytes.len()
}

/// Whether a byte is part of a name.
pub(super) fn is_word(byte: u8) -> bool {
    byte.is_ascii_alphanumeric() || byte == b'_'
}
