//! The folder of the report: the files in it, and how they are written.

use anyhow::Context;
use std::{collections::BTreeSet, fs, io::ErrorKind, path::Path};

/// Names of the files in a folder; none where there is no folder.
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

/// Writes beside the file and puts it in its place when it is whole: who reads meanwhile sees the old report or the new one.
pub(crate) fn file(folder: &Path, name: &str, content: impl AsRef<[u8]>) -> anyhow::Result<()> {
    let (path, part) = (folder.join(name), folder.join(format!("{name}.part")));
    let written = fs::write(&part, content).and_then(|()| fs::rename(&part, &path));
    written.with_context(|| format!("cannot write {}", path.display()))
}
