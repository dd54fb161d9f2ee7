//! The end of a run: the files that it wrote, so that a second call can verify them.

use std::path::Path;

use rusqlite::{OptionalExtension, params};

use super::error::JournalError;
use super::identity::RunIdentity;
use super::parts::{self, PartLedger};
use super::time::unix_ms;
use super::{past, schema, status};

/// A finished run's files of results, each with the BLAKE3 of its bytes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finished {
    /// Path below the folder of results and hash of its content, of each file.
    pub outputs: Vec<(String, String)>,
}

/// Mark a run as finished. The outputs of its nodes are dropped: the results are written, and the outputs are large.
pub fn finish(path: &Path, finished: &Finished) -> Result<(), JournalError> {
    let connection = schema::open(path)?;
    let outputs = parts::files_json(&finished.outputs);
    let write = || -> rusqlite::Result<()> {
        let now = unix_ms();
        connection.execute("UPDATE run SET finished_ms = ?1, outputs = ?2", params![now, outputs])?;
        connection.execute(
            "UPDATE epochs SET ended_ms = ?1, seen_ms = ?1 WHERE epoch = (SELECT max(epoch) FROM epochs)",
            [now],
        )?;
        connection.execute("UPDATE results SET bytes = NULL", [])?;
        Ok(())
    };
    write().map_err(|source| JournalError::writing(path, source))?;
    // What follows only tidies up.
    let _ = status::write(&connection, path);
    let _ = connection.execute("VACUUM", []);
    let _ = connection.pragma_update(None, "journal_mode", "DELETE");
    Ok(())
}

/// Write how the parts of a run ended, after its journal was closed. With `ended`, all of them have ended and some failed: how many.
pub fn settle(path: &Path, ledger: &PartLedger, ended: Option<&str>) -> Result<(), JournalError> {
    let mut connection = schema::open(path)?;
    let rows = ledger.take();
    let mut write = || -> rusqlite::Result<()> {
        let transaction = connection.transaction()?;
        parts::write(&transaction, &rows)?;
        if let Some(ended) = ended {
            let now = unix_ms();
            transaction.execute("UPDATE run SET finished_ms = ?1", [now])?;
            transaction.execute(
                "UPDATE epochs SET ended_ms = ?1, seen_ms = ?1, ended = ?2 WHERE epoch = (SELECT max(epoch) FROM epochs)",
                params![now, ended],
            )?;
        }
        transaction.commit()
    };
    write().map_err(|source| JournalError::writing(path, source))?;
    // What follows only tidies up.
    let _ = status::write(&connection, path);
    let _ = connection.pragma_update(None, "journal_mode", "DELETE");
    Ok(())
}

/// The finished run of a journal, if it is finished, after a check that it is one of these inputs and settings.
pub fn finished(path: &Path, identity: &RunIdentity) -> Result<Option<Finished>, JournalError> {
    let connection = schema::open(path)?;
    past::check_identity(path, &connection, identity)?;
    let sql = "SELECT outputs FROM run WHERE outputs IS NOT NULL";
    let outputs = connection.query_row(sql, [], |row| row.get::<_, String>(0)).optional();
    let outputs = outputs.map_err(|source| JournalError::reading(path, source))?;
    Ok(outputs.and_then(|text| parts::files_of(&text)).map(|outputs| Finished { outputs }))
}
