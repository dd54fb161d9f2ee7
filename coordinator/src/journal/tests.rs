//! What was written can be read again, whatever happened to the process or the file in between.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use lookalike::graph::{Blob, NodeKey};
use lookalike::protocol::RunName;
use rusqlite::Connection;
use tempfile::TempDir;

use super::batch::{NodeRow, State, WorkerRow};
use super::status::{RunState, Status};
use super::*;

mod parts;

const NAME: RunName = RunName([7; 16]);
const DEATHS: Deaths = Deaths { in_company: 2, alone: 1, not_counted: 3 };

fn identity() -> RunIdentity {
    RunIdentity::default().with("--seed", "0")
}

fn options(folder: &TempDir) -> JournalOptions {
    JournalOptions { resume: true, ..JournalOptions::new(folder.path().join(JOURNAL_FILE), identity()) }
}

fn key(byte: u8) -> NodeKey {
    NodeKey([byte; 32])
}

fn output(byte: u8) -> Blob {
    Blob::new(vec![byte; 1000])
}

/// A completed node with its output.
fn completed(node: u8) -> Batch {
    let mut batch = Batch::default();
    let added = Some(("search".to_owned(), format!("search {node}")));
    let row = NodeRow {
        added,
        state: State::Completed,
        attempts: 1,
        deaths: Deaths::default(),
        key: Some(key(node)),
        error: None,
    };
    batch.nodes.insert(u64::from(node), row);
    batch.keep(key(node), output(node));
    batch
}

/// Write batches and wait until they are written.
fn write(journal: &mut Journal, batches: impl IntoIterator<Item = Batch>) {
    let runtime = tokio::runtime::Builder::new_current_thread().build().unwrap();
    for batch in batches {
        journal.commit(batch);
        runtime.block_on(journal.committed()).unwrap();
    }
}

fn begun(folder: &TempDir) -> Journal {
    Journal::open(&options(folder), NAME, None).unwrap()
}

fn sql(folder: &TempDir, statement: &str) {
    Connection::open(folder.path().join(JOURNAL_FILE)).unwrap().execute_batch(statement).unwrap();
}

#[test]
fn next_epoch_finds_results_deaths_and_the_address() {
    let folder = tempfile::tempdir().unwrap();
    let mut journal = begun(&folder);
    assert_eq!((journal.run, journal.epoch), (NAME, 1));
    let mut batch = completed(1);
    let suspect = NodeRow { state: State::Ready, deaths: DEATHS, ..completed(2).nodes.remove(&2).unwrap() };
    batch.nodes.insert(2, suspect);
    batch.listens("127.0.0.1:4100".into());
    write(&mut journal, [batch]);
    // As after a kill: nothing is closed. (A killed process writes nothing more, but a thread cannot be killed.)
    let copy = copied(&folder);
    drop(journal);
    let again = Journal::open(&options(&copy), RunName([8; 16]), None).unwrap();
    assert_eq!((again.run, again.epoch, again.past.results), (NAME, 2, 1));
    assert_eq!(again.past.listen, "127.0.0.1:4100".parse().ok());
    let mut past = again.past_outputs();
    assert_eq!(past.of(key(1)), Memory { output: Some(output(1)), ..Memory::default() });
    assert_eq!(past.of(key(2)), Memory { output: None, deaths: DEATHS });
    assert_eq!(past.of(key(3)), Memory::default());
}

/// A copy of the journal's present files, in another folder.
fn copied(folder: &TempDir) -> TempDir {
    let copy = tempfile::tempdir().unwrap();
    for name in ["run.sqlite", "run.sqlite-wal"] {
        fs::copy(folder.path().join(name), copy.path().join(name)).unwrap();
    }
    copy
}

#[test]
fn torn_write_loses_only_the_unfinished_transaction() {
    let folder = tempfile::tempdir().unwrap();
    let mut journal = begun(&folder);
    write(&mut journal, [completed(1)]);
    let log = folder.path().join("run.sqlite-wal");
    let before = fs::metadata(&log).unwrap().len();
    write(&mut journal, [completed(2)]);
    let after = fs::metadata(&log).unwrap().len();
    for length in [before + 1, (before + after) / 2, after - 1] {
        let copy = copied(&folder);
        let torn = fs::OpenOptions::new().write(true).open(copy.path().join("run.sqlite-wal")).unwrap();
        torn.set_len(length).unwrap();
        let again = Journal::open(&options(&copy), NAME, None).unwrap();
        let mut past = again.past_outputs();
        assert_eq!(past.of(key(1)).output, Some(output(1)), "{length}");
        assert_eq!(past.of(key(2)).output, None, "{length}");
    }
}

