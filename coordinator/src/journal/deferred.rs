//! Rows that are written about once a second: attempts, and nodes that start or complete. Only users read them, most of them change
//! again before they are written, and a transaction over fewer tables is cheaper. Resuming does not need them: that a node is completed
//! follows from its result.

use std::collections::BTreeMap;
use std::time::Duration;

use rusqlite::{Connection, params};

use super::batch::{AttemptChange, Batch, Outcome, State};
use super::schema::node_id;

/// The most rows that may wait. If there are more, they are written with the next batch.
const MOST_ROWS: usize = 4096;

/// The waiting rows of one epoch.
#[derive(Debug)]
pub(super) struct Deferred {
    epoch: u64,
    /// Open attempts, by node and worker: a worker has at most one attempt of a node.
    open: BTreeMap<(u64, u64), Attempt>,
    ended: Vec<((u64, u64), Attempt, Outcome, Duration)>,
    /// State and number of attempts, by node.
    states: BTreeMap<u64, (State, u32)>,
}

/// The table's rows of newly written open attempts, by node and worker.
pub(super) type Rows = Vec<((u64, u64), i64)>;

#[derive(Clone, Copy, Debug)]
struct Attempt {
    attempt: u32,
    begun: Duration,
    /// Its row in the table, if it has been written as open.
    row: Option<i64>,
}

impl Deferred {
    pub(super) fn new(epoch: u64) -> Self {
        Self { epoch, open: BTreeMap::new(), ended: Vec::new(), states: BTreeMap::new() }
    }

    /// Take those rows of a batch that can wait. The other rows are written at once.
    pub(super) fn take(&mut self, batch: &Batch) {
        for (node, row) in &batch.nodes {
            // A node that is written as ready may have started since.
            if row.state != State::Ready {
                self.states.remove(node);
            }
        }
        for node in &batch.stopped {
            self.states.remove(node);
        }
        for (node, attempts) in &batch.started {
            self.states.insert(*node, (State::Running, *attempts));
        }
        for (node, attempts) in &batch.finished {
            self.states.insert(*node, (State::Completed, *attempts));
        }
        batch.attempts.iter().for_each(|change| self.change(change));
    }

    /// Whether so many rows wait that they should be written now.
    pub(super) fn is_much(&self) -> bool {
        self.ended.len() + self.states.len() > MOST_ROWS
    }

    /// Write the rows. Returns those of newly open attempts, to be passed to [`Self::written`] once the transaction is committed.
    pub(super) fn write(&self, connection: &Connection) -> rusqlite::Result<Rows> {
        let epoch = self.epoch;
        let mut update = connection.prepare_cached("UPDATE nodes SET state = ?2, attempts = ?3 WHERE id = ?1")?;
        for (node, (state, attempts)) in &self.states {
            update.execute(params![node_id(epoch, *node), *state as u8, attempts])?;
        }
        let mut end = connection.prepare_cached("UPDATE attempts SET ended_ms = ?2, outcome = ?3 WHERE rowid = ?1")?;
        for (key, attempt, outcome, at) in &self.ended {
            match attempt.row {
                Some(row) => _ = end.execute(params![row, ms(*at), *outcome as u8])?,
                None => _ = insert(connection, epoch, *key, *attempt, Some((*outcome, *at)))?,
            }
        }
        let new = self.open.iter().filter(|(_, attempt)| attempt.row.is_none());
        new.map(|(key, attempt)| Ok((*key, insert(connection, epoch, *key, *attempt, None)?))).collect()
    }

    /// The rows are written and committed.
    pub(super) fn written(&mut self, rows: Rows) {
        for (key, row) in rows {
            self.open.entry(key).and_modify(|attempt| attempt.row = Some(row));
        }
        self.states.clear();
        self.ended.clear();
    }

    fn change(&mut self, change: &AttemptChange) {
        match *change {
            AttemptChange::Begun { node, attempt, worker, at } => {
                self.open.insert((node, worker), Attempt { attempt, begun: at, row: None });
            }
            AttemptChange::Ended { node, worker, outcome, at } => {
                let range = worker.map_or((node, 0)..=(node, u64::MAX), |worker| (node, worker)..=(node, worker));
                let ended = self.open.extract_if(range, |_, _| true);
                self.ended.extend(ended.map(|(key, attempt)| (key, attempt, outcome, at)));
            }
        }
    }
}

