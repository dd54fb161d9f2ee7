//! The thread that writes the journal: one transaction per batch, in order of arrival.

use std::collections::HashMap;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender};
use std::time::{Duration, Instant};

use lookalike::graph::{Blob, BlobHash, NodeKey};
use lookalike_worker::with_causes;
use rusqlite::{Connection, Transaction, params};
use tokio::sync::mpsc::UnboundedSender;
use tracing::warn;

use super::batch::{Batch, NodeRow};
use super::deferred::{Deferred, ms};
use super::error::JournalError;
use super::options::JournalOptions;
use super::parts;
use super::schema::node_id;
use super::status;
use super::time::unix_ms;
use crate::state::Deaths;

/// The shortest time between two versions of `status.json`.
const STATUS_INTERVAL: Duration = Duration::from_secs(1);

/// The time between two versions of `status.json` when nothing happens.
const QUIET_INTERVAL: Duration = Duration::from_secs(20);

/// Counting all nodes may take at most one part in this many of the thread's time.
const STATUS_SHARE: u32 = 20;

/// Commands for the thread.
#[derive(Debug)]
pub(super) enum Command {
    /// Write a batch, then report that it is written.
    Commit(Box<Batch>),
    /// Write a batch that can wait.
    Note(Box<Batch>),
    /// Read the output of a node.
    Read(NodeKey, SyncSender<Option<Blob>>),
    /// Answer once all earlier commands are executed.
    Wait(SyncSender<()>),
    /// Write how this epoch ended, and end the thread.
    Close(Option<String>),
    /// End at once, as if the process were killed.
    Die,
}

pub(super) struct Writer {
    pub(super) connection: Connection,
    pub(super) options: JournalOptions,
    pub(super) epoch: u64,
    /// The rows of results, by key.
    pub(super) results: HashMap<NodeKey, i64>,
    pub(super) commands: Receiver<Command>,
    pub(super) committed: UnboundedSender<Result<(), JournalError>>,
    pub(super) deferred: Deferred,
    /// When `status.json` may be written next.
    pub(super) next_status: Instant,
    /// Whether anything has changed since it was written.
    pub(super) is_news: bool,
}

impl Writer {
    /// Process commands until one ends the thread.
    pub(super) fn run(mut self) -> Result<(), JournalError> {
        loop {
            let soon = self.next_status.saturating_duration_since(Instant::now());
            match self.commands.recv_timeout(if self.is_news { soon } else { QUIET_INTERVAL }) {
                Ok(Command::Commit(batch)) => {
                    let outcome = self.commit(&batch);
                    self.is_news = true;
                    // An error means that the run is over.
                    let _ = self.committed.send(outcome);
                }
                Ok(Command::Note(batch)) => {
                    self.deferred.take(&batch);
                    self.is_news = true;
                }
                Ok(Command::Read(key, answer)) => _ = answer.send(self.read(key)),
                Ok(Command::Wait(done)) => _ = done.send(()),
                Ok(Command::Die) => return Ok(()),
                Ok(Command::Close(ended)) => return self.close(ended.as_deref()),
                // `Journal` sends `Close` or `Die` before its sender is gone.
                Err(RecvTimeoutError::Disconnected) => return Ok(()),
                // Nothing has happened, but the coordinator is alive.
                Err(RecvTimeoutError::Timeout) => self.is_news = true,
            }
            if self.is_news && Instant::now() >= self.next_status {
                self.tell_status();
            }
        }
    }

