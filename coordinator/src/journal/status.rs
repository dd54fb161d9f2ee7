//! The state of a run, as `lookalike status` shows it and `OUT/status.json` holds it. docs/journal.md documents its JSON.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::Path;
use std::time::{Duration, SystemTime};

use rusqlite::{Connection, OpenFlags, OptionalExtension};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::error::JournalError;
use super::lock::RunLock;
use super::names::Names;
use super::options::JOURNAL_FILE;
use super::parts::{self, PartStatus};
use super::schema::node_id;
use super::{place, schema};
use crate::atomic;

/// The status file beside the journal. It is read where other processes cannot read the journal.
pub const STATUS_FILE: &str = "status.json";

/// The schema of the JSON.
const SCHEMA: &str = "lookalike.status/1";

/// The most failures that are listed.
const MOST_FAILURES: usize = 100;

/// How long to wait if the writer has locked the journal.
const BUSY_TIME: Duration = Duration::from_secs(1);

/// The state of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum RunState {
    /// A coordinator is running.
    Running,
    /// No coordinator is running, and the run is not finished: `--resume` resumes it.
    Stopped,
    /// Every part has ended, and some of them failed: `--resume` retries those.
    Ended,
    /// All results are written.
    Finished,
}

/// The status of a run. Its JSON has the [`Names`] of a program: see [`Status::to_json`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Status {
    /// Always `lookalike.status/1`.
    pub schema: String,
    /// The state of the run.
    pub state: RunState,
    /// Why it stopped or ended before it was finished.
    pub error: Option<String>,
    /// The name of the run, 32 hexadecimal digits.
    pub run: String,
    /// The number of its coordinator processes so far.
    pub epoch: u64,
    /// The process id of the last one.
    pub process: u32,
    /// The machine of that process.
    pub host: String,
    /// When the run began.
    pub started_at: String,
    /// When a coordinator last wrote to the journal.
    pub updated_at: String,
    /// When the results were written, or the last part ended.
    pub finished_at: Option<String>,
    /// The total time for which its coordinators ran, in seconds.
    pub elapsed_s: f64,
    /// Nodes of all kinds.
    pub nodes: Counts,
    /// Nodes by kind, in the order in which the kinds were planned.
    pub kinds: Vec<KindCounts>,
    /// The workers that are connected, by number.
    pub workers: Vec<WorkerStatus>,
    /// How many leases were given out in all epochs, plus how often nodes ran in a coordinator.
    pub attempts: u64,
    /// How many attempts were lost with their workers.
    pub requeued: u64,
    /// The best score so far.
    pub best_score: Option<f64>,
    /// The nodes that failed in the last epoch, at most 100.
    pub failures: Vec<NodeError>,
    /// The parts of a run of many, in their order.
    #[serde(default, rename = "part_list", skip_serializing_if = "Vec::is_empty")]
    pub parts: Vec<PartStatus>,
}

/// The number of nodes in each state.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counts {
    /// All.
    pub total: u64,
    /// Nodes whose inputs are not complete.
    pub waiting: u64,
    /// Nodes that may run.
    pub ready: u64,
    /// Nodes that are running.
    pub running: u64,
    /// Nodes that have an output, from any epoch.
    pub completed: u64,
    /// Completed nodes whose output is from an earlier epoch.
    pub recalled: u64,
    /// Nodes that failed.
    pub failed: u64,
}

/// The nodes of one kind.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct KindCounts {
    /// The kind.
    pub kind: String,
    /// Its nodes.
    #[serde(flatten)]
    pub counts: Counts,
}

/// A worker that is connected.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct WorkerStatus {
    /// Its number in this epoch.
    pub worker: u64,
    /// Its process id on its machine.
    pub process: u32,
    /// How many nodes it executes at a time.
    pub threads: u64,
    /// How many leases it holds.
    pub leases: u64,
    /// How many nodes it has finished.
    pub finished: u64,
}

