//! The tables, and opening a journal.

use std::fs::OpenOptions;
use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;

use rusqlite::{Connection, OpenFlags};

use super::error::JournalError;
use super::names::Names;
use super::place;
use crate::atomic;

/// The format of the tables: `PRAGMA user_version`. Any change needs a new number.
pub(super) const FORMAT: i64 = 3;

/// Marks the file as a journal of this program: `PRAGMA application_id`, the letters `Look`.
pub(super) const APPLICATION: i64 = 0x4c6f_6f6b;

/// docs/journal.md explains them. [`Names::view`] is the view of the parts. Rows about nodes are appended or found by number, so there are no further indices.
const TABLES: &str = "
CREATE TABLE run (
    id          INTEGER PRIMARY KEY CHECK (id = 1),
    name        BLOB NOT NULL,
    identity    TEXT NOT NULL,
    started_ms  INTEGER NOT NULL,
    finished_ms INTEGER,
    outputs     TEXT
);
CREATE TABLE epochs (
    epoch       INTEGER PRIMARY KEY,
    process     INTEGER NOT NULL,
    host        TEXT NOT NULL,
    program     TEXT NOT NULL,
    started_ms  INTEGER NOT NULL,
    seen_ms     INTEGER NOT NULL,
    ended_ms    INTEGER,
    ended       TEXT,
    listen      TEXT,
    best_score  REAL
);
CREATE TABLE nodes (
    id          INTEGER PRIMARY KEY,
    kind        TEXT NOT NULL,
    label       TEXT NOT NULL,
    state       INTEGER NOT NULL,
    attempts    INTEGER NOT NULL,
    deaths      INTEGER NOT NULL,
    deaths_alone    INTEGER NOT NULL,
    deaths_not_counted  INTEGER NOT NULL,
    key         BLOB,
    error       TEXT
);
CREATE TABLE attempts (
    epoch       INTEGER NOT NULL,
    node        INTEGER NOT NULL,
    attempt     INTEGER NOT NULL,
    worker      INTEGER NOT NULL,
    begun_ms    INTEGER NOT NULL,
    ended_ms    INTEGER,
    outcome     INTEGER
);
CREATE TABLE workers (
    epoch       INTEGER NOT NULL,
    worker      INTEGER NOT NULL,
    process     INTEGER NOT NULL,
    threads     INTEGER NOT NULL,
    joined_ms   INTEGER NOT NULL,
    left_ms     INTEGER,
    why         TEXT,
    PRIMARY KEY (epoch, worker)
) WITHOUT ROWID;
CREATE TABLE results (
    id          INTEGER PRIMARY KEY,
    epoch       INTEGER NOT NULL,
    key         BLOB NOT NULL,
    hash        BLOB NOT NULL,
    bytes       BLOB
);
CREATE TABLE parts (
    name        TEXT PRIMARY KEY,
    number      INTEGER NOT NULL,
    state       TEXT NOT NULL,
    score       REAL,
    seconds     REAL,
    error       TEXT,
    outputs     TEXT
) WITHOUT ROWID;
CREATE VIEW node_list AS
    SELECT id >> 32 AS epoch, id & 0xffffffff AS node, kind, label,
           CASE state WHEN 0 THEN 'waiting' WHEN 1 THEN 'ready' WHEN 2 THEN 'running' WHEN 3 THEN 'completed'
                      WHEN 4 THEN 'recalled' ELSE 'failed' END AS state,
           attempts, deaths + deaths_alone + deaths_not_counted AS deaths, lower(hex(key)) AS key, error
    FROM nodes;
CREATE VIEW attempt_list AS
    SELECT epoch, node, attempt, worker, begun_ms, ended_ms,
           CASE outcome WHEN 0 THEN 'finished' WHEN 1 THEN 'failed' WHEN 2 THEN 'lost' WHEN 3 THEN 'cancelled' END AS outcome
    FROM attempts;
";

/// How many pages are copied from the log to the journal at a time: 32 MiB. Each copy waits for the disk.
const PAGES_PER_CHECKPOINT: i64 = 8192;

/// The cache of the connection, in KiB.
const CACHE_KIB: i64 = 16 << 10;

/// How long to wait for a reader that holds a lock, which should not happen.
const BUSY_TIME: Duration = Duration::from_secs(5);

/// The number of a node among the nodes of all epochs. Those of an epoch follow those of the previous one.
pub(super) fn node_id(epoch: u64, node: u64) -> u64 {
    (epoch << 32) + node
}

/// The files of a journal: itself, its log, the log's index, and the rollback journal.
pub(crate) fn files(path: &Path) -> [PathBuf; 4] {
    ["", "-wal", "-shm", "-journal"].map(|suffix| beside(path, suffix))
}

fn beside(path: &Path, suffix: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(suffix);
    name.into()
}

/// All files that a journal of this path may use: its own, then those of an unfinished one. Any of them may be removed.
#[must_use]
pub fn all_files(path: &Path) -> Vec<PathBuf> {
    files(path).into_iter().chain(files(&unfinished(path))).collect()
}

