//! The small preset gives the results stored in `preset.json`, also after interruptions.

use super::scene::{folder, preset, results, study};
use serde_json::Value;
use std::{collections::BTreeSet, fs};

/// Stored results of the preset. `LOOKALIKE_BLESS=1` with `--features slow` writes the file again: review the difference, and state in
/// CHANGELOG.md why results changed.
const EXPECTED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/suite/study/preset.json");

#[test]
fn small_preset_gives_stored_results_and_finished_study_only_rewrites_its_report() {
    let folder = folder(&preset());
    let answer = study(folder.path(), "--workers 2").done();
    assert!(answer.stdout.trim_end().ends_with("report.html"), "{}", answer.stdout);
    let found = results(folder.path());
    if cfg!(feature = "slow") && std::env::var_os("LOOKALIKE_BLESS").is_some() {
        let lines: Vec<String> = found.iter().map(Value::to_string).collect();
        fs::write(EXPECTED, format!("[\n{}\n]\n", lines.join(",\n"))).unwrap();
    }
    let mut expected: Vec<Value> = serde_json::from_str(&fs::read_to_string(EXPECTED).unwrap()).unwrap();
    if cfg!(not(feature = "slow")) {
        expected.retain(|row| row["method"] != "ours" || row["samples"] == 256);
    }
    assert_eq!(found.len(), expected.len());
    for (found, expected) in found.iter().zip(&expected) {
        assert_eq!(found, expected, "the small preset gives another result: see LOOKALIKE_BLESS in this file");
    }
    // The methods that must be in the table of results.
    let methods: BTreeSet<&str> = found.iter().filter_map(|row| row["method"].as_str()).collect();
    let all = ["ours", "ours+polish", "paper", "l2", "brute", "lowres", "log", "cuberoot"];
    assert_eq!(methods, all.into_iter().collect());
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
    let lost = folder.path().join("out/cells/paint-room-32-lowres16.json");
    let record = fs::read(&lost).unwrap();
    fs::remove_file(&lost).unwrap();
    study(folder.path(), "--workers 1 --resume").done();
    assert_eq!(results(folder.path()), found);
    let content = |bytes: &[u8]| serde_json::from_slice::<Value>(bytes).unwrap()["content"].clone();
    assert_eq!(content(&fs::read(&lost).unwrap()), content(&record));
}
