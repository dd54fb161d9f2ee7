//! The files and output of a fit, as specified in design section 10.

use super::scene::{POLISHED, QUICK, QUICK_FIT, SIZE, fit, fit_json, folder, number, picture};
use crate::program::lookalike;
use lookalike::image::{Encoding, content_hash, metadata as keys};
use serde_json::{Value, json};
use std::fs;

const COLOURS: [&str; 2] = ["kd", "f0"];

/// Asserts that these are parameters of `ggx` within their bounds.
#[track_caller]
fn check_ggx(parameters: &Value) {
    for name in COLOURS {
        let colour = parameters[name].as_array().unwrap();
        assert_eq!(colour.len(), 3);
        let most = if name == "kd" { 1.0 } else { 2.0 };
        assert!(colour.iter().all(|x| (0.0..=most).contains(&number(x))), "{parameters}");
    }
    assert!((0.0..=2.0).contains(&number(&parameters["f90"])), "{parameters}");
    assert!((0.005..=1.0).contains(&number(&parameters["alpha"])), "{parameters}");
    assert_eq!(parameters.as_object().unwrap().len(), 4);
}

#[test]
fn every_model_that_was_tried_is_in_fit_json_with_the_reason() {
    let folder = folder();
    let answer = fit(folder.path(), "out", "--samples 32 --gammas 1:3:1 --workers 2 --progress none").done();
    let json = fit_json(&folder.path().join("out"));
    let models = json["models"].as_array().unwrap();
    let tried: Vec<(&Value, &Value)> = models.iter().map(|tried| (&tried["model"], &tried["fixed"])).collect();
    let (ggx, haze) = (json!("ggx"), json!("ggx-haze"));
    assert_eq!(tried, [(&ggx, &json!({ "f90": 1.0 })), (&ggx, &json!({})), (&haze, &json!({}))]);
    let chosen: Vec<&Value> = models.iter().filter(|tried| tried["chosen"] == true).collect();
    let [chosen] = chosen[..] else { panic!("{models:?}") };
    assert_eq!((&json["model"], &json["fixed"]), (&chosen["model"], &chosen["fixed"]));
    assert_eq!(
        (&json["polished"]["cssim"], &json["polished"]["parameters"]),
        (&chosen["cssim"], &chosen["parameters"])
    );
    assert!(answer.stdout.contains("\n  model") && answer.stdout.contains("chosen: "), "{}", answer.stdout);
    // Simpler ones than the chosen one are worse than the best by more than the tolerance, those given up by three times it.
    for (i, tried) in models.iter().enumerate() {
        let of_best = |name: &str| number(&tried["above_best"][name]);
        let (is_given_up, is_before) =
            (tried["coarse"] == true, models[..i].iter().all(|other| other["chosen"] == false));
        let least = if is_given_up { 3.0 } else { 1.0 };
        let is_worse = of_best("difference") > least * of_best("tolerance");
        let is_excluded = is_given_up || (is_before && tried["chosen"] == false);
        assert!(!is_excluded || is_worse, "{tried}");
        assert!(tried["chosen"] == false || (!is_given_up && of_best("difference") <= of_best("tolerance")), "{tried}");
        let why = tried["why"].as_str().unwrap();
        assert_eq!(why.starts_with("given up on a coarse picture"), is_given_up, "{why}");
    }
    let verdict = json["verdict"].as_str().unwrap();
    assert!(answer.stdout.contains(&format!("verdict: {verdict} (")), "{}", answer.stdout);
}

