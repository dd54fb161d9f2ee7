//! Files that their owner alone can read.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Write a file with mode 0600 in the place of what was there. It appears complete or not at all, and whoever had an older file
/// of this name open sees nothing of the new one.
pub(super) fn replace(path: &Path, content: &[u8]) -> io::Result<()> {
    let draft = draft_path(path)?;
    create(&draft, content)?;
    fs::rename(&draft, path).inspect_err(|_| remove(&draft))
}

/// Write a file with mode 0600 where none was.
pub(super) fn create(path: &Path, content: &[u8]) -> io::Result<()> {
    let mut options = OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    let mut file = options.open(path)?;
    file.write_all(content).and_then(|()| file.sync_all()).inspect_err(|_| remove(path))
}

/// Whether others than its owner may read a file.
pub(super) fn is_readable_by_others(file: &File) -> bool {
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        file.metadata().is_ok_and(|metadata| metadata.permissions().mode() & 0o077 != 0)
    }
    #[cfg(not(unix))]
    {
        let _ = file;
        false
    }
}

/// Clean up after an error; that one is the one to tell.
fn remove(path: &Path) {
    let _ = fs::remove_file(path);
}

/// A name beside `path` that no other process uses.
fn draft_path(path: &Path) -> io::Result<PathBuf> {
    let mut salt = [0; 8];
    getrandom::fill(&mut salt).map_err(io::Error::other)?;
    let name = path.file_name().ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, "expected a file name"))?;
    let mut draft = name.to_owned();
    draft.push(format!(".{:016x}", u64::from_le_bytes(salt)));
    Ok(path.with_file_name(draft))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn file_is_private_even_where_a_public_one_was() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("secret");
        fs::write(&path, "public").unwrap();
        #[cfg(unix)]
        assert!(is_readable_by_others(&File::open(&path).unwrap()));
        replace(&path, b"private").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"private");
        assert!(!is_readable_by_others(&File::open(&path).unwrap()));
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
        assert!(replace(Path::new("/"), b"").is_err());
    }

    #[test]
    fn new_file_takes_no_place_of_another() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("secret");
        create(&path, b"first").unwrap();
        assert_eq!(create(&path, b"second").unwrap_err().kind(), io::ErrorKind::AlreadyExists);
        assert_eq!(fs::read(&path).unwrap(), b"first");
        assert!(!is_readable_by_others(&File::open(&path).unwrap()));
    }
}
