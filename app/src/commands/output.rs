//! Files that a command writes.

use anyhow::{Context, anyhow, bail};
use std::{fs, io::ErrorKind, path::Path};

/// Checks whether a file can be written, before the work whose result it will hold.
pub(crate) fn check_writable(path: &Path) -> anyhow::Result<()> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let writable = || {
        if path.is_dir() {
            bail!("expected a file, found a folder; give the path of a file in it");
        }
        if !folder.is_dir() {
            bail!("the folder {} does not exist; create it first", folder.display());
        }
        Ok(())
    };
    writable().with_context(|| cannot_write(path))
}

/// Writes a whole file.
pub(crate) fn write_file(path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    let explained = fs::write(path, bytes).map_err(|error| match error.kind() {
        ErrorKind::PermissionDenied => anyhow!("this user may not write there; choose another place"),
        ErrorKind::StorageFull => anyhow!("the disk is full; free some space or choose another place"),
        _ => anyhow!(error),
    });
    explained.with_context(|| cannot_write(path))
}

fn cannot_write(path: &Path) -> String {
    format!("cannot write {}", path.display())
}
