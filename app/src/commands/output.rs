//! Files that a command writes.

use anyhow::{Context, anyhow, bail};
use lookalike_coordinator::atomic;
use std::{
    fs,
    io::{self, ErrorKind},
    path::Path,
};

/// Checks whether a file can be written, before the work whose result it will hold. It may replace a file, but no input of the command.
pub(crate) fn check_writable(path: &Path, inputs: &[&Path]) -> anyhow::Result<()> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let writable = || {
        match fs::symlink_metadata(path) {
            Ok(it) if it.is_symlink() => {
                bail!("it is a symbolic link, which is neither followed nor replaced; choose another place")
            }
            Ok(it) if it.is_dir() => bail!("expected a file, found a folder; give the path of a file in it"),
            Ok(it) if !it.is_file() => bail!("expected a file, found a device or a pipe; choose another place"),
            Ok(it) if it.permissions().readonly() => bail!("the file there is write-protected; choose another place"),
            _ => {}
        }
        if !folder.is_dir() {
            bail!("the folder {} does not exist; create it first", folder.display());
        }
        let is_at = |place: &Path, input: &Path| fs::canonicalize(input).is_ok_and(|it| it == place);
        let place = fs::canonicalize(path).ok();
        if let Some(input) = place.and_then(|place| inputs.iter().find(|input| is_at(&place, input))) {
            bail!("it is the input {}, which would be replaced; choose another place", input.display());
        }
        let draft = atomic::draft_of(path);
        if fs::symlink_metadata(&draft).is_ok() {
            bail!("{} would be replaced; it may be left from a killed process: remove it or move it", draft.display());
        }
        // The file is written beside its place and then moved there.
        fs::File::create_new(&draft).and_then(|_| fs::remove_file(&draft)).map_err(explained)
    };
    writable().with_context(|| cannot_write(path))
}

/// Writes a whole file, atomically.
pub(crate) fn write_file(path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    atomic::write(path, bytes).map_err(explained).with_context(|| cannot_write(path))
}

fn explained(error: io::Error) -> anyhow::Error {
    match error.kind() {
        ErrorKind::PermissionDenied => anyhow!("this user may not write there; choose another place"),
        ErrorKind::StorageFull => anyhow!("the disk is full; free some space or choose another place"),
        _ => anyhow!(error),
    }
}

fn cannot_write(path: &Path) -> String {
    format!("cannot write {}", path.display())
}