/// A node that failed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct NodeError {
    /// Its kind.
    pub kind: String,
    /// Its label.
    pub label: String,
    /// The error.
    pub error: String,
}

/// Why the status of a run cannot be read.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum StatusError {
    /// There is no run.
    #[error("expected a run in {folder}, found no {JOURNAL_FILE}; give the folder of a run's results (its --out)")]
    NoRun {
        /// The folder.
        folder: String,
    },
    /// The journal cannot be read.
    #[error(transparent)]
    Journal(#[from] JournalError),
    /// The status file cannot be read.
    #[error("cannot read {path}")]
    File {
        /// The file.
        path: String,
        /// The error of the system.
        source: io::Error,
    },
    /// The status file was not written by this program.
    #[error("{path} is not a status of a run")]
    Content {
        /// The file.
        path: String,
        /// The error.
        source: serde_json::Error,
    },
}

/// The status file cannot be written.
#[derive(Debug, Error)]
pub(super) enum WriteError {
    /// The journal cannot be read.
    #[error("cannot read the journal")]
    Journal(#[from] rusqlite::Error),
    /// The status cannot be encoded.
    #[error("cannot encode the status")]
    Encode(#[from] serde_json::Error),
    /// The file cannot be written.
    #[error("cannot write {STATUS_FILE}")]
    File(#[from] io::Error),
}

impl Status {
    /// Read the status of the run in a folder, from its journal or, where other processes cannot read that, from its status file.
    ///
    /// # Errors
    /// When there is no run, or its files cannot be read.
    pub fn of(folder: &Path, names: Names) -> Result<Self, StatusError> {
        let journal = folder.join(JOURNAL_FILE);
        let file = folder.join(STATUS_FILE);
        let is_running = RunLock::is_held(folder);
        let mut status = if !journal.exists() {
            return Err(StatusError::NoRun { folder: folder.display().to_string() });
        } else if place::is_shared(folder) && file.exists() {
            read_file(&file, names)?
        } else {
            match read_journal(&journal) {
                // The journal is locked, or the folder cannot be written to.
                Err(JournalError::Busy { .. } | JournalError::Open { .. }) if file.exists() => read_file(&file, names)?,
                read => read?,
            }
        };
        status.settle(is_running);
        Ok(status)
    }

    /// The status as JSON with these names.
    ///
    /// # Errors
    /// Those of the encoder.
    pub fn to_json(&self, names: Names) -> serde_json::Result<String> {
        let status = names.give(serde_json::to_value(self)?);
        Ok(serde_json::to_string_pretty(&status)? + "\n")
    }

    /// Parse the JSON of a status with these names.
    ///
    /// # Errors
    /// When it is not the JSON of a status.
    pub fn from_json(text: &[u8], names: Names) -> serde_json::Result<Self> {
        serde_json::from_value(names.restore(serde_json::from_slice(text)?))
    }

    /// Correct the state: the writer of a status cannot know whether it is still running when the status is read.
    fn settle(&mut self, is_running: Option<bool>) {
        if matches!(self.state, RunState::Finished | RunState::Ended) {
            return;
        }
        // If the lock cannot be tested, the state stays as written.
        match is_running {
            Some(true) => {
                self.state = RunState::Running;
                let seen = humantime::parse_rfc3339(&self.updated_at).ok();
                let since = seen.and_then(|seen| SystemTime::now().duration_since(seen).ok());
                self.elapsed_s += since.unwrap_or_default().as_secs_f64();
                self.error = None;
            }
            Some(false) => {
                self.state = RunState::Stopped;
                self.error.get_or_insert_with(|| "its coordinator was killed, or its machine stopped".into());
                self.workers.clear();
                let open = self.parts.iter_mut().filter(|part| matches!(part.state.as_str(), "waiting" | "running"));
                open.for_each(|part| part.state = "stopped".into());
            }
            None => {}
        }
    }
}

fn read_file(path: &Path, names: Names) -> Result<Status, StatusError> {
    let shown = || path.display().to_string();
    let text = fs::read(path).map_err(|source| StatusError::File { path: shown(), source })?;
    Status::from_json(&text, names).map_err(|source| StatusError::Content { path: shown(), source })
}

fn read_journal(path: &Path) -> Result<Status, JournalError> {
    let reading = |source| JournalError::reading(path, source);
    let connection = Connection::open_with_flags(path, OpenFlags::SQLITE_OPEN_READ_ONLY).map_err(reading)?;
    connection.busy_timeout(BUSY_TIME).map_err(reading)?;
    schema::check_format(path, &connection)?;
    // One transaction, so that all tables are read at the same moment.
    let read = || -> rusqlite::Result<Status> {
        let transaction = connection.unchecked_transaction()?;
        read(&transaction)
    };
    read().map_err(reading)
}

/// Write the status file of a journal, atomically.
pub(super) fn write(connection: &Connection, journal: &Path, names: Names) -> Result<(), WriteError> {
    let text = read(connection)?.to_json(names)?;
    Ok(atomic::write_unsynced(&journal.with_file_name(STATUS_FILE), text.as_bytes())?)
}

/// Read the status from a journal.
fn read(connection: &Connection) -> rusqlite::Result<Status> {
    let sql = "SELECT lower(hex(name)), started_ms, finished_ms, outputs IS NOT NULL FROM run";
    let (run, started, finished, is_whole): (String, i64, Option<i64>, bool) =
        connection.query_row(sql, [], |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?, row.get(3)?)))?;
    let sql = "SELECT epoch, process, host, seen_ms, ended, ended_ms FROM epochs ORDER BY epoch DESC LIMIT 1";
    let (epoch, process, host, seen, ended, ended_ms) = connection.query_row(sql, [], |row| {
        let ended: (Option<String>, Option<i64>) = (row.get(4)?, row.get(5)?);
        Ok((row.get(0)?, row.get(1)?, row.get(2)?, row.get(3)?, ended.0, ended.1))
    })?;
    let elapsed: f64 =
        connection.query_row("SELECT sum(seen_ms - started_ms) / 1000.0 FROM epochs", [], |r| r.get(0))?;
    let sql = "SELECT best_score FROM epochs WHERE best_score IS NOT NULL ORDER BY epoch DESC LIMIT 1";
    let best_score = connection.query_row(sql, [], |row| row.get(0)).optional()?;
    let sql = "SELECT count(*), count(*) FILTER (WHERE outcome = 2) FROM attempts";
    let (attempts, requeued) = connection.query_row(sql, [], |row| Ok((row.get(0)?, row.get(1)?)))?;
    let kinds = kinds(connection, epoch)?;
    let mut nodes = Counts::default();
    kinds.iter().for_each(|kind| nodes.add(kind.counts));
    Ok(Status {
        schema: SCHEMA.to_owned(),
        state: match (finished, ended_ms) {
            (Some(_), _) if is_whole => RunState::Finished,
            (Some(_), _) => RunState::Ended,
            (None, Some(_)) if ended.is_some() => RunState::Stopped,
            _ => RunState::Running,
        },
        error: ended,
        run,
        epoch,
        process,
        host,
        started_at: rfc3339(started),
        updated_at: rfc3339(seen),
        finished_at: finished.map(rfc3339),
        elapsed_s: elapsed,
        nodes,
        kinds,
        workers: workers(connection, epoch)?,
        attempts,
        requeued,
        best_score,
        failures: failures(connection, epoch)?,
        parts: parts::read(connection)?,
    })
}

/// Count nodes by kind and state. Results are counted too, because the state of a completed node is written a little later than
/// its result.
fn kinds(connection: &Connection, epoch: u64) -> rusqlite::Result<Vec<KindCounts>> {
    let sql = "SELECT kind, iif(state IN (1, 2) AND done.key IS NOT NULL, 3, state) AS now, count(*), min(id)
               FROM nodes LEFT JOIN (SELECT DISTINCT key FROM results WHERE epoch = ?1) AS done ON done.key = nodes.key
               WHERE id >= ?2 GROUP BY kind, now ORDER BY min(id)";
    let mut kinds: Vec<KindCounts> = Vec::new();
    let mut statement = connection.prepare_cached(sql)?;
    let mut rows = statement.query([epoch, node_id(epoch, 0)])?;
    while let Some(row) = rows.next()? {
        let (kind, state, count): (String, u8, u64) = (row.get(0)?, row.get(1)?, row.get(2)?);
        let place = kinds.iter().position(|known| known.kind == kind).unwrap_or_else(|| {
            kinds.push(KindCounts { kind, counts: Counts::default() });
            kinds.len() - 1
        });
        kinds[place].counts.add(Counts::of(state, count));
    }
    Ok(kinds)
}

fn workers(connection: &Connection, epoch: u64) -> rusqlite::Result<Vec<WorkerStatus>> {
    let sql = "SELECT worker, count(*) FILTER (WHERE outcome IS NULL), count(*) FILTER (WHERE outcome = 0)
               FROM attempts WHERE epoch = ?1 GROUP BY worker";
    let mut statement = connection.prepare_cached(sql)?;
    let counts = statement.query_map([epoch], |row| Ok((row.get(0)?, (row.get(1)?, row.get(2)?))))?;
    let counts = counts.collect::<rusqlite::Result<BTreeMap<u64, (u64, u64)>>>()?;
    let sql = "SELECT worker, process, threads FROM workers WHERE epoch = ?1 AND left_ms IS NULL ORDER BY worker";
    let mut statement = connection.prepare_cached(sql)?;
    let rows = statement.query_map([epoch], |row| {
        let worker = row.get(0)?;
        let (leases, finished) = counts.get(&worker).copied().unwrap_or_default();
        Ok(WorkerStatus { worker, process: row.get(1)?, threads: row.get(2)?, leases, finished })
    })?;
    rows.collect()
}

fn failures(connection: &Connection, epoch: u64) -> rusqlite::Result<Vec<NodeError>> {
    let sql = format!(
        "SELECT kind, label, ifnull(error, '') FROM nodes WHERE id >= ?1 AND state = 5 ORDER BY id LIMIT {MOST_FAILURES}"
    );
    let mut statement = connection.prepare_cached(&sql)?;
    let rows = statement.query_map([node_id(epoch, 0)], |row| {
        Ok(NodeError { kind: row.get(0)?, label: row.get(1)?, error: row.get(2)? })
    })?;
    rows.collect()
}

impl Counts {
    /// This count in the state with this number in the table.
    fn of(state: u8, count: u64) -> Self {
        let mut counts = Self { total: count, ..Self::default() };
        match state {
            0 => counts.waiting = count,
            1 => counts.ready = count,
            2 => counts.running = count,
            3 => counts.completed = count,
            4 => (counts.completed, counts.recalled) = (count, count),
            _ => counts.failed = count,
        }
        counts
    }

    fn add(&mut self, other: Self) {
        self.total += other.total;
        self.waiting += other.waiting;
        self.ready += other.ready;
        self.running += other.running;
        self.completed += other.completed;
        self.recalled += other.recalled;
        self.failed += other.failed;
    }
}

/// The last millisecond of the year 9999, counted from 1970.
const LAST_MS: u64 = 253_402_300_799_999;

fn rfc3339(unix_ms: i64) -> String {
    // A damaged journal may hold any time, but years after 9999 cannot be formatted.
    let since = Duration::from_millis(u64::try_from(unix_ms).unwrap_or(0).min(LAST_MS));
    humantime::format_rfc3339_millis(SystemTime::UNIX_EPOCH + since).to_string()
}