    fn commit(&mut self, batch: &Batch) -> Result<(), JournalError> {
        self.deferred.take(batch);
        let is_much = self.deferred.is_much();
        if !is_much && !batch.is_urgent() {
            return Ok(());
        }
        let mut new = Vec::new();
        let parts = self.options.parts.take();
        let outcome = self.connection.transaction().and_then(|transaction| {
            parts::write(&transaction, &parts)?;
            new = write(&transaction, self.epoch, batch, &self.results)?;
            let rows = if is_much { Some(self.deferred.write(&transaction)?) } else { None };
            transaction.commit()?;
            Ok(rows)
        });
        let outcome = outcome.map(|rows| rows.into_iter().for_each(|rows| self.deferred.written(rows)));
        let outcome = match batch.listen {
            Some(_) => outcome.and_then(|()| self.reach_the_disk()),
            None => outcome,
        };
        if let Err(source) = outcome {
            self.options.parts.put_back(parts);
            return Err(JournalError::writing(&self.options.path, source));
        }
        self.results.extend(new);
        // If a node is added again after its output was released, it runs again, and its output must be written again.
        for key in batch.forgotten.iter().chain(&batch.released) {
            self.results.remove(key);
        }
        Ok(())
    }

    /// Wait until everything written so far is on the disk. Called once per epoch, before its first lease. Otherwise a power loss
    /// could remove the epoch's number from the end of the log, and the next epoch would reuse it. A worker of the lost epoch
    /// would then mistake the next coordinator for its own, and answer for other nodes with the same numbers.
    fn reach_the_disk(&self) -> rusqlite::Result<()> {
        // Pages that readers still need also stay in the log, which is synchronised first.
        self.connection.query_row("PRAGMA wal_checkpoint(PASSIVE)", [], |_| Ok(()))
    }

    /// Read the output of a node. A damaged one is dropped, and the node runs again.
    fn read(&mut self, key: NodeKey) -> Option<Blob> {
        let id = *self.results.get(&key)?;
        let read = || -> rusqlite::Result<(BlobHash, Option<Vec<u8>>)> {
            let mut statement = self.connection.prepare_cached("SELECT hash, bytes FROM results WHERE id = ?1")?;
            statement.query_row([id], |row| Ok((BlobHash(row.get(0)?), row.get(1)?)))
        };
        let fault = match read() {
            Ok((_, None)) => return None,
            Ok((hash, Some(bytes))) => match Blob::verified(hash, bytes) {
                Ok(blob) => return Some(blob),
                Err(fault) => fault.to_string(),
            },
            Err(error) => error.to_string(),
        };
        warn!(journal = %self.options.path.display(), ?key, fault, "a result in the journal is damaged: its node runs again");
        self.results.remove(&key);
        // If the row cannot be removed, it will be found damaged again.
        let _ = self.connection.execute("DELETE FROM results WHERE id = ?1", [id]);
        None
    }

    fn close(mut self, ended: Option<&str>) -> Result<(), JournalError> {
        self.write_deferred();
        let write = || -> rusqlite::Result<()> {
            self.connection.execute(
                "UPDATE epochs SET ended_ms = ?2, seen_ms = ?2, ended = ?3 WHERE epoch = ?1",
                params![self.epoch, unix_ms(), ended],
            )?;
            Ok(())
        };
        let written = write().map_err(|source| JournalError::writing(&self.options.path, source));
        self.tell_status();
        // Leave a single file, which can be read from anywhere. If a reader prevents this now, no harm is done.
        let _ = self.connection.pragma_update(None, "journal_mode", "DELETE");
        written
    }

    /// Write the deferred rows.
    fn write_deferred(&mut self) {
        let parts = self.options.parts.take();
        let outcome = self.connection.transaction().and_then(|transaction| {
            parts::write(&transaction, &parts)?;
            let rows = self.deferred.write(&transaction)?;
            transaction.commit()?;
            Ok(rows)
        });
        match outcome {
            Ok(rows) => self.deferred.written(rows),
            Err(error) => {
                self.options.parts.put_back(parts);
                warn!(%error, "cannot write attempts and states to the journal");
            }
        }
    }