/// Where a journal is made before it appears.
fn unfinished(path: &Path) -> PathBuf {
    beside(path, ".new")
}

/// Remove a journal, if there is one. The journal itself goes last: SQLite would replay a log that is left without it into the next journal
/// of that name.
///
/// # Errors
/// When a file cannot be removed.
pub fn remove(path: &Path) -> io::Result<()> {
    remove_all(&files(path))
}

/// Remove those of the files that exist, from the last.
fn remove_all(files: &[PathBuf]) -> io::Result<()> {
    for file in files.iter().rev() {
        match std::fs::remove_file(file) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
            _ => {}
        }
    }
    Ok(())
}

/// Create a journal that only its owner can read, and open it. The file appears with all its tables and the rows that `begin` writes,
/// or not at all, even if the process is killed or the disk is full.
pub(super) fn create(
    path: &Path,
    names: Names,
    begin: impl FnOnce(&Connection) -> rusqlite::Result<()>,
) -> Result<Connection, JournalError> {
    let creating = |source| JournalError::Create { path: path.to_owned(), source };
    let unfinished = unfinished(path);
    // Remove what a failed attempt left.
    remove(&unfinished).map_err(creating)?;
    let made = make(&unfinished, names, begin).map_err(|error| error.about(path));
    if made.is_err() {
        // If this fails, the next attempt removes it.
        let _ = remove(&unfinished);
    }
    made?;
    // A log of an earlier journal, which the user has removed, would be replayed into this one.
    remove_all(&files(path)[1..]).map_err(creating)?;
    atomic::rename(&unfinished, path).map_err(creating)?;
    connect(path, is_shared(path))
}

/// Write a new journal, in one transaction and one file.
fn make(
    path: &Path,
    names: Names,
    begin: impl FnOnce(&Connection) -> rusqlite::Result<()>,
) -> Result<(), JournalError> {
    let mut options = OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    options.open(path).map_err(|source| match source.kind() {
        io::ErrorKind::AlreadyExists => JournalError::Exists { path: path.to_owned() },
        _ => JournalError::Create { path: path.to_owned(), source },
    })?;
    let write = || -> rusqlite::Result<()> {
        let mut connection = Connection::open_with_flags(path, OpenFlags::SQLITE_OPEN_READ_WRITE)?;
        connection.pragma_update(None, "synchronous", "FULL")?;
        let transaction = connection.transaction()?;
        transaction.execute_batch(TABLES)?;
        transaction.execute_batch(&names.view())?;
        transaction.pragma_update(None, "application_id", APPLICATION)?;
        transaction.pragma_update(None, "user_version", FORMAT)?;
        begin(&transaction)?;
        transaction.commit()?;
        connection.close().map_err(|(_, error)| error)
    };
    write().map_err(|source| JournalError::writing(path, source))
}

/// Open an existing journal, to resume its run.
pub(super) fn open(path: &Path) -> Result<Connection, JournalError> {
    // Check first: opening the file must not turn it into a journal.
    let looking = Connection::open_with_flags(path, OpenFlags::SQLITE_OPEN_READ_WRITE)
        .map_err(|source| JournalError::reading(path, source))?;
    check_format(path, &looking)?;
    drop(looking);
    connect(path, is_shared(path))
}

fn is_shared(path: &Path) -> bool {
    path.parent().is_some_and(place::is_shared)
}

/// Check that a file is a journal of this format.
pub(super) fn check_format(path: &Path, connection: &Connection) -> Result<(), JournalError> {
    let pragma = |name: &str| -> Result<i64, JournalError> {
        let value = connection.pragma_query_value(None, name, |row| row.get(0));
        value.map_err(|source| JournalError::reading(path, source))
    };
    if pragma("application_id")? != APPLICATION {
        return Err(JournalError::NotAJournal { path: path.to_owned() });
    }
    match pragma("user_version")? {
        FORMAT => Ok(()),
        found => Err(JournalError::Version { path: path.to_owned(), expected: FORMAT, found }),
    }
}

/// Connect to a journal. If other machines may write to its file system, lock it exclusively.
pub(super) fn connect(path: &Path, is_shared: bool) -> Result<Connection, JournalError> {
    let connect = || {
        let connection = Connection::open_with_flags(path, OpenFlags::SQLITE_OPEN_READ_WRITE)?;
        connection.busy_timeout(BUSY_TIME)?;
        connection.set_prepared_statement_cache_capacity(32);
        if is_shared {
            // Set this before the log is first used; then the log needs no shared memory.
            connection.pragma_update(None, "locking_mode", "EXCLUSIVE")?;
        }
        connection.pragma_update(None, "journal_mode", "WAL")?;
        connection.pragma_update(None, "synchronous", "NORMAL")?;
        connection.pragma_update(None, "wal_autocheckpoint", PAGES_PER_CHECKPOINT)?;
        connection.pragma_update(None, "cache_size", -CACHE_KIB)?;
        Ok(connection)
    };
    connect().map_err(|source| JournalError::writing(path, source))
}