/// A killed run leaves its log; then the user removes the journal alone.
#[test]
fn log_of_a_removed_journal_is_not_replayed_into_a_new_one() {
    let folder = tempfile::tempdir().unwrap();
    let mut journal = begun(&folder);
    write(&mut journal, [completed(1)]);
    let copy = copied(&folder);
    fs::remove_file(copy.path().join("run.sqlite")).unwrap();
    let mut again = begun(&copy);
    assert_eq!(again.past_outputs().of(key(1)), Memory::default());
    write(&mut again, [completed(2)]);
    drop(again);
    let again = Journal::open(&options(&copy), NAME, None).unwrap();
    let mut past = again.past_outputs();
    assert_eq!((past.of(key(1)).output, past.of(key(2)).output), (None, Some(output(2))));
}

#[test]
fn epoch_numbers_are_never_reused_whatever_is_left_of_the_log() {
    let folder = tempfile::tempdir().unwrap();
    let mut journal = begun(&folder);
    let mut batch = Batch::default();
    batch.listens("127.0.0.1:4100".into());
    write(&mut journal, [batch, completed(1)]);
    let copy = copied(&folder);
    fs::write(copy.path().join("run.sqlite-wal"), "").unwrap();
    let again = Journal::open(&options(&copy), RunName([8; 16]), None).unwrap();
    assert_eq!((again.run, again.epoch, again.past.results), (NAME, 2, 0));
    assert_eq!(again.past.listen, "127.0.0.1:4100".parse().ok());
}

#[test]
fn damaged_output_is_dropped_and_the_others_stay() {
    let folder = tempfile::tempdir().unwrap();
    let mut journal = begun(&folder);
    write(&mut journal, [completed(1), completed(2)]);
    journal.close(None).unwrap();
    sql(
        &folder,
        "UPDATE results SET bytes = zeroblob(1000) WHERE key = (SELECT key FROM nodes WHERE id & 0xffffffff = 1)",
    );
    let again = begun(&folder);
    let mut past = again.past_outputs();
    assert_eq!(past.of(key(1)).output, None);
    assert_eq!(past.of(key(2)).output, Some(output(2)));
    again.close(None).unwrap();
    assert_eq!(begun(&folder).past.results, 1);
}

#[test]
fn wrong_results_are_dropped_and_released_ones_keep_their_hash() {
    let folder = tempfile::tempdir().unwrap();
    let mut journal = begun(&folder);
    let mut wrong = completed(1);
    wrong.forget(key(1));
    let mut later = Batch::default();
    later.forget(key(2));
    later.released.insert(key(3));
    write(&mut journal, [wrong, completed(2), completed(3), later]);
    journal.close(None).unwrap();
    let connection = Connection::open(folder.path().join(JOURNAL_FILE)).unwrap();
    let rows: Vec<(Vec<u8>, Option<Vec<u8>>)> = connection
        .prepare("SELECT hash, bytes FROM results")
        .unwrap()
        .query_map([], |row| Ok((row.get(0)?, row.get(1)?)))
        .unwrap()
        .collect::<Result<_, _>>()
        .unwrap();
    assert_eq!(rows, [(output(3).hash().0.to_vec(), None)]);
}

#[test]
fn output_recomputed_after_its_release_is_written_again() {
    let folder = tempfile::tempdir().unwrap();
    let mut journal = begun(&folder);
    let released = |byte| {
        let mut batch = Batch::default();
        batch.released.insert(key(byte));
        batch
    };
    // Released, and added again: by a later group, and by the same one.
    write(&mut journal, [completed(1), released(1)]);
    let mut again = Batch::default();
    again.keep(key(1), output(1));
    let mut both = released(2);
    both.keep(key(2), output(2));
    write(&mut journal, [again, completed(2), both]);
    let copy = copied(&folder);
    let journal = Journal::open(&options(&copy), NAME, None).unwrap();
    let mut past = journal.past_outputs();
    assert_eq!(past.of(key(1)).output, Some(output(1)));
    assert_eq!(past.of(key(2)).output, Some(output(2)));
}

