//! How a batch ends when not all goes well: which fits have results, which code.

use super::{QUICK, batch, folder, states, summary};

/// Three fits; the second fails when it is to be judged.
fn one_fails() -> String {
    format!("photos = ['photo.exr', 'tiny.exr', 'red.exr']\nenvironments = 'map.exr'\n[defaults]\n{QUICK}")
}

#[test]
fn failed_fit_is_code_four_and_the_others_are_complete() {
    let folder = folder(&one_fails());
    let answer = batch(&folder, "out", "--workers 1");
    assert_eq!(answer.code, Some(4), "{}", answer.stderr);
    assert!(answer.stderr.contains("tiny-map-ggx: failed: select \"select\" failed: "), "{}", answer.stderr);
    assert!(
        answer.stdout.contains("2 of 3 done, 1 failed") && !answer.stderr.contains("panicked"),
        "{}",
        answer.stdout
    );
    let out = folder.path().join("out");
    let summary = summary(&out);
    assert_eq!(states(&summary), ["done", "failed", "done"]);
    assert_eq!(summary["state"], "finished");
    assert!(summary["fits"][1]["error"].as_str().unwrap().contains("11 x 11"), "{summary}");
    assert!(out.join("red-map-ggx/fit.json").exists() && !out.join("tiny-map-ggx").exists());
}

#[test]
fn fail_fast_ends_the_batch_with_code_four() {
    let folder = folder(&one_fails());
    let answer = batch(&folder, "out", "--workers 1 --fail-fast");
    assert_eq!(answer.code, Some(4), "{}", answer.stderr);
    let summary = summary(&folder.path().join("out"));
    let states = states(&summary);
    assert_eq!((states[1].as_str(), summary["state"].as_str()), ("failed", Some("stopped")));
    assert!(states.contains(&"stopped".to_owned()) && answer.stdout.contains("not done"), "{}", answer.stdout);
    // The last of the two flags counts.
    let answer = batch(&folder, "on", "--workers 1 --fail-fast --keep-going --samples 16");
    assert_eq!(answer.code, Some(4), "{}", answer.stderr);
    assert_eq!(super::states(&super::summary(&folder.path().join("on"))), ["done", "failed", "done"]);
}

#[test]
fn missed_score_is_code_one_unless_a_fit_failed() {
    let fits = "[[fit]]\nphoto = 'photo.exr'\nenv = 'map.exr'\nmax-cssim = 0\n\
                [[fit]]\nphoto = 'red.exr'\nenv = 'map.exr'\nmax-cssim = 1\n";
    let folder = folder(&format!("[defaults]\n{QUICK}{fits}"));
    let answer = batch(&folder, "out", "--workers 2");
    assert_eq!(answer.code, Some(1), "{}", answer.stderr);
    assert_eq!(states(&summary(&folder.path().join("out"))), ["missed", "done"]);
    assert!(folder.path().join("out/photo-map-ggx/fit.json").exists());
    let worse = format!("[defaults]\n{QUICK}{fits}[[fit]]\nphoto = 'tiny.exr'\nenv = 'map.exr'\n");
    std::fs::write(folder.path().join("batch.toml"), worse).unwrap();
    assert_eq!(batch(&folder, "worse", "--workers 2").code, Some(4));
}
