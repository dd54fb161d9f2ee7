//! The content of a run's journal, read with plain SQL.

use std::fs::OpenOptions;
use std::path::Path;

use rusqlite::types::FromSql;
use rusqlite::{Connection, OpenFlags};

/// An open journal of a run.
#[derive(Debug)]
pub struct JournalView(Connection);

impl JournalView {
    /// The journal in a folder of results.
    ///
    /// # Panics
    /// When the folder has no journal.
    #[must_use]
    pub fn of(folder: &Path) -> Self {
        let path = folder.join("run.sqlite");
        Self(Connection::open_with_flags(path, OpenFlags::SQLITE_OPEN_READ_ONLY).expect("a journal"))
    }

    /// The number that a query returns.
    ///
    /// # Panics
    /// When the query returns no number.
    #[must_use]
    pub fn number(&self, query: &str) -> u64 {
        self.0.query_row(query, [], |row| row.get(0)).expect(query)
    }

    /// The first column of every row.
    ///
    /// # Panics
    /// When the query is wrong.
    #[must_use]
    pub fn column<T: FromSql>(&self, query: &str) -> Vec<T> {
        let mut statement = self.0.prepare(query).expect(query);
        let rows = statement.query_map([], |row| row.get(0)).expect(query);
        rows.collect::<Result<_, _>>().expect(query)
    }

    /// How many nodes were assigned in one epoch although an earlier epoch had acknowledged their output.
    #[must_use]
    pub fn run_twice(&self) -> u64 {
        self.number(
            "SELECT count(DISTINCT later.key) FROM results JOIN node_list later
                 ON lower(hex(results.key)) = later.key AND results.epoch < later.epoch
             WHERE later.attempts > 0 OR later.state <> 'recalled'",
        )
    }
}

/// Truncate the log of a journal whose process has ended to this share of its length, as a power failure may. Returns the bytes that
/// remain.
///
/// # Panics
/// When there is no log.
#[must_use]
pub fn tear(folder: &Path, share: f64) -> u64 {
    let log = OpenOptions::new().write(true).open(folder.join("run.sqlite-wal")).expect("the log of a journal");
    let length = log.metadata().expect("a length").len();
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of what there is")]
    let left = (length as f64 * share.clamp(0.0, 1.0)) as u64;
    log.set_len(left).expect("a file of ours");
    left
}

/// Damage the bytes of one output in a journal whose process has ended; `false` if the journal has no output.
///
/// # Panics
/// When there is no journal.
#[must_use]
pub fn damage_an_output(folder: &Path, choice: u64) -> bool {
    let journal = Connection::open(folder.join("run.sqlite")).expect("a journal");
    let count = "SELECT count(*) FROM results WHERE length(bytes) > 0";
    let outputs: u64 = journal.query_row(count, [], |row| row.get(0)).expect("results");
    let damage = "UPDATE results SET bytes = zeroblob(length(bytes)) WHERE id =
         (SELECT id FROM results WHERE length(bytes) > 0 ORDER BY id LIMIT 1 OFFSET ?1)";
    outputs > 0 && journal.execute(damage, [choice % outputs]).expect("a journal that can be written") == 1
}
