//! Every setting of the method has the effect, visible in `fit.json`, that its documentation states.

use super::scene::{POLISHED, QUICK, QUICK_FIT, fit, fit_json, folder, folder_of_size, number, quick, without_timing};
use serde_json::{Value, json};
use std::fs;

fn gammas(json: &Value) -> Vec<f64> {
    json["candidates"].as_array().unwrap().iter().map(|c| number(&c["gamma"])).collect()
}

fn names(parameters: &Value) -> Vec<&str> {
    parameters.as_object().unwrap().keys().map(String::as_str).collect()
}

#[test]
fn settings_file_gives_the_result_of_the_flags() {
    let folder = folder();
    fit(folder.path(), "flags", "--model ggx --samples 24 --gammas 1:2:1 --seed 9 --polish off --workers 1").done();
    let text = "photo = \"photo.exr\"\nenv = \"map.exr\"\nout = \"file\"\nmodel = \"ggx\"\nsamples = 24\ngammas = \"1:2:1\"\nseed = 4\n\
                polish = \"off\"\nworkers = 2\n";
    fs::write(folder.path().join("fit.toml"), text).unwrap();
    // A flag takes precedence over the file.
    crate::program::lookalike(folder.path(), "fit fit.toml --seed 9").done();
    assert_eq!(without_timing(&folder.path().join("flags")), without_timing(&folder.path().join("file")));
}

#[test]
fn gammas_are_those_requested() {
    let json = QUICK_FIT.json();
    assert_eq!(gammas(&json), [1.0, 1.5, 2.0]);
    assert_eq!(json["gammas"], json!([1.0, 1.5, 2.0]));
    assert_eq!(gammas(&quick("--gammas 2.2")), [2.2]);
}

#[test]
fn samples_full_uses_every_usable_pixel() {
    let folder = folder_of_size(14);
    let fitted = |out: &str, flags: &str| {
        fit(folder.path(), out, &format!("{QUICK} --gammas 1 {flags}")).done();
        fit_json(&folder.path().join(out))
    };
    let [a, b] = ["1", "2"].map(|seed| fitted(seed, &format!("--samples full --seed {seed}")));
    assert_eq!(a["samples"], "full");
    // No subset is drawn, so the seed does not matter; the cost of a fit with a subset is an estimate of the same sum.
    assert_eq!(a["candidates"], b["candidates"]);
    let subset = fitted("few", "");
    let [all, few] = [&a, &subset].map(|json| number(&json["candidates"][0]["cost"]));
    assert!(few > 0.2 * all && few < 2.0 * all, "{few} of {all}");
}

#[test]
fn pattern_search_finds_about_the_minimum_of_least_squares_with_many_more_evaluations() {
    let (pattern, least_squares) = (quick("--search pattern --gammas 1.5"), quick("--gammas 1.5"));
    assert_eq!(
        (pattern["search"].as_str(), least_squares["search"].as_str()),
        (Some("pattern"), Some("least-squares"))
    );
    let [a, b] = [&pattern, &least_squares].map(|json| number(&json["candidates"][0]["cost"]));
    assert!(b <= a * (1.0 + 1e-6) && a < 1.1 * b, "pattern {a}, least squares {b}");
    let [a, b] = [&pattern, &least_squares].map(|json| json["candidates"][0]["evaluations"].as_u64().unwrap());
    assert!(a > 2 * b, "pattern {a}, least squares {b}");
}

#[test]
fn direct_integrator_is_searched_by_pattern_only() {
    let flags = "--preset paper --gammas 1.5 --samples 4";
    let (direct, tables) = (quick(&format!("{flags} --integrator direct:8")), quick(flags));
    assert_eq!((direct["integrator"].as_str(), tables["integrator"].as_str()), (Some("direct:8"), Some("tables")));
    assert_ne!(direct["candidates"][0]["cost"], tables["candidates"][0]["cost"]);
    let folder = folder();
    fit(folder.path(), "out", &format!("{QUICK} --integrator direct"))
        .refused(&["--integrator direct", "--search pattern"]);
}

#[test]
fn preset_paper_is_the_method_of_the_paper() {
    let folder = folder();
    let flags = "--samples 32 --gammas 1:2:0.5 --workers 1 --progress none --preset paper";
    fit(folder.path(), "out", flags).done();
    let json = fit_json(&folder.path().join("out"));
    // Explicit flags take precedence over the preset: here those of the quick fit.
    assert_eq!((json["samples"].as_u64(), gammas(&json).len()), (Some(32), 3));
    for (name, expected) in [
        ("model", "cook-torrance"),
        ("search", "pattern"),
        ("start", "paper"),
        ("at_zero", "clamp"),
        ("sampling", "importance"),
        ("judge", "image"),
    ] {
        assert_eq!(json[name], expected, "{name}");
    }
    assert_eq!(json["polished"], Value::Null);
    assert_eq!(names(&json["stage_two"]["parameters"]), ["kd", "ks", "f0", "m"]);
}