fn insert(
    connection: &Connection,
    epoch: u64,
    (node, worker): (u64, u64),
    attempt: Attempt,
    end: Option<(Outcome, Duration)>,
) -> rusqlite::Result<i64> {
    let sql = "INSERT INTO attempts (epoch, node, attempt, worker, begun_ms, ended_ms, outcome)
               VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7)";
    let (ended, outcome) = (end.map(|(_, at)| ms(at)), end.map(|(outcome, _)| outcome as u8));
    let row = params![epoch, node, attempt.attempt, worker, ms(attempt.begun), ended, outcome];
    connection.prepare_cached(sql)?.insert(row)
}

/// Milliseconds since this coordinator started.
pub(super) fn ms(at: Duration) -> i64 {
    i64::try_from(at.as_millis()).unwrap_or(i64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::journal::{Names, schema};

    const AT: Duration = Duration::from_millis(5);

    fn begun(node: u64, attempt: u32, worker: u64) -> AttemptChange {
        AttemptChange::Begun { node, attempt, worker, at: AT }
    }

    fn ended(node: u64, worker: Option<u64>, outcome: Outcome) -> AttemptChange {
        AttemptChange::Ended { node, worker, outcome, at: AT }
    }

    #[test]
    fn every_attempt_is_written_once_with_its_outcome() {
        let folder = tempfile::tempdir().unwrap();
        let connection = schema::create(&folder.path().join("run.sqlite"), Names::default(), |_| Ok(())).unwrap();
        let mut deferred = Deferred::new(1);
        let mut write = |attempts: Vec<AttemptChange>| -> Vec<(u64, u64, u32, Option<u8>)> {
            deferred.take(&Batch { attempts, ..Batch::default() });
            let rows = deferred.write(&connection).unwrap();
            deferred.written(rows);
            let sql = "SELECT node, worker, attempt, outcome FROM attempts ORDER BY node, attempt";
            let mut statement = connection.prepare(sql).unwrap();
            let rows = statement.query_map([], |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?, row.get(3)?))).unwrap();
            rows.collect::<Result<_, _>>().unwrap()
        };
        // Given to a worker, taken back, and given to it again.
        let again = vec![begun(7, 1, 2), ended(7, Some(2), Outcome::Cancelled), begun(7, 2, 2)];
        assert_eq!(write(again), [(7, 2, 1, Some(3)), (7, 2, 2, None)]);
        assert_eq!(write(Vec::new()).len(), 2);
        // Given to a second worker; then the node fails, and neither worker has it.
        let both = [(7, 2, 1, Some(3)), (7, 2, 2, Some(1)), (7, 4, 3, Some(1)), (8, 4, 1, None)];
        assert_eq!(write(vec![begun(7, 3, 4), begun(8, 1, 4), ended(7, None, Outcome::Failed)]), both);
        assert_eq!(write(vec![ended(7, Some(2), Outcome::Finished)]), both);
    }

    #[test]
    fn rolled_back_entries_are_written_by_the_next_transaction() {
        let folder = tempfile::tempdir().unwrap();
        let mut connection = schema::create(&folder.path().join("run.sqlite"), Names::default(), |_| Ok(())).unwrap();
        let mut deferred = Deferred::new(1);
        deferred.take(&Batch { attempts: vec![begun(7, 1, 2)], ..Batch::default() });
        let transaction = connection.transaction().unwrap();
        deferred.write(&transaction).unwrap();
        transaction.rollback().unwrap();
        deferred.take(&Batch { attempts: vec![ended(7, Some(2), Outcome::Finished)], ..Batch::default() });
        deferred.written(deferred.write(&connection).unwrap());
        let finished: u64 =
            connection.query_row("SELECT count(*) FROM attempts WHERE outcome = 0", [], |row| row.get(0)).unwrap();
        assert_eq!(finished, 1);
    }

    #[test]
    fn last_state_of_a_node_is_written() {
        let state_after = |batches: Vec<Batch>| {
            let mut deferred = Deferred::new(1);
            batches.iter().for_each(|batch| deferred.take(batch));
            deferred.states.get(&7).map(|(state, _)| *state)
        };
        let started = || Batch { started: vec![(7, 1)], ..Batch::default() };
        let stopped = || Batch { stopped: vec![7], ..Batch::default() };
        let finished = || Batch { finished: vec![(7, 1)], ..Batch::default() };
        assert_eq!(state_after(vec![started()]), Some(State::Running));
        assert_eq!(state_after(vec![started(), stopped()]), None);
        assert_eq!(state_after(vec![started(), stopped(), started(), finished()]), Some(State::Completed));
        let at_once = Batch { stopped: vec![7], started: vec![(7, 2)], ..Batch::default() };
        assert_eq!(state_after(vec![started(), at_once]), Some(State::Running));
    }
}
