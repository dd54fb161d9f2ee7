//! The journal of a run in SQLite, at `OUT/run.sqlite`: nodes, attempts, workers, results.
//!
//! ```text
//!   reactor --actions of a group of events--> Batch --one transaction--> thread "journal" --committed--> the actions are done
//! ```
//! A worker's answer is acknowledged, and the next node given out, only after the transaction that records it is committed. So no
//! acknowledged answer is lost, however the coordinator ends. Each process that coordinates a run is an *epoch* of it, counted
//! from 1. Planners are pure, so a later epoch plans anew from the same inputs. Nodes whose [`NodeKey`] has a result are
//! completed from the journal, even if their numbers have changed; the other nodes run.
//!
//! The tables are in `schema.rs`, and explained in `docs/journal.md`:
//!
//! | table | one row per |
//! |---|---|
//! | `run` | the run: name, inputs and settings, when it began, what it wrote when it was finished |
//! | `epochs` | coordinator process: host, when it began and was last seen, how it ended, where it listened |
//! | `nodes` | node of an epoch: kind, label, state, attempts, deaths of workers, key, error |
//! | `attempts` | lease that was given out: worker, when, how it ended |
//! | `workers` | connection of a worker |
//! | `results` | node key: the hash and the bytes of its output |
//! | `parts` | part of a run of many planners: its state, what it wrote |
//!
//! Rows that nothing depends on are written about once a second: see `deferred.rs`.
//!
//! Keys and hashes have no index: they are random, so each insertion into an index would write another page. A resuming
//! coordinator reads all keys once. The journal does not contain the access file's secret. Still, only its owner can read it.
//!
//! On a network file system this process locks the journal for itself, and other processes read `status.json`.

mod batch;
mod deferred;
mod disk;
mod error;
mod finish;
mod identity;
mod lock;
mod names;
mod options;
mod parts;
mod past;
mod place;
mod schema;
pub mod status;
mod time;
mod writer;

use std::collections::{HashMap, HashSet};
use std::path::PathBuf;
use std::sync::mpsc::{Sender, channel, sync_channel};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use lookalike::graph::NodeKey;
use lookalike::protocol::RunName;
use tokio::sync::mpsc::{UnboundedReceiver, unbounded_channel};

pub(crate) use self::batch::Batch;
use self::deferred::Deferred;
use self::disk::Disk;
pub use self::error::JournalError;
pub use self::finish::{Finished, finish, finished, settle};
pub use self::identity::{Difference, RunIdentity};
pub use self::lock::{LOCK_FILE, LockError, RunLock};
pub use self::names::Names;
pub use self::options::{JOURNAL_FILE, JournalOptions, Score};
pub use self::parts::{PartLedger, PartRow, PartStatus, written};
use self::past::{Loaded, Past};
pub use self::schema::{all_files, remove};
use self::writer::{Command, Writer};
use crate::state::Deaths;
use crate::state::past_outputs::{Memory, PastOutputs};

/// The journal of a run that this process coordinates.
#[derive(Debug)]
pub(crate) struct Journal {
    path: PathBuf,
    /// The name of the run: the same for all its epochs.
    pub(crate) run: RunName,
    /// The number of this process among those of the run, from 1.
    pub(crate) epoch: u64,
    /// The data of earlier epochs.
    pub(crate) past: Past,
    /// The keys for which an earlier epoch has a result.
    known: HashSet<NodeKey>,
    commands: Sender<Command>,
    committed: UnboundedReceiver<Result<(), JournalError>>,
    disk: Option<Disk>,
    thread: Option<JoinHandle<Result<(), JournalError>>>,
}

