//! The summaries that a batch writes.

use super::{QUICK, batch, folder, scene, summary};
use serde_json::json;
use std::fs;

#[test]
fn summaries_have_the_numbers_of_every_fit() {
    let folder = folder(&format!(
        "photos = 'photo.exr'\nenvironments = 'map.exr'\nmodels = ['ggx', 'cook-torrance']\n[defaults]\n{QUICK}"
    ));
    let answer = batch(&folder, "out", "--workers 2").done();
    let out = folder.path().join("out");
    let summary = summary(&out);
    assert_eq!((&summary["schema"], &summary["state"]), (&json!("lookalike.batch/1"), &json!("finished")));
    assert_eq!(summary["count"], json!({ "total": 2, "running": 0, "done": 2, "missed": 0, "failed": 0 }));
    let csv = fs::read_to_string(out.join("summary.csv")).unwrap();
    let lines: Vec<Vec<&str>> = csv.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(lines.len(), 3, "{csv}");
    let cell = |row: usize, column: &str| lines[row][lines[0].iter().position(|name| *name == column).unwrap()];
    for (row, model) in [(1, "ggx"), (2, "cook-torrance")] {
        let fit = &summary["fits"][row - 1];
        let json = scene::fit_json(&out.join(format!("photo-map-{model}")));
        let won = &json["stage_two"];
        for name in ["cssim", "cssim_object", "gamma", "parameters"] {
            assert_eq!(fit[name], won[name], "{name} of {model}");
        }
        assert_eq!(
            (cell(row, "name"), cell(row, "model"), cell(row, "photo")),
            (fit["name"].as_str().unwrap(), model, "photo.exr")
        );
        assert_eq!(cell(row, "cssim").parse::<f64>().unwrap(), scene::number(&won["cssim"]));
        assert_eq!(cell(row, "kd.g").parse::<f64>().unwrap(), scene::number(&won["parameters"]["kd"][1]));
        assert_eq!((cell(row, "polished"), &fit["polished"]), ("false", &json!(false)));
        assert!(scene::number(&fit["seconds"]) > 0.0 && scene::number(&json["timing"]["seconds"]["stage one"]) >= 0.0);
        let timed = &json["timing"];
        assert_eq!(
            (&timed["out"], timed["attempts"].as_u64().unwrap() > 3),
            (&json!(format!("out/photo-map-{model}")), true)
        );
        assert!(answer.stdout.contains(&format!("photo-map-{model}")), "{}", answer.stdout);
    }
    assert_eq!((cell(1, "m"), cell(2, "alpha")), ("", ""));
    let names: Vec<String> =
        fs::read_dir(&out).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    assert!(names.iter().all(|name| !name.ends_with(".partial")), "{names:?}");
}
