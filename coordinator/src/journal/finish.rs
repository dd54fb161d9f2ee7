//! The end of a run: records the files that it wrote, so that a later call can verify them.

use std::path::Path;

use rusqlite::{OptionalExtension, params};

use super::error::JournalError;
use super::identity::RunIdentity;
use super::names::Names;
use super::parts::{self, PartLedger};
use super::time::unix_ms;
use super::{past, schema, status};

/// The result files of a finished run, each with the BLAKE3 of its bytes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finished {
    /// For each file, its path below the folder of results and the hash of its content.
    pub outputs: Vec<(String, String)>,
}

/// Mark a run as finished, and drop the outputs of its nodes: they are large, and the results are written.
pub fn finish(path: &Path, names: Names, finished: &Finished) -> Result<(), JournalError> {
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
    // The run is finished now, so an error below does not matter.
    let _ = status::write(&connection, path, names);
    let _ = connection.execute("VACUUM", []);
    let _ = connection.pragma_update(None, "journal_mode", "DELETE");
    Ok(())
}

/// Record how the parts of a run ended, after its journal was closed. `ended` is the message about failed parts, if all have
/// ended and some failed.
pub fn settle(path: &Path, names: Names, ledger: &PartLedger, ended: Option<&str>) -> Result<(), JournalError> {
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
    // The parts are recorded now, so an error below does not matter.
    let _ = status::write(&connection, path, names);
    let _ = connection.pragma_update(None, "journal_mode", "DELETE");
    Ok(())
}

/// The result files of a journal's run, if it is finished. Checks first that it has these inputs and settings.
pub fn finished(path: &Path, identity: &RunIdentity) -> Result<Option<Finished>, JournalError> {
    let connection = schema::open(path)?;
    past::check_identity(path, &connection, identity)?;
    let sql = "SELECT outputs FROM run WHERE outputs IS NOT NULL";
    let outputs = connection.query_row(sql, [], |row| row.get::<_, String>(0)).optional();
    let outputs = outputs.map_err(|source| JournalError::reading(path, source))?;
    Ok(outputs.and_then(|text| parts::files_of(&text)).map(|outputs| Finished { outputs }))
}
