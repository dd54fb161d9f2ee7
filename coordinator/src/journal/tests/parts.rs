//! The rows about the parts of a run.

use super::*;

/// The names that a program has chosen.
const NAMES: Names = Names { parts: "pieces", score: "delta", best_score: "least_delta" };

fn part(name: &str, state: &str, outputs: &[(&str, &str)]) -> PartRow {
    let status = PartStatus { name: name.into(), state: state.into(), ..PartStatus::default() };
    PartRow {
        number: 0,
        status,
        outputs: outputs.iter().map(|(name, hash)| ((*name).into(), (*hash).into())).collect(),
    }
}

#[test]
fn parts_are_written_no_later_than_the_next_transaction() {
    let folder = tempfile::tempdir().unwrap();
    let options = JournalOptions { names: NAMES, ..options(&folder) };
    let mut journal = Journal::open(&options, NAME, None).unwrap();
    options.parts.tell(part("gold", "running", &[]));
    options.parts.tell(part("gold", "done", &[("result", "12ab")]));
    options.parts.tell(part("chrome", "running", &[]));
    write(&mut journal, [completed(1)]);
    // As after a kill.
    let copy = copied(&folder);
    drop(journal);
    let path = copy.path().join(JOURNAL_FILE);
    let found = written(&path, &identity()).unwrap();
    let gold = ("gold".to_owned(), vec![("result".to_owned(), "12ab".to_owned())]);
    assert_eq!((found.is_finished, found.outputs.into_iter().collect::<Vec<_>>()), (false, vec![gold]));
    assert!(matches!(written(&path, &identity().with("--gammas", "1")), Err(JournalError::AnotherRun { .. })));
    let view = Connection::open(&path).unwrap();
    let names = |sql: &str| -> Vec<(String, String)> {
        let mut statement = view.prepare(sql).unwrap();
        let rows = statement.query_map([], |row| Ok((row.get(0)?, row.get(1)?))).unwrap();
        rows.collect::<Result<_, _>>().unwrap()
    };
    let pieces = "SELECT name, state FROM (SELECT name, number, state, delta, seconds, error, outputs FROM pieces) ORDER BY name";
    assert_eq!(names(pieces), names("SELECT name, state FROM parts ORDER BY name"));
    drop(view);
    let states = || {
        let parts = Status::of(copy.path(), NAMES).unwrap().parts;
        parts.into_iter().map(|part| (part.name, part.state)).collect::<Vec<_>>()
    };
    assert_eq!(states(), [("chrome".to_owned(), "running".to_owned()), ("gold".to_owned(), "done".to_owned())]);
    // Another process has held the lock and has ended.
    drop(RunLock::take(copy.path()).unwrap());
    assert_eq!(states()[0].1, "stopped");
}

#[test]
fn run_in_which_parts_failed_has_ended_and_can_be_resumed() {
    let folder = tempfile::tempdir().unwrap();
    let options = JournalOptions { names: NAMES, ..options(&folder) };
    let mut journal = Journal::open(&options, NAME, None).unwrap();
    write(&mut journal, [completed(1)]);
    journal.close(None).unwrap();
    options.parts.tell(part("gold", "failed", &[]));
    let path = folder.path().join(JOURNAL_FILE);
    settle(&path, options.names, &options.parts, Some("1 of 12 failed")).unwrap();
    let file = fs::read_to_string(folder.path().join("status.json")).unwrap();
    assert!(
        file.contains("\"least_delta\": null") && file.contains("\"pieces\": [") && file.contains("\"delta\": null")
    );
    let status = Status::of(folder.path(), NAMES).unwrap();
    assert_eq!((status.state, status.error.as_deref()), (RunState::Ended, Some("1 of 12 failed")));
    assert_eq!((status.parts[0].state.as_str(), status.finished_at.is_some()), ("failed", true));
    assert_eq!(finished(&path, &identity()).unwrap(), None);
    let again = Journal::open(&options, NAME, None).unwrap();
    assert_eq!((again.epoch, again.past.results), (2, 1));
    assert_eq!(Status::of(folder.path(), NAMES).unwrap().state, RunState::Running);
}