#[test]
fn fit_json_has_the_documented_fields() {
    let folder = folder();
    let answer = fit(folder.path(), "out", "--model ggx --samples 32 --workers 2 --seed 3 --progress none").done();
    let json = fit_json(&folder.path().join("out"));
    for (name, expected) in [
        ("schema", json!("lookalike.fit/1")),
        ("model", json!("ggx")),
        ("samples", json!(32)),
        ("seed", json!(3)),
        ("search", json!("least-squares")),
        ("exposure_gain", json!([1.0, 1.0, 1.0])),
    ] {
        assert_eq!(json[name], expected, "{name}");
    }
    assert!(number(&json["display_exposure"]) > 0.0);
    assert!(json["conventions"]["world"].as_str().unwrap().contains("+Y up"));
    for (role, file) in [("photo", "photo.exr"), ("environment", "map.exr")] {
        let hash = content_hash(&picture(&folder.path().join(file)).image).to_hex().to_string();
        assert_eq!((&json["inputs"][role]["path"], &json["inputs"][role]["blake3"]), (&json!(file), &json!(hash)));
    }

    let candidates = json["candidates"].as_array().unwrap();
    assert_eq!(candidates.len(), 21);
    for (i, candidate) in candidates.iter().enumerate() {
        assert_eq!(number(&candidate["gamma"]), (10 + i) as f64 / 10.0);
        for name in ["cost", "cssim", "cssim_object"] {
            assert!(number(&candidate[name]) > 0.0, "{name}: {candidate}");
        }
        assert!(candidate["evaluations"].as_u64().unwrap() > 0 && candidate["termination"].is_string());
        check_ggx(&candidate["parameters"]);
    }
    let lowest = candidates.iter().map(|c| number(&c["cssim"])).fold(f64::INFINITY, f64::min);
    let stage_two = &json["stage_two"];
    assert_eq!(number(&stage_two["cssim"]), lowest);
    let won = candidates.iter().find(|c| c["gamma"] == stage_two["gamma"]).unwrap();
    for name in ["cssim", "cssim_object", "parameters"] {
        assert_eq!(won[name], stage_two[name]);
    }
    let uncertainty = &json["uncertainty"];
    assert_eq!(uncertainty["state"]["kd"], json!(["determined", "determined", "determined"]), "{uncertainty}");
    let kd =
        [&uncertainty["low"], &json["polished"]["parameters"], &uncertainty["high"]].map(|of| number(&of["kd"][0]));
    assert!(kd[0] < kd[1] && kd[1] < kd[2] && kd[2] < 1.5 * kd[0], "{kd:?}");
    assert!(uncertainty["state"]["alpha"].is_string() && uncertainty["low"]["f0"].is_array(), "{uncertainty}");
    assert!(answer.stdout.contains("95 % range"), "{}", answer.stdout);
    let open = uncertainty.to_string().contains("undetermined");
    assert_eq!(answer.stdout.contains("the photo does not determine"), open, "{}", answer.stdout);
    let polished = &json["polished"];
    assert!(number(&polished["cssim"]) <= lowest && number(&polished["cssim_object"]) > 0.0);
    // Twice the limit, because polish may restart from the winner.
    let most = 2 * lookalike::fit::MAX_EVALUATIONS as u64;
    assert!((1..=most).contains(&polished["evaluations"].as_u64().unwrap()));
    assert!(polished["explored"].as_u64().unwrap() > 0);
    check_ggx(&polished["parameters"]);
    for (name, kind) in [("seconds", "inputs"), ("cpu_seconds", "coordinator")] {
        assert!(number(&json["timing"][name][kind]) >= 0.0, "{}", json["timing"]);
    }
    assert_eq!(json["timing"]["workers"], 2);

    for phrase in ["gamma", "stage two", "polished", "alpha", "seconds: inputs", "results: out"] {
        assert!(answer.stdout.contains(phrase), "{}", answer.stdout);
    }
}

/// The page has the settings of the method in the order of `Method::settings`.
#[test]
fn fit_json_has_the_fields_of_its_page_in_their_order() {
    let page = include_str!("../../../docs/fit-json.md");
    let table = page.lines().skip_while(|line| !line.starts_with("| field |")).skip(2);
    let rows = table.map_while(|row| row.strip_prefix("| `")?.split('`').next());
    let json = QUICK_FIT.json();
    let fields = json.as_object().unwrap().keys().map(String::as_str);
    assert_eq!(rows.collect::<Vec<_>>(), fields.collect::<Vec<_>>());
}

