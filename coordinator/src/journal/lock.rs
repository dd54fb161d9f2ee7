//! A lock for a folder of results, so that only one coordinator uses it. It ends with its process, however the process ends.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::thread;
use std::time::Duration;

use thiserror::Error;

/// The lock's file in a folder of results.
pub const LOCK_FILE: &str = "run.lock";

/// How often to try, and the pause between two attempts: `lookalike status` holds the lock briefly to test whether another process does.
const TRIES: u32 = 10;
const PAUSE: Duration = Duration::from_millis(20);

/// A locked folder of results. Dropping this releases it.
#[derive(Debug)]
pub struct RunLock {
    _file: File,
}

/// The folder cannot be locked.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum LockError {
    /// Another process holds it.
    #[error("another coordinator is running in {} ({holder}): wait for it to end, or choose another --out", folder.display())]
    Held {
        /// The folder.
        folder: PathBuf,
        /// The description that the holder wrote.
        holder: String,
    },
    /// The lock's file cannot be written.
    #[error("cannot write {}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// The error of the system.
        source: io::Error,
    },
}

impl RunLock {
    /// Take the lock of a folder.
    ///
    /// # Errors
    /// When another process holds it, or its file cannot be written. On a file system without locks, every process gets the lock.
    pub fn take(folder: &Path) -> Result<Self, LockError> {
        let path = folder.join(LOCK_FILE);
        let file_error = |source| LockError::File { path: path.clone(), source };
        let mut file =
            OpenOptions::new().read(true).write(true).create(true).truncate(false).open(&path).map_err(file_error)?;
        for tries_left in (0..TRIES).rev() {
            match file.try_lock() {
                Ok(()) | Err(TryLockError::Error(_)) => break,
                Err(TryLockError::WouldBlock) if tries_left == 0 => {
                    return Err(LockError::Held { folder: folder.to_owned(), holder: words_of(&mut file) });
                }
                Err(TryLockError::WouldBlock) => thread::sleep(PAUSE),
            }
        }
        let words = format!("process {} on {}", std::process::id(), host());
        file.set_len(0).and_then(|()| file.write_all(words.as_bytes())).map_err(file_error)?;
        Ok(Self { _file: file })
    }

    /// Whether a process holds the lock of a folder; `None` if the file system has no locks.
    #[must_use]
    pub fn is_held(folder: &Path) -> Option<bool> {
        let file = File::open(folder.join(LOCK_FILE)).ok()?;
        match file.try_lock_shared() {
            Ok(()) => Some(false),
            Err(TryLockError::WouldBlock) => Some(true),
            Err(TryLockError::Error(_)) => None,
        }
    }
}

/// The name of this machine.
pub(crate) fn host() -> String {
    nix::unistd::gethostname().map_or_else(|_| "an unknown host".into(), |name| name.to_string_lossy().into_owned())
}

fn words_of(file: &mut File) -> String {
    let mut words = String::new();
    // The file may be empty.
    let _ = file.take(256).read_to_string(&mut words);
    if words.is_empty() { "unknown process".into() } else { words }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lock_names_its_holder_and_is_released_when_dropped() {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(RunLock::is_held(folder.path()), None);
        let first = RunLock::take(folder.path()).unwrap();
        assert_eq!(RunLock::is_held(folder.path()), Some(true));
        let refused = RunLock::take(folder.path()).unwrap_err().to_string();
        assert!(refused.contains(&format!("(process {} on {})", std::process::id(), host())), "{refused}");
        drop(first);
        assert_eq!(RunLock::is_held(folder.path()), Some(false));
        assert!(RunLock::take(folder.path()).is_ok());
        assert!(matches!(RunLock::take(&folder.path().join("missing")), Err(LockError::File { .. })));
    }
}