#[test]
fn journal_is_created_atomically() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(JOURNAL_FILE);
    let full = |_: &Connection| Err(rusqlite::Error::InvalidQuery);
    let error = schema::create(&path, Names::default(), full).unwrap_err().to_string();
    assert!(error.contains("run.sqlite;"), "{error}");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    // Killed while it created the journal: the rest is not a run that could be resumed or that has to be kept.
    fs::write(folder.path().join("run.sqlite.new"), "half of a journal").unwrap();
    fs::write(folder.path().join("run.sqlite.new-journal"), "more of it").unwrap();
    let fresh = JournalOptions { resume: false, ..options(&folder) };
    let journal = Journal::open(&fresh, NAME, None).unwrap();
    assert_eq!((journal.epoch, journal.past.results), (1, 0));
    journal.close(None).unwrap();
    assert!(!folder.path().join("run.sqlite.new").exists());
    assert_eq!(begun(&folder).epoch, 2);
}

#[test]
fn file_of_another_kind_version_or_run_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |expected: &str| {
        let error = Journal::open(&options(&folder), NAME, None).unwrap_err();
        assert!(error.to_string().contains(expected), "{error}");
        assert_eq!(error.exit_code(), 2);
    };
    let path = folder.path().join(JOURNAL_FILE);
    fs::write(&path, "a letter to the editor, long enough to be a header of a database of some kind ".repeat(20))
        .unwrap();
    refused("is not the journal of a run");
    fs::remove_file(&path).unwrap();
    sql(&folder, "CREATE TABLE songs (title TEXT)");
    refused("is not the journal of a run");
    fs::remove_file(&path).unwrap();
    begun(&folder).close(None).unwrap();
    let fresh = JournalOptions { resume: false, ..options(&folder) };
    let error = Journal::open(&fresh, NAME, None).unwrap_err().to_string();
    assert!(error.contains("already holds a run; resume it with --resume"), "{error}");
    let other = JournalOptions { identity: RunIdentity::default().with("--seed", "3"), ..options(&folder) };
    let error = Journal::open(&other, NAME, None).unwrap_err().to_string();
    assert!(error.contains("--seed is 0 there and 3 here"), "{error}");
    sql(&folder, "PRAGMA user_version = 99");
    refused("has journal format 99, expected 3");
    sql(&folder, "PRAGMA user_version = 3; DELETE FROM run");
    refused("is not the journal of a run");
}

#[test]
fn finished_run_lists_its_files_and_keeps_no_outputs() {
    let folder = tempfile::tempdir().unwrap();
    let path: PathBuf = folder.path().join(JOURNAL_FILE);
    let mut journal = begun(&folder);
    let large = Blob::new((0..3_000_000_u32).map(|index| index.to_le_bytes()[1]).collect());
    let mut batch = completed(1);
    batch.keep(key(2), large);
    write(&mut journal, [batch]);
    journal.close(None).unwrap();
    assert_eq!(finished(&path, &identity()).unwrap(), None);
    let outputs = Finished { outputs: vec![("fit.json".into(), "12ab".into())] };
    finish(&path, Names::default(), &outputs).unwrap();
    assert_eq!(finished(&path, &identity()).unwrap(), Some(outputs));
    assert!(matches!(finished(&path, &RunIdentity::default()), Err(JournalError::AnotherRun { .. })));
    assert!(fs::metadata(&path).unwrap().len() < 100_000);
    let others = schema::files(&path)[1..].iter().filter(|file| file.exists()).count();
    assert_eq!(others, 0, "a finished journal is one file");
    // A resumed run is no longer finished.
    let again = begun(&folder);
    assert_eq!((again.epoch, again.past.results), (2, 0));
    again.close(None).unwrap();
    assert_eq!(finished(&path, &identity()).unwrap(), None);
}

