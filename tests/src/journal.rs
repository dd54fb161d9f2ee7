//! What the journal of a run says, read as anybody could read it.

use std::path::Path;

use rusqlite::types::FromSql;
use rusqlite::{Connection, OpenFlags};

/// A column of the first row, or of every row, that a query of a journal gives.
#[derive(Debug)]
pub struct JournalView(Connection);

impl JournalView {
    /// The journal in a folder of results.
    ///
    /// # Panics
    /// When there is none.
    #[must_use]
    pub fn of(folder: &Path) -> Self {
        let path = folder.join("run.sqlite");
        Self(Connection::open_with_flags(path, OpenFlags::SQLITE_OPEN_READ_ONLY).expect("a journal"))
    }

    /// The number that a query gives.
    ///
    /// # Panics
    /// When it gives none.
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

    /// How many nodes were given out in one epoch though an earlier one had acknowledged their output.
    #[must_use]
    pub fn run_twice(&self) -> u64 {
        self.number(
            "SELECT count(*) FROM nodes earlier JOIN nodes later ON earlier.key = later.key AND earlier.epoch < later.epoch
             WHERE earlier.state IN (3, 4) AND (later.attempts > 0 OR later.state NOT IN (3, 4))",
        )
    }
}
