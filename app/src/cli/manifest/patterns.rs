//! Lists of files by name or by pattern.

use anyhow::{Context, anyhow, bail};
use glob::{MatchOptions, Pattern};
use std::{ffi::OsString, path::Path};
use toml::Value;

/// A text, or a list of texts.
#[derive(Debug)]
pub(super) struct Patterns(Vec<String>);

impl Patterns {
    /// The texts of a value; `what` names them in errors.
    pub(super) fn of(what: &str, value: Value) -> anyhow::Result<Self> {
        let text = |value: Value| match value {
            Value::String(text) if !text.is_empty() => Ok(text),
            other => Err(anyhow!("{what:?} must be a text or a list of texts, found {other}")),
        };
        let texts = match value {
            Value::Array(items) => items.into_iter().map(text).collect::<anyhow::Result<Vec<_>>>()?,
            value => vec![text(value)?],
        };
        if texts.is_empty() {
            bail!("{what:?} is an empty list; name at least one, or leave it out");
        }
        Ok(Self(texts))
    }

    /// The texts as they are.
    pub(super) fn into_names(self) -> Vec<String> {
        self.0
    }

    /// The files, relative to a folder; those of a pattern are in alphabetical order. A text without `*`, `?` and `[` is the name of a
    /// file, which need not exist.
    pub(super) fn files(self, folder: &Path) -> (Vec<OsString>, Vec<anyhow::Error>) {
        let (mut files, mut problems) = (Vec::new(), Vec::new());
        for text in self.0 {
            if !text.contains(['*', '?', '[']) {
                files.push(folder.join(text).into());
                continue;
            }
            match matching(folder, &text) {
                Ok(found) if found.is_empty() => problems.push(anyhow!("no file matches {text:?}; check the pattern")),
                Ok(found) => files.extend(found),
                Err(error) => problems.push(error),
            }
        }
        (files, problems)
    }
}

fn matching(folder: &Path, text: &str) -> anyhow::Result<Vec<OsString>> {
    let folder =
        folder.to_str().context("patterns need a manifest in a folder whose name is Unicode; list the files")?;
    let pattern = Path::new(&Pattern::escape(folder)).join(text);
    let options =
        MatchOptions { require_literal_separator: true, require_literal_leading_dot: true, ..MatchOptions::new() };
    let paths = glob::glob_with(&pattern.to_string_lossy(), options);
    let paths = paths.map_err(|error| anyhow!("the pattern {text:?} is malformed: {}", error.msg))?;
    let mut files = Vec::new();
    for path in paths {
        let path = path.map_err(|error| anyhow!("cannot look into {}: {}", error.path().display(), error.error()))?;
        if !path.is_dir() {
            files.push(path.into_os_string());
        }
    }
    Ok(files)
}