#[test]
fn status_reports_counts_workers_and_whether_a_coordinator_runs() {
    let folder = tempfile::tempdir().unwrap();
    assert!(Status::of(folder.path(), Names::default()).unwrap_err().to_string().contains("found no run.sqlite"));
    let lock = RunLock::take(folder.path()).unwrap();
    let mut journal = begun(&folder);
    let mut batch = completed(1);
    let failed =
        NodeRow { state: State::Failed, error: Some("black".into()), ..completed(2).nodes.remove(&2).unwrap() };
    batch.nodes.insert(2, failed);
    batch.workers.push(WorkerRow { worker: 1, process: 99, threads: 4, at: Duration::ZERO });
    write(&mut journal, [batch]);
    let running = Status::of(folder.path(), Names::default()).unwrap();
    assert_eq!((running.state, running.epoch, running.error), (RunState::Running, 1, None));
    assert_eq!((running.nodes.total, running.nodes.completed, running.nodes.failed), (2, 1, 1));
    assert_eq!((running.kinds[0].kind.as_str(), running.workers[0].process), ("search", 99));
    assert_eq!(running.failures[0].error, "black");
    drop(lock);
    let killed = Status::of(folder.path(), Names::default()).unwrap();
    assert!(killed.state == RunState::Stopped && killed.error.unwrap().contains("was killed"));
    journal.close(Some("the disk is full".into())).unwrap();
    let stopped = Status::of(folder.path(), Names::default()).unwrap();
    assert_eq!((stopped.state, stopped.error.as_deref()), (RunState::Stopped, Some("the disk is full")));
    // If the journal cannot be read, the status file is.
    let file: Status = serde_json::from_slice(&fs::read(folder.path().join("status.json")).unwrap()).unwrap();
    assert_eq!((file.run, file.nodes), (stopped.run, stopped.nodes));
    finish(&folder.path().join(JOURNAL_FILE), Names::default(), &Finished { outputs: Vec::new() }).unwrap();
    assert_eq!(Status::of(folder.path(), Names::default()).unwrap().state, RunState::Finished);
}

#[test]
fn status_of_a_resumed_run_lists_no_failures_of_earlier_epochs() {
    let folder = tempfile::tempdir().unwrap();
    let failed = |error: &str| {
        let row = completed(1).nodes.remove(&1).unwrap();
        let mut batch = Batch::default();
        batch.nodes.insert(1, NodeRow { state: State::Failed, error: Some(error.into()), ..row });
        batch
    };
    let errors = || -> Vec<String> {
        Status::of(folder.path(), Names::default()).unwrap().failures.into_iter().map(|failure| failure.error).collect()
    };
    let mut first = begun(&folder);
    write(&mut first, [failed("black")]);
    assert_eq!(errors(), ["black"]);
    first.close(None).unwrap();
    let mut second = begun(&folder);
    write(&mut second, [completed(1)]);
    assert!(errors().is_empty());
    second.close(None).unwrap();
    let mut third = begun(&folder);
    write(&mut third, [failed("no light")]);
    assert_eq!(errors(), ["no light"]);
}

#[test]
fn status_is_read_from_its_file_while_the_journal_is_locked() {
    let folder = tempfile::tempdir().unwrap();
    let _lock = RunLock::take(folder.path()).unwrap();
    let mut journal = begun(&folder);
    write(&mut journal, [completed(1)]);
    journal.close(None).unwrap();
    // As on a network file system.
    let path = folder.path().join(JOURNAL_FILE);
    let alone = schema::connect(&path, true).unwrap();
    alone.execute("UPDATE epochs SET ended_ms = NULL", []).unwrap();
    assert!(!folder.path().join("run.sqlite-shm").exists(), "there is no memory to share");
    let status = Status::of(folder.path(), Names::default()).unwrap();
    assert_eq!((status.state, status.nodes.completed), (RunState::Running, 1));
    fs::remove_file(folder.path().join("status.json")).unwrap();
    let error = Status::of(folder.path(), Names::default()).unwrap_err().to_string();
    assert!(error.contains("another process is using the journal"), "{error}");
}

#[cfg(unix)]
#[test]
fn journal_is_readable_by_its_owner_only() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    let mut journal = begun(&folder);
    write(&mut journal, [completed(1)]);
    let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode() & 0o777;
    for name in ["run.sqlite", "run.sqlite-wal"] {
        assert_eq!(mode(&folder.path().join(name)), 0o600, "{name}");
    }
}

#[test]
fn status_of_a_journal_with_impossible_times_does_not_panic() {
    let folder = tempfile::tempdir().unwrap();
    let options = options(&folder);
    drop(Journal::open(&options, NAME, None).unwrap());
    for time in [i64::MAX, i64::MIN, 253_402_300_800_000] {
        let journal = Connection::open(&options.path).unwrap();
        journal.execute("UPDATE epochs SET seen_ms = ?1", [time]).unwrap();
        let status = Status::of(folder.path(), Names::default()).unwrap();
        assert!(["1970-01-01T00:00:00.000Z", "9999-12-31T23:59:59.999Z"].contains(&status.updated_at.as_str()));
    }
}
