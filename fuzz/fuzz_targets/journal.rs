//! The journal of a run with any values replaced. `lookalike status` and a coordinator that resumes the run must report an error or
//! reach the expected result.
#![no_main]

use libfuzzer_sys::fuzz_target;
use lookalike::graph::{
    Blob, GraphEdit, NodeFailure, NodeId, NodeSpec, NodeType, Placement, PlanError, Planner, Registry, RunContext,
};
use lookalike_coordinator::{
    journal::{JournalOptions, Names, RunIdentity, status::Status},
    runner::{RunError, RunnerOptions, run},
};
use rusqlite::{Connection, params, types::Value};
use std::{
    fs,
    net::Ipv4Addr,
    path::Path,
    sync::{Arc, LazyLock},
};
use tempfile::TempDir;

/// Outputs its parameters twice.
struct Double;

impl NodeType for Double {
    fn kind(&self) -> &'static str {
        "double"
    }

    fn run(&self, parameters: &[u8], _: &[Blob], _: &RunContext) -> Result<Vec<u8>, NodeFailure> {
        Ok([parameters, parameters].concat())
    }
}

/// Three nodes that run in the coordinator's process.
#[derive(Default)]
struct Three(Vec<(NodeId, Vec<u8>)>);

impl Planner for Three {
    fn start(&mut self, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        for number in 0..3_u8 {
            graph.add_node(NodeSpec {
                kind: "double".to_owned(),
                label: format!("double {number}").into(),
                parameters: vec![number],
                inputs: Vec::new(),
                placement: Placement::Coordinator,
                priority: 0,
            })?;
        }
        Ok(())
    }

    fn completed(&mut self, node: NodeId, output: &Blob, _: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        self.0.push((node, output.to_vec()));
        Ok(())
    }
}

/// The outputs of a run in `folder`.
fn outputs(folder: &Path, resume: bool) -> Result<Vec<Vec<u8>>, RunError> {
    let mut options = RunnerOptions { handle_signals: false, ..RunnerOptions::new(0, folder.join("access.json")) };
    options.listen = Some((Ipv4Addr::LOCALHOST, 0).into());
    let path = folder.join("run.sqlite");
    options.journal = Some(JournalOptions { resume, ..JournalOptions::new(path, RunIdentity::default()) });
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
    let registry = Arc::new(Registry::default().with(Double));
    let (mut planner, _) = runtime.block_on(run(options, Three::default(), registry, |_| ()))?;
    planner.0.sort();
    Ok(planner.0.into_iter().map(|(_, output)| output).collect())
}

/// The journal of a finished run. Each input changes a copy of it.
static FINISHED: LazyLock<TempDir> = LazyLock::new(|| {
    let folder = tempfile::tempdir().expect("a temporary folder");
    assert_eq!(outputs(folder.path(), false).expect("a run"), EXPECTED.map(Vec::from));
    let journal = Connection::open(folder.path().join("run.sqlite")).expect("a journal");
    journal.pragma_update(None, "journal_mode", "delete").expect("a journal in one file");
    folder
});

const EXPECTED: [[u8; 2]; 3] = [[0, 0], [1, 1], [2, 2]];

const TABLES: [&str; 7] = ["run", "epochs", "nodes", "attempts", "workers", "results", "parts"];

fuzz_target!(|bytes: &[u8]| {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for file in fs::read_dir(FINISHED.path()).expect("the finished run's folder").flatten() {
        fs::copy(file.path(), folder.path().join(file.file_name())).expect("a copy of its file");
    }
    {
        let journal = Connection::open(folder.path().join("run.sqlite")).expect("a journal");
        for change in bytes.chunks(12) {
            corrupt(&journal, change);
        }
    }
    let _ = Status::of(folder.path(), Names::default());
    if let Ok(found) = outputs(folder.path(), true) {
        assert_eq!(found, EXPECTED.map(Vec::from));
    }
});

/// Replaces the value of one column, in one row or in all rows of a table.
fn corrupt(journal: &Connection, change: &[u8]) {
    let [table, column, kind, row, rest @ ..] = change else { return };
    let table = TABLES[usize::from(*table) % TABLES.len()];
    let columns: Vec<String> = {
        let mut names = journal.prepare("SELECT name FROM pragma_table_info(?1)").expect("SQLite");
        let names = names.query_map([table], |row| row.get(0)).expect("SQLite");
        names.collect::<Result<_, _>>().expect("names")
    };
    let Some(column) = columns.get(usize::from(*column) % columns.len().max(1)) else { return };
    let mut number = [0; 8];
    number.iter_mut().zip(rest).for_each(|(to, from)| *to = *from);
    let number = i64::from_le_bytes(number);
    let value = match kind % 5 {
        0 => Value::Null,
        1 => Value::Integer(number),
        2 => Value::Real(f64::from_bits(number.cast_unsigned())),
        3 => Value::Text(String::from_utf8_lossy(rest).into_owned()),
        _ => Value::Blob(rest.to_vec()),
    };
    // A value that violates a constraint of the table is not written.
    let _ = match row % 4 {
        3 => journal.execute(&format!("UPDATE {table} SET {column} = ?1"), params![value]),
        row => {
            let first = if table == "workers" { "process" } else { "rowid" };
            let one = format!("SELECT {first} FROM {table} LIMIT 1 OFFSET {row}");
            journal.execute(&format!("UPDATE {table} SET {column} = ?1 WHERE {first} = ({one})"), params![value])
        }
    };
}
