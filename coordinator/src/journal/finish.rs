//! The end of a run: what it wrote, so that somebody who asks again can be told that it is all there.

use std::path::Path;

use rusqlite::{OptionalExtension, params};
use serde_json::{Map, Value};

use super::error::JournalError;
use super::identity::RunIdentity;
use super::{past, schema, status, unix_ms};

/// A finished run's files of results, each with the BLAKE3 of its bytes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Finished {
    pub(crate) outputs: Vec<(String, String)>,
}

/// Mark a run as finished. The outputs of its nodes are dropped: the results are written, and the outputs are large.
pub(crate) fn finish(path: &Path, finished: &Finished) -> Result<(), JournalError> {
    let connection = schema::open(path)?;
    let outputs = finished.outputs.iter().map(|(name, hash)| (name.clone(), Value::from(hash.as_str())));
    let outputs = Value::Object(outputs.collect::<Map<_, _>>()).to_string();
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

/// The finished run of a journal, if it is finished, after a check that it is one of these inputs and settings.
pub(crate) fn finished(path: &Path, identity: &RunIdentity) -> Result<Option<Finished>, JournalError> {
    let connection = schema::open(path)?;
    past::check_identity(path, &connection, identity)?;
    let sql = "SELECT outputs FROM run WHERE finished_ms IS NOT NULL";
    let outputs = connection.query_row(sql, [], |row| row.get::<_, String>(0)).optional();
    let outputs = outputs.map_err(|source| JournalError::reading(path, source))?;
    let Some(Ok(Value::Object(outputs))) = outputs.map(|text| serde_json::from_str(&text)) else { return Ok(None) };
    let output = |(name, hash): (String, Value)| Some((name, hash.as_str()?.to_owned()));
    Ok(outputs.into_iter().map(output).collect::<Option<_>>().map(|outputs| Finished { outputs }))
}
