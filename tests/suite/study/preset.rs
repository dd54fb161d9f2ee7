//! The small preset gives the stored results, also after interruptions.

use super::scene::{folder, preset, results, study};
use serde_json::Value;
use std::{collections::BTreeSet, fs};

/// Stored results of the preset: in `preset.json` with `--features slow` and else in `preset16.json`. `LOOKALIKE_BLESS=1` writes the file again: review
/// the difference, and state in CHANGELOG.md why results changed.
const EXPECTED: &str = if cfg!(feature = "slow") {
    concat!(env!("CARGO_MANIFEST_DIR"), "/suite/study/preset.json")
} else {
    concat!(env!("CARGO_MANIFEST_DIR"), "/suite/study/preset16.json")
};

/// The methods that must be in the table of results.
const METHODS: &[&str] = if cfg!(feature = "slow") {
    &["ours", "ours+polish", "paper", "l2", "brute", "lowres", "log", "cuberoot"]
} else {
    &["ours", "ours+polish", "paper", "l2", "brute", "log", "cuberoot"]
};

/// A cell that takes little time.
const CELL: &str = if cfg!(feature = "slow") {
    "paint-room-32-lowres16.json"
} else {
    "paint-room-16-log-ggx-256-importance-1-seed0-to1.json"
};

/// Checks the stream of progress: each cell begins and ends once, every count is right, and the last event is the end.
fn check_stream(stderr: &str) {
    let events: Vec<Value> = stderr.lines().filter_map(|line| serde_json::from_str(line).ok()).collect();
    let total = events[0]["cells"].as_u64().unwrap();
    assert!(events[0]["event"] == "start" && total > 3, "{}", events[0]);
    let names = |event: &str| {
        let of = events.iter().filter(|e| e["event"] == event);
        of.map(|e| e["cell"].as_str().unwrap().to_owned()).collect::<BTreeSet<_>>()
    };
    assert_eq!(names("cell-started").len() as u64, total);
    assert_eq!(names("cell-started"), names("cell-finished"));
    let ends: Vec<&Value> = events.iter().filter(|e| e["event"] == "cell-finished").collect();
    let done: Vec<u64> = ends.iter().map(|e| e["cells"]["done"].as_u64().unwrap()).collect();
    assert_eq!(done, (1..=total).collect::<Vec<_>>());
    assert_eq!(ends.last().unwrap()["cells"]["running"], 0);
    assert!(events.iter().any(|e| e["event"] == "node-finished" && e["cell"].is_string()));
    assert_eq!(events.last().unwrap()["event"], "finished");
}

#[test]
fn small_preset_gives_stored_results_and_finished_study_only_rewrites_its_report() {
    let folder = folder(&preset());
    let answer = study(folder.path(), "--workers 2 --progress json").done();
    check_stream(&answer.stderr);
    assert!(answer.stdout.trim_end().ends_with("report.html"), "{}", answer.stdout);
    let found = results(folder.path());
    if std::env::var_os("LOOKALIKE_BLESS").is_some() {
        let lines: Vec<String> = found.iter().map(Value::to_string).collect();
        fs::write(EXPECTED, format!("[\n{}\n]\n", lines.join(",\n"))).unwrap();
    }
    let expected: Vec<Value> = serde_json::from_str(&fs::read_to_string(EXPECTED).unwrap()).unwrap();
    assert_eq!(found.len(), expected.len());
    for (found, expected) in found.iter().zip(&expected) {
        assert_eq!(found, expected, "the small preset gives another result: see LOOKALIKE_BLESS in this file");
    }
    let methods: BTreeSet<&str> = found.iter().filter_map(|row| row["method"].as_str()).collect();
    assert_eq!(methods, METHODS.iter().copied().collect());
    let score = |method: &str| {
        let scores = found.iter().filter(|row| row["method"] == method && row["samples"] != 32 && row["samples"] != 64);
        scores.filter_map(|row| row["cssim"].as_f64()).fold(f64::INFINITY, f64::min)
    };
    assert!(score("ours+polish") <= score("ours") && score("ours") <= score("l2"), "{found:?}");
    assert!(score("ours+polish") <= score("brute") + 0.002, "{found:?}");

    let report = |name: &str| fs::read(folder.path().join("out").join(name)).unwrap();
    // Only lines of nodes: each process starts with a line `#`.
    let seconds = || String::from_utf8(report("seconds.tsv")).unwrap().lines().filter(|line| *line != "#").count();
    let before = (report("results.json"), seconds());
    for name in ["results.md", "report.html", "data.json"] {
        fs::remove_file(folder.path().join("out").join(name)).unwrap();
    }
    study(folder.path(), "--workers 1 --resume").done();
    assert!(report("results.json") == before.0 && seconds() == before.1, "nothing is computed again");
    assert!(!report("results.md").is_empty() && !report("report.html").is_empty());

    // A missing cell is computed again, and nothing else.
    let lost = folder.path().join("out/cells").join(CELL);
    let record = fs::read(&lost).unwrap();
    fs::remove_file(&lost).unwrap();
    study(folder.path(), "--workers 1 --resume").done();
    assert_eq!(results(folder.path()), found);
    let content = |bytes: &[u8]| serde_json::from_slice::<Value>(bytes).unwrap()["content"].clone();
    assert_eq!(content(&fs::read(&lost).unwrap()), content(&record));
}