#[test]
fn subsets_multiply_the_candidates() {
    let json = quick("--subsets 2");
    assert_eq!(gammas(&json), [1.0, 1.0, 1.5, 1.5, 2.0, 2.0]);
    let candidates = json["candidates"].as_array().unwrap();
    assert_eq!(candidates.iter().map(|c| c["subset"].as_u64().unwrap()).collect::<Vec<_>>(), [0, 1, 0, 1, 0, 1]);
    // Other pixels, another minimum; the first subset is that of a fit with one.
    assert_ne!(candidates[0]["parameters"], candidates[1]["parameters"]);
    let alone = &QUICK_FIT.json()["candidates"][0];
    for name in ["cost", "evaluations", "parameters"] {
        assert_eq!(candidates[0][name], alone[name], "{name}");
    }
    let lowest = candidates.iter().map(|c| number(&c["cssim"])).fold(f64::INFINITY, f64::min);
    assert_eq!(number(&json["stage_two"]["cssim"]), lowest);
}

#[test]
fn judge_determines_the_score_for_selection_and_polish() {
    for (judge, score) in [("image", "cssim"), ("object", "cssim_object")] {
        let json = if judge == "image" { POLISHED.json() } else { quick("--judge object --polish on") };
        assert_eq!(json["judge"], judge);
        let scores = json["candidates"].as_array().unwrap().iter().map(|c| number(&c[score]));
        let selected = number(&json["stage_two"][score]);
        assert_eq!(selected, scores.fold(f64::INFINITY, f64::min));
        assert!(number(&json["polished"][score]) <= selected);
    }
}

#[test]
fn polish_off_gives_no_polished_result() {
    let (off, on) = (QUICK_FIT.json(), POLISHED.json());
    assert_eq!(off["polished"], Value::Null);
    assert_eq!(off["stage_two"], on["stage_two"]);
    assert!(number(&on["polished"]["cssim"]) < number(&on["stage_two"]["cssim"]));
}

#[test]
fn model_is_the_one_requested() {
    let json = quick("--model cook-torrance --polish on");
    assert_eq!(json["model"], "cook-torrance");
    for parameters in [&json["candidates"][0]["parameters"], &json["polished"]["parameters"]] {
        assert_eq!(names(parameters), ["kd", "ks", "f0", "m"]);
        assert!((0.005..=1.0).contains(&number(&parameters["m"])));
    }
    // The photo was made with this model (m = 0.2) and with noise.
    assert!((number(&json["stage_two"]["parameters"]["m"]) / 0.2 - 1.0).abs() < 0.1, "{}", json["stage_two"]);
    assert!(number(&json["stage_two"]["cssim"]) < number(&QUICK_FIT.json()["stage_two"]["cssim"]));
}

#[test]
fn every_search_obeys_held_parameters_and_narrower_ranges() {
    for search in ["least-squares --polish on", "pattern"] {
        let json = quick(&format!("--search {search} --fix f90=1,kd=.25,.1,.05 --bounds alpha=.3:.4"));
        assert_eq!(json["fixed"], json!({ "f90": 1.0, "kd": [0.25, 0.1, 0.05] }));
        assert_eq!(json["bounds"], json!({ "alpha": [0.3, 0.4] }));
        let candidates = json["candidates"].as_array().unwrap().iter();
        let polished = json.get("polished").filter(|polished| !polished.is_null());
        for parameters in candidates.chain(polished).map(|result| &result["parameters"]) {
            assert_eq!((&parameters["f90"], &parameters["kd"]), (&json!(1.0), &json!([0.25, 0.1, 0.05])));
            assert!((0.3..=0.4).contains(&number(&parameters["alpha"])), "{parameters}");
        }
        let state = &json["uncertainty"]["state"];
        assert_eq!((&state["f90"], &state["kd"]), (&json!("held"), &json!(["held", "held", "held"])));
        assert_ne!(state["f0"], json!(["held", "held", "held"]));
    }
}

/// The first table of stage one and that of the coarse picture have no sharp lobes.
#[test]
fn width_of_a_sharp_lobe_can_be_held() {
    for (flags, alpha) in
        [("--fix alpha=.01 --polish on", 0.01), ("--bounds alpha=.0101:.0103 --search pattern", 0.0102)]
    {
        let json = quick(&format!("--gammas 2 {flags}"));
        let polished = json.get("polished").filter(|polished| !polished.is_null());
        for result in json["candidates"].as_array().unwrap().iter().chain(polished) {
            assert!((number(&result["parameters"]["alpha"]) / alpha - 1.0).abs() < 0.01, "{flags}: {result}");
        }
    }
}

#[test]
fn progress_goes_to_stderr_in_the_requested_form() {
    let folder = folder();
    let flags = QUICK.replace("--progress none", "");
    let json = fit(folder.path(), "json", &format!("{flags} --progress json")).done();
    let events: Vec<Value> = json.stderr.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let finished = |kind: &str| events.iter().filter(|e| e["event"] == "node-finished" && e["kind"] == kind).count();
    assert_eq!((finished("search"), finished("select"), finished("polish"), finished("report")), (3, 1, 0, 1));
    assert_eq!(events.last().unwrap()["event"], "finished");
    let none = fit(folder.path(), "none", &format!("{flags} --progress none")).done();
    assert_eq!(none.stderr, "");
    let lines = fit(folder.path(), "auto", &flags).done();
    assert!(lines.stderr.contains("searches done") && !lines.stderr.contains('\x1b'), "{}", lines.stderr);
}