impl Journal {
    /// Begin a run, or resume the one in the file. `disk_time` is that of the [world](lookalike_worker::world::World).
    pub(crate) fn open(
        options: &JournalOptions,
        name: RunName,
        disk_time: Option<Duration>,
    ) -> Result<Self, JournalError> {
        let path = options.path.clone();
        if path.exists() && !options.resume {
            return Err(JournalError::Exists { path });
        }
        let (connection, loaded) = if path.exists() {
            past::load(&path, &options.identity)?
        } else {
            past::begin(&path, &options.identity, options.names, name)?
        };
        let (commands, asked) = channel();
        let (sender, committed) = unbounded_channel();
        let known = loaded.results.keys().copied().collect();
        let writer = Writer {
            connection,
            options: options.clone(),
            epoch: loaded.epoch,
            results: loaded.results,
            commands: asked,
            committed: sender,
            deferred: Deferred::new(loaded.epoch),
            next_status: Instant::now(),
            is_news: true,
        };
        let thread = thread::Builder::new().name("journal".into()).spawn(move || writer.run());
        let thread = thread.map_err(|source| JournalError::Create { path: path.clone(), source })?;
        let Loaded { run, epoch, past, .. } = loaded;
        let disk = disk_time.map(Disk::new);
        Ok(Self { path, run, epoch, past, known, commands, committed, disk, thread: Some(thread) })
    }

    /// The source from which the reactor gets outputs of earlier epochs.
    pub(crate) fn past_outputs(&self) -> Box<dyn PastOutputs> {
        let deaths = self.past.deaths.clone();
        Box::new(JournalledOutputs { known: self.known.clone(), deaths, commands: self.commands.clone() })
    }

    /// Write a batch, after earlier ones. [`Self::committed`] returns when it is written.
    pub(crate) fn commit(&mut self, batch: Batch) {
        // If the thread has ended, `committed` reports it.
        let _ = self.commands.send(Command::Commit(Box::new(batch)));
        self.disk.iter_mut().for_each(|disk| disk.wait(&self.commands));
    }

    /// Wait until the next batch is written.
    pub(crate) async fn committed(&mut self) -> Result<(), JournalError> {
        if let Some(disk) = &mut self.disk {
            disk.told().await;
        }
        let gone = || JournalError::Thread { path: self.path.clone() };
        self.committed.recv().await.unwrap_or_else(|| Err(gone()))
    }

    /// Write a batch that is not [urgent](Batch::is_urgent), with later rows.
    pub(crate) fn note(&mut self, batch: Batch) {
        // If the thread has ended, `committed` reports it.
        let _ = self.commands.send(Command::Note(Box::new(batch)));
    }

    /// Write all batches, then how this epoch ended: `None` when every node is closed as the planner wants it.
    pub(crate) fn close(mut self, ended: Option<String>) -> Result<(), JournalError> {
        let _ = self.commands.send(Command::Close(ended));
        let thread = self.thread.take().map(JoinHandle::join);
        match thread {
            Some(Err(_)) => Err(JournalError::Thread { path: self.path.clone() }),
            Some(Ok(closed)) => closed,
            None => Ok(()),
        }
    }

    /// Remove the journal of a run that could not begin.
    pub(crate) fn discard(self) {
        let path = self.path.clone();
        let _ = self.close(None);
        // If it cannot be removed, the next attempt will report an existing run.
        let _ = remove(&path);
    }
}

/// Dropping without [`Journal::close`] waits for the thread too, so that the next process finds no writer. In a simulated world it
/// means that the process was killed, and nothing more is written.
impl Drop for Journal {
    fn drop(&mut self) {
        let Some(thread) = self.thread.take() else { return };
        let last = match &self.disk {
            Some(_) => Command::Die,
            None => Command::Close(Some("it was dropped".into())),
        };
        let _ = self.commands.send(last);
        let _ = thread.join();
    }
}

/// Answers the reactor's questions from the journal.
#[derive(Debug)]
struct JournalledOutputs {
    known: HashSet<NodeKey>,
    deaths: HashMap<NodeKey, Deaths>,
    commands: Sender<Command>,
}

impl PastOutputs for JournalledOutputs {
    fn of(&mut self, key: NodeKey) -> Memory {
        let deaths = self.deaths.get(&key).copied().unwrap_or_default();
        let is_known = self.known.contains(&key);
        let read = || {
            let (sender, answer) = sync_channel(1);
            self.commands.send(Command::Read(key, sender)).ok()?;
            answer.recv().ok()?
        };
        Memory { output: if is_known { read() } else { None }, deaths }
    }
}

#[cfg(test)]
mod tests;
