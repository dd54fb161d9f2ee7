//! Atomic writes: a file is written as a draft beside its place and then renamed. A reader sees the old file or the complete new one.
//!
//! The draft is a new file: a symbolic link in its place is removed, never followed.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Write a file. It is on the disk when this returns.
///
/// # Errors
/// When the draft or the file cannot be written.
pub fn write(path: &Path, content: &[u8]) -> io::Result<()> {
    write_as(path, content, Draft { mode: 0o666, is_synced: true })
}

/// Write a file with mode 0600. A process that has an older file of this name open cannot read the new one through it.
///
/// # Errors
/// When the draft or the file cannot be written.
pub fn write_private(path: &Path, content: &[u8]) -> io::Result<()> {
    write_as(path, content, Draft { mode: 0o600, is_synced: true })
}

/// Write a file that is soon written again, without waiting for the disk. A power loss may restore an older version.
///
/// # Errors
/// When the draft or the file cannot be written.
pub fn write_unsynced(path: &Path, content: &[u8]) -> io::Result<()> {
    write_as(path, content, Draft { mode: 0o666, is_synced: false })
}

/// Rename a complete draft to its final name.
///
/// # Errors
/// When it cannot be renamed.
pub fn rename(draft: &Path, path: &Path) -> io::Result<()> {
    fs::rename(draft, path)?;
    // Some file systems cannot synchronise a folder. That is no reason to fail.
    let _ = path.parent().map(File::open).transpose().and_then(|folder| folder.map_or(Ok(()), |it| it.sync_all()));
    Ok(())
}

/// Where a file is written before it is complete.
#[must_use]
pub fn draft_of(path: &Path) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".partial");
    path.with_file_name(name)
}

/// How a draft is written.
#[derive(Clone, Copy)]
struct Draft {
    mode: u32,
    is_synced: bool,
}

fn write_as(path: &Path, content: &[u8], how: Draft) -> io::Result<()> {
    if path.file_name().is_none() {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "expected a file name"));
    }
    let draft = draft_of(path);
    // A killed process may have left a draft.
    match fs::remove_file(&draft) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
        _ => {}
    }
    let mut options = OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, how.mode);
    let mut file = options.open(&draft)?;
    let written = file.write_all(content).and_then(|()| if how.is_synced { file.sync_all() } else { Ok(()) });
    let placed = written.and_then(|()| if how.is_synced { rename(&draft, path) } else { fs::rename(&draft, path) });
    placed.inspect_err(|_| _ = fs::remove_file(&draft))
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use std::os::unix::fs::symlink;

    #[test]
    fn links_in_place_of_the_file_are_replaced_and_not_followed() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::write(at("mine"), "precious").unwrap();
        symlink(at("mine"), at("out")).unwrap();
        symlink(at("mine"), at("out.partial")).unwrap();
        for write in [write, write_private, write_unsynced] {
            write(&at("out"), b"new").unwrap();
            assert_eq!(fs::read(at("out")).unwrap(), b"new");
        }
        assert_eq!(fs::read(at("mine")).unwrap(), b"precious");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
    }
}