#[test]
fn candidates_csv_has_the_numbers_of_fit_json() {
    let folder = folder();
    fit(folder.path(), "out", &format!("{QUICK} --subsets 2")).done();
    let json = fit_json(&folder.path().join("out"));
    let text = fs::read_to_string(folder.path().join("out/candidates.csv")).unwrap();
    let mut lines = text.lines();
    let header = "gamma,subset,cost,cssim,cssim_object,evaluations,termination,kd.r,kd.g,kd.b,f0.r,f0.g,f0.b,f90,alpha";
    assert_eq!(lines.next(), Some(header));
    let rows: Vec<Vec<&str>> = lines.map(|line| line.split(',').collect()).collect();
    let candidates = json["candidates"].as_array().unwrap();
    assert_eq!((rows.len(), candidates.len()), (6, 6));
    for candidate in candidates {
        let is_of = |row: &str, name: &str| row.parse::<f64>().unwrap() == number(&candidate[name]);
        let row = rows.iter().find(|row| is_of(row[0], "gamma") && is_of(row[1], "subset")).unwrap();
        let parameters = &candidate["parameters"];
        for (column, expected) in
            [(2, &candidate["cost"]), (3, &candidate["cssim"]), (8, &parameters["kd"][1]), (14, &parameters["alpha"])]
        {
            assert_eq!(row[column].parse::<f64>().unwrap(), number(expected), "column {column}");
        }
    }
}

#[test]
fn pictures_have_the_size_of_the_photo_and_describe_themselves_in_metadata() {
    let folder = POLISHED.copy();
    let out = folder.path().join("out");
    for file in ["match.exr", "match.png", "reference.png", "difference.png"] {
        let decoded = picture(&out.join(file));
        assert_eq!((decoded.image.width(), decoded.image.height()), (SIZE, SIZE), "{file}");
    }
    let matched = picture(&out.join("match.exr"));
    let json = fit_json(&out);
    let entry = |key: &str| matched.metadata.iter().find(|(k, _)| k == key).map(|(_, value)| value.clone());
    assert_eq!(entry(keys::MODEL).as_deref(), Some("ggx"));
    assert_eq!(entry(keys::DISPLAY_EXPOSURE), Some(json["display_exposure"].to_string()));
    let parameters: Value = serde_json::from_str(&entry(keys::PARAMETERS).unwrap()).unwrap();
    assert_eq!(parameters, json["polished"]["parameters"]);

    // The displayed pictures are the linear ones after exposure, up to half a code and the clipping at white.
    let shown = picture(&out.join("match.png"));
    assert_eq!(shown.encoding, Encoding::Srgb);
    let exposure = number(&json["display_exposure"]);
    for (shown, linear) in shown.image.pixels().iter().flatten().zip(matched.image.pixels().iter().flatten()) {
        let expected = (f64::from(*linear) * exposure).clamp(0.0, 1.0);
        assert!((f64::from(*shown) - expected).abs() < 0.005, "{shown} {expected}");
    }
    // Outside the object all pixels are black, inside none is.
    assert_eq!(matched.image.pixel(0, 0), [0.0; 3]);
    assert!(matched.image.pixel(SIZE / 2, SIZE / 2)[0] > 0.0);
}

#[test]
fn score_of_the_written_pictures_is_the_reported_score() {
    let folder = POLISHED.copy();
    let json = fit_json(&folder.path().join("out"));
    let exposure = &json["display_exposure"];
    let arguments = format!("compare photo.exr out/match.exr --display-exposure {exposure} --json");
    let answer = lookalike(folder.path(), &arguments).done();
    let compared: Value = serde_json::from_str(&answer.stdout).unwrap();
    let (found, expected) = (number(&compared["score"]), number(&json["polished"]["cssim"]));
    assert!((found - expected).abs() < 1e-6, "{found} {expected}");
}

#[test]
fn results_fit_in_100_columns_and_notes_stay_whole_in_fit_json() {
    let folder = folder();
    // The winner of two gammas is the first or the last, which gives a note if there is no polish.
    let fitted =
        fit(folder.path(), "out", "--model ggx --samples 32 --gammas 1:1.1:0.1 --polish off --workers 1").done();
    let notes = fit_json(&folder.path().join("out"))["notes"].as_array().unwrap().clone();
    assert!(notes.iter().any(|note| note.as_str().unwrap().len() > 100), "{notes:?}");
    let status = lookalike(folder.path(), "status out").done();
    let compared = lookalike(folder.path(), "compare out/reference.png out/match.png --map map.png").done();
    let rendered = lookalike(
        folder.path(),
        "render --env map.exr --model ggx --params kd=.5,f0=.04,alpha=.3 --size 16 --out a.png",
    )
    .done();
    for answer in [fitted, status, compared, rendered] {
        for line in answer.stdout.lines().chain(answer.stderr.lines()) {
            assert!(line.chars().count() <= 100, "{} columns: {line}", line.chars().count());
        }
    }
}
