//! The fits of a run of many, as its journal has them: how each is doing, and what it wrote.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use rusqlite::{Connection, params};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use super::error::JournalError;
use super::identity::RunIdentity;
use super::{past, schema};

/// A fit of a run of many.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FitStatus {
    /// Its name.
    pub name: String,
    /// `waiting`, `running`, `done`, `missed`, `failed` or `stopped`, as in the summaries.
    pub state: String,
    /// Its final score of the whole image.
    pub cssim: Option<f64>,
    /// From its start to its end.
    pub seconds: Option<f64>,
    /// Why it failed.
    pub error: Option<String>,
}

/// The row of a fit.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FitRow {
    /// Its place among the fits, from 0.
    pub number: u32,
    /// How it is doing.
    pub status: FitStatus,
    /// The files that it has written, each with the BLAKE3 of its bytes; empty until all are there.
    pub outputs: Vec<(String, String)>,
}

/// What the journal is to be told of fits. Told from any thread, and written with the next transaction: what a fit has written is in
/// the journal no later than that the outputs of its nodes leave it. Clones are the same ledger.
#[derive(Clone, Debug, Default)]
pub struct FitLedger(Arc<Mutex<BTreeMap<String, FitRow>>>);

impl FitLedger {
    /// How a fit is doing now.
    pub fn tell(&self, row: FitRow) {
        self.lock().insert(row.status.name.clone(), row);
    }

    /// What was told and is not written yet.
    pub(super) fn take(&self) -> Vec<FitRow> {
        std::mem::take(&mut *self.lock()).into_values().collect()
    }

    /// These could not be written: they are to be tried again, unless something newer was told.
    pub(super) fn put_back(&self, rows: Vec<FitRow>) {
        let mut told = self.lock();
        for row in rows {
            told.entry(row.status.name.clone()).or_insert(row);
        }
    }

    fn lock(&self) -> MutexGuard<'_, BTreeMap<String, FitRow>> {
        // A row is told in one piece.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// What an earlier process of a run of many has left.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct WrittenFits {
    /// Whether every fit was written.
    pub is_finished: bool,
    /// The files of each fit that was written, with the BLAKE3 of their bytes.
    pub outputs: BTreeMap<String, Vec<(String, String)>>,
}

/// What the run of a journal has written, after a check that it is one of these inputs and settings.
pub fn written(path: &Path, identity: &RunIdentity) -> Result<WrittenFits, JournalError> {
    let connection = schema::open(path)?;
    past::check_identity(path, &connection, identity)?;
    let read = || -> rusqlite::Result<WrittenFits> {
        let sql = "SELECT outputs IS NOT NULL FROM run";
        let is_finished = connection.query_row(sql, [], |row| row.get(0))?;
        let mut statement = connection.prepare("SELECT name, outputs FROM fits WHERE outputs IS NOT NULL")?;
        let rows = statement.query_map([], |row| Ok((row.get(0)?, row.get::<_, String>(1)?)))?;
        let rows = rows.collect::<rusqlite::Result<Vec<(String, String)>>>()?;
        let outputs = rows.into_iter().filter_map(|(name, text)| Some((name, files_of(&text)?))).collect();
        Ok(WrittenFits { is_finished, outputs })
    };
    read().map_err(|source| JournalError::reading(path, source))
}

/// Writes rows, in place of those of the same names.
pub(super) fn write(connection: &Connection, rows: &[FitRow]) -> rusqlite::Result<()> {
    for FitRow { number, status, outputs } in rows {
        let FitStatus { name, state, cssim, seconds, error } = status;
        let outputs = (!outputs.is_empty()).then(|| files_json(outputs));
        connection
            .prepare_cached(
                "INSERT OR REPLACE INTO fits (name, number, state, cssim, seconds, error, outputs)
                 VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7)",
            )?
            .execute(params![name, number, state, cssim, seconds, error, outputs])?;
    }
    Ok(())
}

/// All fits, in their order.
pub(super) fn read(connection: &Connection) -> rusqlite::Result<Vec<FitStatus>> {
    let sql = "SELECT name, state, cssim, seconds, error FROM fits ORDER BY number, name";
    let mut statement = connection.prepare_cached(sql)?;
    let rows = statement.query_map([], |row| {
        let (name, state) = (row.get(0)?, row.get(1)?);
        Ok(FitStatus { name, state, cssim: row.get(2)?, seconds: row.get(3)?, error: row.get(4)? })
    })?;
    rows.collect()
}

/// Files with their hashes as an object.
pub(super) fn files_json(files: &[(String, String)]) -> String {
    let files = files.iter().map(|(name, hash)| (name.clone(), Value::from(hash.as_str())));
    Value::Object(files.collect::<Map<_, _>>()).to_string()
}

/// The files with their hashes that an object names; `None` for anything else.
pub(super) fn files_of(text: &str) -> Option<Vec<(String, String)>> {
    let Ok(Value::Object(files)) = serde_json::from_str(text) else { return None };
    files.into_iter().map(|(name, hash)| Some((name, hash.as_str()?.to_owned()))).collect()
}
