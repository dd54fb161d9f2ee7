//! Lists and writes files in the folder of the report.

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

/// Writes a temporary file and renames it, so that a reader finds either the old file or the new one, both complete.
pub(crate) fn file(folder: &Path, name: &str, content: impl AsRef<[u8]>) -> anyhow::Result<()> {
    let (path, part) = (folder.join(name), folder.join(format!("{name}.part")));
    let written = fs::write(&part, content).and_then(|()| fs::rename(&part, &path));
    written.with_context(|| format!("cannot write {}", path.display()))
}
