//! The begin of an epoch: a new journal, or what earlier epochs have left in one.

use std::collections::HashMap;
use std::net::SocketAddr;
use std::path::Path;

use lookalike::graph::NodeKey;
use lookalike::protocol::{ProcessName, RunName};
use rusqlite::{Connection, OptionalExtension, Row, params};

use super::error::JournalError;
use super::identity::RunIdentity;
use super::lock::host;
use super::{Loaded, schema, unix_ms};
use crate::comm::WorkerProcess;
use crate::core::Deaths;

/// What earlier epochs have left.
#[derive(Debug, Default)]
pub(crate) struct Past {
    /// The key of each node that may have been given out, by epoch and number.
    pub(crate) keys: HashMap<(u64, u64), NodeKey>,
    /// The workers that died while they executed a node, where any did.
    pub(crate) deaths: HashMap<NodeKey, Deaths>,
    /// Where the last one listened.
    pub(crate) listen: Option<SocketAddr>,
    /// The process ids of those that were started as local workers of this machine; most of them are gone.
    pub(crate) local_workers: Vec<u32>,
    /// The workers that were connected when their coordinator died, and may still be there.
    pub(crate) workers: Vec<WorkerProcess>,
    /// How many nodes have a result.
    pub(crate) results: usize,
}

/// How long a worker tries to reach its coordinator by default; the longest of them is remote.
const LONGEST_WAIT_MS: i64 = 10 * 60 * 1000;

/// Begin a new journal.
pub(super) fn begin(path: &Path, identity: &RunIdentity, run: RunName) -> Result<(Connection, Loaded), JournalError> {
    let connection = schema::create(path, |connection| {
        connection.execute(
            "INSERT INTO run (id, name, identity, started_ms) VALUES (1, ?1, ?2, ?3)",
            params![run.0, identity.to_json(), unix_ms()],
        )?;
        add_epoch(connection, 1)
    })?;
    Ok((connection, Loaded { run, epoch: 1, results: HashMap::new(), past: Past::default() }))
}

/// Go on with the run of a journal.
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
    // The run is under way again.
    let reopened = connection.execute("UPDATE run SET finished_ms = NULL, outputs = NULL", []);
    reopened.map_err(|source| JournalError::writing(path, source))?;
    Ok((connection, Loaded { run, epoch, results, past }))
}

/// That the run of a journal is one of these inputs and settings.
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
        "SELECT id >> 32, id & 0xffffffff, key, deaths, deaths_alone, deaths_excused FROM nodes WHERE key IS NOT NULL",
    )?;
    let mut rows = statement.query([])?;
    while let Some(row) = rows.next()? {
        let (epoch, node, key): (u64, u64, _) = (row.get(0)?, row.get(1)?, NodeKey(row.get(2)?));
        let deaths = Deaths { in_company: row.get(3)?, alone: row.get(4)?, excused: row.get(5)? };
        past.keys.insert((epoch, node), key);
        // Each epoch counts on from the one before.
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
    // Elsewhere the same numbers are those of other processes.
    let mut statement = connection.prepare(
        "SELECT DISTINCT local_workers.process FROM local_workers JOIN epochs USING (epoch) WHERE host = ?1 ORDER BY 1",
    )?;
    past.local_workers = statement.query_map([host()], |row| row.get(0))?.collect::<rusqlite::Result<_>>()?;
    // An epoch that ended in order has told its workers to end.
    let mut statement = connection.prepare(
        "SELECT DISTINCT workers.process, name, local FROM workers JOIN epochs USING (epoch)
         WHERE ended_ms IS NULL AND left_ms IS NULL AND seen_ms > ?1 ORDER BY 1",
    )?;
    let since = unix_ms() - LONGEST_WAIT_MS;
    let worker =
        |row: &Row<'_>| Ok(WorkerProcess { id: row.get(0)?, name: ProcessName(row.get(1)?), is_local: row.get(2)? });
    past.workers = statement.query_map([since], worker)?.collect::<rusqlite::Result<_>>()?;
    Ok(past)
}