    /// Write `status.json`. Errors are only logged: if the disk is full, a commit will stop the run.
    fn tell_status(&mut self) {
        let began = Instant::now();
        self.write_deferred();
        let best = self.options.score.as_ref().and_then(|score| score());
        let seen = self.connection.execute(
            "UPDATE epochs SET seen_ms = ?2, best_score = ?3 WHERE epoch = ?1",
            params![self.epoch, unix_ms(), best],
        );
        if let Err(error) = seen {
            warn!(%error, "cannot write the time to the journal");
        }
        if let Err(error) = status::write(&self.connection, &self.options.path, self.options.names) {
            warn!(error = with_causes(&error), "the status of the run is out of date");
        }
        self.is_news = false;
        self.next_status = Instant::now() + STATUS_INTERVAL.max(began.elapsed() * STATUS_SHARE);
    }
}

/// Write the rows of a batch. Returns the keys of new results, with their rows.
fn write(
    transaction: &Transaction<'_>,
    epoch: u64,
    batch: &Batch,
    known: &HashMap<NodeKey, i64>,
) -> rusqlite::Result<Vec<(NodeKey, i64)>> {
    for (node, row) in &batch.nodes {
        write_node(transaction, node_id(epoch, *node), row)?;
    }
    let mut new = Vec::new();
    let mut insert =
        transaction.prepare_cached("INSERT INTO results (epoch, key, hash, bytes) VALUES (?1, ?2, ?3, ?4)")?;
    for (key, output) in &batch.results {
        if !known.contains_key(key) {
            new.push((*key, insert.insert(params![epoch, key.0, output.hash().0, &output[..]])?));
        }
    }
    let row_of = |key: &NodeKey| new.iter().rev().find(|(other, _)| other == key).map(|(_, id)| *id);
    let rows = |key: &NodeKey| known.get(key).copied().or_else(|| row_of(key));
    for id in batch.released.iter().filter_map(rows) {
        transaction.prepare_cached("UPDATE results SET bytes = NULL WHERE id = ?1")?.execute([id])?;
    }
    for id in batch.forgotten.iter().filter_map(rows) {
        transaction.prepare_cached("DELETE FROM results WHERE id = ?1")?.execute([id])?;
    }
    write_workers(transaction, epoch, batch)?;
    Ok(new)
}

fn write_node(transaction: &Transaction<'_>, id: u64, row: &NodeRow) -> rusqlite::Result<()> {
    let NodeRow { added, state, attempts, deaths, key, error } = row;
    let Deaths { in_company, alone, not_counted } = deaths;
    let (state, key) = (*state as u8, key.as_ref().map(|key| key.0));
    match added {
        Some((kind, label)) => transaction
            .prepare_cached(
                "INSERT INTO nodes
                     (id, kind, label, state, attempts, deaths, deaths_alone, deaths_not_counted, key, error)
                 VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10)",
            )?
            .execute(params![id, kind, label, state, attempts, in_company, alone, not_counted, key, error])?,
        None => transaction
            .prepare_cached(
                "UPDATE nodes SET state = ?2, attempts = ?3, deaths = ?4, deaths_alone = ?5, deaths_not_counted = ?6, key = ?7,
                     error = ?8
                 WHERE id = ?1",
            )?
            .execute(params![id, state, attempts, in_company, alone, not_counted, key, error])?,
    };
    Ok(())
}

fn write_workers(transaction: &Transaction<'_>, epoch: u64, batch: &Batch) -> rusqlite::Result<()> {
    for row in &batch.workers {
        transaction
            .prepare_cached(
                "INSERT INTO workers (epoch, worker, process, threads, joined_ms) VALUES (?1, ?2, ?3, ?4, ?5)",
            )?
            .execute(params![epoch, row.worker, row.process, row.threads, ms(row.at)])?;
    }
    for row in &batch.left {
        transaction
            .prepare_cached("UPDATE workers SET left_ms = ?3, why = ?4 WHERE epoch = ?1 AND worker = ?2")?
            .execute(params![epoch, row.worker, ms(row.at), row.why])?;
    }
    if let Some(listen) = &batch.listen {
        transaction.execute("UPDATE epochs SET listen = ?2 WHERE epoch = ?1", params![epoch, listen])?;
    }
    Ok(())
}
