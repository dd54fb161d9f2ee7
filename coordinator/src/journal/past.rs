//! The start of an epoch: creates a journal, or loads one of earlier epochs.

use std::collections::HashMap;
use std::net::SocketAddr;
use std::path::Path;

use lookalike::graph::NodeKey;
use lookalike::protocol::RunName;
use rusqlite::{Connection, OptionalExtension, params};

use super::error::JournalError;
use super::identity::RunIdentity;
use super::lock::host;
use super::names::Names;
use super::schema;
use super::time::unix_ms;
use crate::state::Deaths;

/// The data of earlier epochs.
#[derive(Debug, Default)]
pub(crate) struct Past {
    /// Deaths of workers that executed a node, for nodes with at least one.
    pub(crate) deaths: HashMap<NodeKey, Deaths>,
    /// The address on which the last coordinator listened.
    pub(crate) listen: Option<SocketAddr>,
    /// How many nodes have a result.
    pub(crate) results: usize,
}

/// The content of a journal when it is opened.
pub(super) struct Loaded {
    pub(super) run: RunName,
    pub(super) epoch: u64,
    pub(super) results: HashMap<NodeKey, i64>,
    pub(super) past: Past,
}

/// Create a journal.
pub(super) fn begin(
    path: &Path,
    identity: &RunIdentity,
    names: Names,
    run: RunName,
) -> Result<(Connection, Loaded), JournalError> {
    let connection = schema::create(path, names, |connection| {
        connection.execute(
            "INSERT INTO run (id, name, identity, started_ms) VALUES (1, ?1, ?2, ?3)",
            params![run.0, identity.to_json(), unix_ms()],
        )?;
        add_epoch(connection, 1)
    })?;
    Ok((connection, Loaded { run, epoch: 1, results: HashMap::new(), past: Past::default() }))
}

/// Load a journal, to resume its run.
pub(super) fn load(path: &Path, identity: &RunIdentity) -> Result<(Connection, Loaded), JournalError> {
    let connection = schema::open(path)?;
    check_identity(path, &connection, identity)?;
    let reading = |source| JournalError::reading(path, source);
    let run = connection.query_row("SELECT name FROM run", [], |row| Ok(RunName(row.get(0)?))).map_err(reading)?;
    let last: u64 = connection.query_row("SELECT max(epoch) FROM epochs", [], |row| row.get(0)).map_err(reading)?;
    let results = results(&connection).map_err(reading)?;
    let past = past(&connection, results.len()).map_err(reading)?;
    let epoch = last + 1;
    add_epoch(&connection, epoch).map_err(|source| JournalError::writing(path, source))?;
    // A resumed run is no longer finished.
    let reopened = connection.execute("UPDATE run SET finished_ms = NULL, outputs = NULL", []);
    reopened.map_err(|source| JournalError::writing(path, source))?;
    Ok((connection, Loaded { run, epoch, results, past }))
}

/// Check that a journal's run has these inputs and settings.
pub(super) fn check_identity(path: &Path, connection: &Connection, here: &RunIdentity) -> Result<(), JournalError> {
    let text = connection.query_row("SELECT identity FROM run", [], |row| row.get::<_, String>(0)).optional();
    let text = text.map_err(|source| JournalError::reading(path, source))?;
    let there = text.and_then(|text| RunIdentity::from_json(&text));
    let there = there.ok_or_else(|| JournalError::NotAJournal { path: path.to_owned() })?;
    match here.differences(&there) {
        differences if differences.is_empty() => Ok(()),
        differences => Err(JournalError::AnotherRun { path: path.to_owned(), differences }),
    }
}

fn add_epoch(connection: &Connection, epoch: u64) -> rusqlite::Result<()> {
    connection.execute(
        "INSERT INTO epochs (epoch, process, host, program, started_ms, seen_ms) VALUES (?1, ?2, ?3, ?4, ?5, ?5)",
        params![epoch, std::process::id(), host(), env!("CARGO_PKG_VERSION"), unix_ms()],
    )?;
    Ok(())
}

fn results(connection: &Connection) -> rusqlite::Result<HashMap<NodeKey, i64>> {
    let mut statement = connection.prepare("SELECT key, id FROM results WHERE bytes IS NOT NULL")?;
    let rows = statement.query_map([], |row| Ok((NodeKey(row.get(0)?), row.get(1)?)))?;
    rows.collect()
}

fn past(connection: &Connection, results: usize) -> rusqlite::Result<Past> {
    let mut past = Past { results, ..Past::default() };
    let mut statement = connection.prepare(
        "SELECT key, deaths, deaths_alone, deaths_not_counted FROM nodes
         WHERE key IS NOT NULL AND deaths + deaths_alone + deaths_not_counted > 0",
    )?;
    let mut rows = statement.query([])?;
    while let Some(row) = rows.next()? {
        let key = NodeKey(row.get(0)?);
        let deaths = Deaths { in_company: row.get(1)?, alone: row.get(2)?, not_counted: row.get(3)? };
        // Each epoch starts with the counts of the previous one.
        if deaths.total() > past.deaths.get(&key).map_or(0, |most| most.total()) {
            past.deaths.insert(key, deaths);
        }
    }
    let listen = connection.query_row(
        "SELECT listen FROM epochs WHERE listen IS NOT NULL ORDER BY epoch DESC LIMIT 1",
        [],
        |row| row.get::<_, String>(0),
    );
    past.listen = listen.optional()?.and_then(|listen| listen.parse().ok());
    Ok(past)
}
