//! Lists files in the folder of the report.

use anyhow::Context;
use std::{collections::BTreeSet, fs, io::ErrorKind, path::Path};

/// Names of the files in a folder; empty if there is no folder.
pub(crate) fn names(folder: &Path) -> anyhow::Result<BTreeSet<String>> {
    let cannot = || format!("cannot list the pictures in {}", folder.display());
    match fs::read_dir(folder) {
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(BTreeSet::new()),
        Err(error) => Err(error).with_context(cannot),
        Ok(entries) => {
            entries.map(|entry| Ok(entry.with_context(cannot)?.file_name().to_string_lossy().into_owned())).collect()
        }
    }
}
