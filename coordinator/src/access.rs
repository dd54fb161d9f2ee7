//! The access file `OUT/access.json`: made for each run, readable by its owner alone.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use lookalike::protocol::{Access, Secret};

/// A new access with a secret from the operating system, for workers that reach the coordinator at `address`.
///
/// # Errors
/// When the system gives no random bytes.
pub fn new_access(address: String) -> Result<Access, getrandom::Error> {
    let mut secret = [0; 32];
    getrandom::fill(&mut secret)?;
    Ok(Access { address, certificate: None, secret: Secret::from_bytes(secret) })
}

/// Write an access file with mode 0600. It appears complete or not at all, and whoever had an older file of this name open
/// sees nothing of the new one.
///
/// # Errors
/// When the system does not let us.
pub fn write_access(path: &Path, access: &Access) -> io::Result<()> {
    let draft = draft_path(path)?;
    let written = create_private(&draft)
        .and_then(|mut file| {
            file.write_all(access.to_json().as_bytes())?;
            file.sync_all()
        })
        .and_then(|()| fs::rename(&draft, path));
    if written.is_err() {
        // The first error is the one to tell.
        let _ = fs::remove_file(&draft);
    }
    written
}

/// A name beside `path` that nobody else uses.
fn draft_path(path: &Path) -> io::Result<PathBuf> {
    let mut salt = [0; 8];
    getrandom::fill(&mut salt).map_err(io::Error::other)?;
    let name = path.file_name().ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, "expected a file name"))?;
    let mut draft = name.to_owned();
    draft.push(format!(".{:016x}", u64::from_le_bytes(salt)));
    Ok(path.with_file_name(draft))
}

fn create_private(path: &Path) -> io::Result<File> {
    let mut options = OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    options.open(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn access_file_is_private_even_where_a_public_one_was() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("access.json");
        fs::write(&path, "public").unwrap();
        let access = new_access("127.0.0.1:4000".into()).unwrap();
        write_access(&path, &access).unwrap();
        assert_eq!(Access::parse(&fs::read_to_string(&path).unwrap()).unwrap(), access);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o600);
        }
    }

    #[test]
    fn two_runs_have_two_secrets() {
        let [first, second] = [0, 1].map(|_| new_access("h:1".into()).unwrap());
        assert_ne!(first.secret, second.secret);
        assert!(write_access(Path::new("/"), &first).is_err());
    }
}
