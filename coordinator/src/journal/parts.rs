//! The parts of a run of many in its journal: their states, and the files that they wrote.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use rusqlite::{Connection, params};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use super::error::JournalError;
use super::identity::RunIdentity;
use super::{past, schema};

/// A part of a run of many.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PartStatus {
    /// Its name.
    pub name: String,
    /// `waiting`, `running`, `done`, `missed`, `failed` or `stopped`.
    pub state: String,
    /// Its final score.
    pub score: Option<f64>,
    /// The time from its start to its end.
    pub seconds: Option<f64>,
    /// Why it failed.
    pub error: Option<String>,
}

/// The row of a part.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PartRow {
    /// Its place among the parts, from 0.
    pub number: u32,
    /// Its state.
    pub status: PartStatus,
    /// The files that it wrote, each with the BLAKE3 of its bytes; empty until all are written.
    pub outputs: Vec<(String, String)>,
}

/// Rows about parts that are to be written to the journal. Any thread may add rows; they are written with the next transaction,
/// so the files of a part are in the journal before the outputs of its nodes are dropped from it. Clones share one ledger.
#[derive(Clone, Debug, Default)]
pub struct PartLedger(Arc<Mutex<BTreeMap<String, PartRow>>>);

impl PartLedger {
    /// Set the row of a part.
    pub fn tell(&self, row: PartRow) {
        self.lock().insert(row.status.name.clone(), row);
    }

    /// Take the rows that are not written yet.
    pub(super) fn take(&self) -> Vec<PartRow> {
        std::mem::take(&mut *self.lock()).into_values().collect()
    }

    /// Return rows that could not be written, so that the next transaction writes them. Newer rows take precedence.
    pub(super) fn put_back(&self, rows: Vec<PartRow>) {
        let mut told = self.lock();
        for row in rows {
            told.entry(row.status.name.clone()).or_insert(row);
        }
    }

    fn lock(&self) -> MutexGuard<'_, BTreeMap<String, PartRow>> {
        // A row is inserted as a whole, so a panic leaves the map consistent.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The parts that earlier processes of a run wrote.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct WrittenParts {
    /// Whether every part was written.
    pub is_finished: bool,
    /// The files of each part that was written, with the BLAKE3 of their bytes.
    pub outputs: BTreeMap<String, Vec<(String, String)>>,
}

/// The files that a journal's run wrote. Checks first that it has these inputs and settings.
pub fn written(path: &Path, identity: &RunIdentity) -> Result<WrittenParts, JournalError> {
    let connection = schema::open(path)?;
    past::check_identity(path, &connection, identity)?;
    let read = || -> rusqlite::Result<WrittenParts> {
        let sql = "SELECT outputs IS NOT NULL FROM run";
        let is_finished = connection.query_row(sql, [], |row| row.get(0))?;
        let mut statement = connection.prepare("SELECT name, outputs FROM parts WHERE outputs IS NOT NULL")?;
        let rows = statement.query_map([], |row| Ok((row.get(0)?, row.get::<_, String>(1)?)))?;
        let rows = rows.collect::<rusqlite::Result<Vec<(String, String)>>>()?;
        let outputs = rows.into_iter().filter_map(|(name, text)| Some((name, files_of(&text)?))).collect();
        Ok(WrittenParts { is_finished, outputs })
    };
    read().map_err(|source| JournalError::reading(path, source))
}

/// Write rows, replacing those with the same names.
pub(super) fn write(connection: &Connection, rows: &[PartRow]) -> rusqlite::Result<()> {
    for PartRow { number, status, outputs } in rows {
        let PartStatus { name, state, score, seconds, error } = status;
        let outputs = (!outputs.is_empty()).then(|| files_json(outputs));
        connection
            .prepare_cached(
                "INSERT OR REPLACE INTO parts (name, number, state, score, seconds, error, outputs)
                 VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7)",
            )?
            .execute(params![name, number, state, score, seconds, error, outputs])?;
    }
    Ok(())
}

/// All parts, in their order.
pub(super) fn read(connection: &Connection) -> rusqlite::Result<Vec<PartStatus>> {
    let sql = "SELECT name, state, score, seconds, error FROM parts ORDER BY number, name";
    let mut statement = connection.prepare_cached(sql)?;
    let rows = statement.query_map([], |row| {
        let (name, state) = (row.get(0)?, row.get(1)?);
        Ok(PartStatus { name, state, score: row.get(2)?, seconds: row.get(3)?, error: row.get(4)? })
    })?;
    rows.collect()
}

/// Files with their hashes as a JSON object.
pub(super) fn files_json(files: &[(String, String)]) -> String {
    let files = files.iter().map(|(name, hash)| (name.clone(), Value::from(hash.as_str())));
    Value::Object(files.collect::<Map<_, _>>()).to_string()
}

/// Parse an object of files with their hashes; `None` for anything else.
pub(super) fn files_of(text: &str) -> Option<Vec<(String, String)>> {
    let Ok(Value::Object(files)) = serde_json::from_str(text) else { return None };
    files.into_iter().map(|(name, hash)| Some((name, hash.as_str()?.to_owned()))).collect()
}
