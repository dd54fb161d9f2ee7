//! Errors of a journal.

use std::io;
use std::path::{Path, PathBuf};

use rusqlite::ErrorCode;
use thiserror::Error;

use super::identity::Difference;

/// Errors of a journal.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum JournalError {
    /// The file holds a run, and `--resume` was not given.
    #[error("{} already holds a run; resume it with --resume, choose another --out, or remove it first", path.display())]
    Exists {
        /// The journal.
        path: PathBuf,
    },
    /// The file is not a journal.
    #[error("{} is not the journal of a run; choose another --out, or move that file away", path.display())]
    NotAJournal {
        /// The file.
        path: PathBuf,
    },
    /// Another version of this program wrote it in another format.
    #[error(
        "{} has journal format {found}, expected {expected}; use the version of lookalike that began the run, or choose another --out",
        path.display()
    )]
    Version {
        /// The journal.
        path: PathBuf,
        /// The format that this program writes.
        expected: i64,
        /// The format of the file.
        found: i64,
    },
    /// The run in the journal has other inputs or settings.
    #[error(
        "{} is the journal of a run with other inputs or settings: {}; resume with those of that run, or choose another --out",
        path.display(), listed(differences)
    )]
    AnotherRun {
        /// The journal.
        path: PathBuf,
        /// The differences.
        differences: Vec<Difference>,
    },
    /// Another process uses the journal.
    #[error("another process is using the journal {}; wait for it to end, then try again", path.display())]
    Busy {
        /// The journal.
        path: PathBuf,
    },
    /// The disk is full.
    #[error(
        "cannot write the journal {}: the disk is full; free some space there and resume with --resume; acknowledged results are kept",
        path.display()
    )]
    DiskFull {
        /// The journal.
        path: PathBuf,
    },
    /// The journal cannot be written.
    #[error(
        "cannot write the journal {}; fix the cause and resume with --resume; acknowledged results are kept",
        path.display()
    )]
    Write {
        /// The journal.
        path: PathBuf,
        /// The error of SQLite.
        source: rusqlite::Error,
    },
    /// The journal cannot be opened or read.
    #[error("cannot use the journal {}", path.display())]
    Open {
        /// The journal.
        path: PathBuf,
        /// The error of SQLite.
        source: rusqlite::Error,
    },
    /// The thread that writes the journal has panicked, which is a bug of this program.
    #[error(
        "the thread that writes the journal {} has panicked; resume with --resume, and please report this",
        path.display()
    )]
    Thread {
        /// The journal.
        path: PathBuf,
    },
    /// The journal's file cannot be created.
    #[error("cannot create the journal {}", path.display())]
    Create {
        /// The journal.
        path: PathBuf,
        /// The error of the system.
        source: io::Error,
    },
}

impl JournalError {
    /// The same error about another file: a temporary file's errors name the journal instead.
    pub(super) fn about(mut self, other: &Path) -> Self {
        match &mut self {
            Self::Exists { path }
            | Self::NotAJournal { path }
            | Self::Version { path, .. }
            | Self::AnotherRun { path, .. }
            | Self::Busy { path }
            | Self::DiskFull { path }
            | Self::Write { path, .. }
            | Self::Open { path, .. }
            | Self::Create { path, .. }
            | Self::Thread { path } => other.clone_into(path),
        }
        self
    }

    /// The exit code of the program: 2 for a journal of another run or format, 3 when the system fails.
    #[must_use]
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Busy { .. } | Self::DiskFull { .. } | Self::Write { .. } | Self::Thread { .. } => 3,
            _ => 2,
        }
    }

    /// An error while reading.
    pub(super) fn reading(path: &Path, source: rusqlite::Error) -> Self {
        let path = path.to_owned();
        match source.sqlite_error_code() {
            Some(ErrorCode::NotADatabase) => Self::NotAJournal { path },
            Some(ErrorCode::DatabaseBusy | ErrorCode::DatabaseLocked) => Self::Busy { path },
            Some(ErrorCode::DiskFull) => Self::DiskFull { path },
            _ => Self::Open { path, source },
        }
    }

    /// An error while writing.
    pub(super) fn writing(path: &Path, source: rusqlite::Error) -> Self {
        let path = path.to_owned();
        match source.sqlite_error_code() {
            Some(ErrorCode::DatabaseBusy | ErrorCode::DatabaseLocked) => Self::Busy { path },
            Some(ErrorCode::DiskFull) => Self::DiskFull { path },
            _ => Self::Write { path, source },
        }
    }
}

/// The most differences that are shown; there may be many.
const MOST_SHOWN: usize = 10;

fn listed(differences: &[Difference]) -> String {
    let shown = differences.iter().take(MOST_SHOWN).map(ToString::to_string).collect::<Vec<_>>().join("; ");
    match differences.len().checked_sub(MOST_SHOWN) {
        None | Some(0) => shown,
        Some(more) => format!("{shown}; and {more} more"),
    }
}
