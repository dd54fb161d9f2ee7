//! `lookalike compare` on the command line.

use crate::program::{Answer, image, lookalike, write_exr, write_png};
use lookalike::{
    choice::Choice as _,
    image::{Image, decode, metadata as keys, openexr, png},
    metric::{Judge, JudgeOptions, MetricKind},
};
use serde_json::Value;
use std::{fs, path::Path};

/// A disk of 40 x 36 pixels over black.
fn ball(tint: f32) -> Image {
    image(40, 36, |column, row| {
        let (x, y) = (column as f32 - 19.5, row as f32 - 17.5);
        let inside = x * x + y * y < 14.0 * 14.0;
        if inside { [0.2 + 0.02 * (x + 14.0), 0.3, 0.1 + tint] } else { [0.0; 3] }
    })
}

fn disk() -> Vec<f32> {
    ball(0.0).pixels().iter().map(|pixel| if pixel[1] > 0.0 { 1.0 } else { 0.0 }).collect()
}

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    write_exr(&folder.path().join("a.exr"), &ball(0.0));
    write_exr(&folder.path().join("b.exr"), &ball(0.2));
    folder
}

fn json(answer: &Answer) -> Value {
    serde_json::from_str(&answer.stdout).unwrap_or_else(|error| panic!("{error}: {}", answer.stdout))
}

#[test]
fn equal_images_score_zero() {
    let folder = folder();
    for (_, metric, _) in MetricKind::TABLE {
        let answer = lookalike(folder.path(), &format!("compare a.exr a.exr --json --metric {metric}")).done();
        let json = json(&answer);
        assert_eq!((json["metric"].as_str(), json["score"].as_f64()), (Some(*metric), Some(0.0)));
        assert_eq!((json["score_object"].as_f64(), answer.stderr.as_str()), (Some(0.0), ""));
    }
}

#[test]
fn score_is_that_of_the_library() {
    let folder = folder();
    let found = json(&lookalike(folder.path(), "compare a.exr b.exr --json --display-exposure 1.5").done());
    let judge = Judge::new(&ball(0.0), &[1.0; 1440], 1.5, &JudgeOptions::default()).unwrap();
    let expected = judge.score(&ball(0.2)).unwrap();
    assert_eq!(found["score"].as_f64(), Some(expected.cssim));
    assert_eq!(found["score_object"].as_f64(), Some(expected.cssim_object));
    for (name, value) in ["lightness", "contrast", "structure", "chroma", "hue"].into_iter().zip(expected.features) {
        assert_eq!(found["features"][name].as_f64(), Some(value), "{name}");
    }
    assert_eq!((found["display_exposure"].as_f64(), found["object"].as_str()), (Some(1.5), Some("image")));
    assert_eq!((found["width"].as_u64(), found["height"].as_u64()), (Some(40), Some(36)));
    assert_eq!(found["reference"]["path"], "a.exr");
    assert_eq!(found["image"]["blake3"].as_str().unwrap().len(), 64);
}

#[test]
fn mask_excludes_the_background() {
    let folder = folder();
    let mut dirty = ball(0.0);
    dirty.pixels_mut().iter_mut().filter(|pixel| pixel[1] == 0.0).for_each(|pixel| *pixel = [0.7, f32::NAN, 0.1]);
    write_exr(&folder.path().join("dirty.exr"), &dirty);
    write_png(&folder.path().join("mask.png"), &image(40, 36, |c, r| [disk()[r * 40 + c]; 3]));
    let found = json(&lookalike(folder.path(), "compare a.exr dirty.exr --mask mask.png --json").done());
    assert_eq!((found["score"].as_f64(), found["object"].as_str()), (Some(0.0), Some("mask")));
    assert_eq!(found["mask"]["path"], "mask.png");
    lookalike(folder.path(), "compare a.exr dirty.exr").refused(&[
        "cannot compare a.exr and dirty.exr",
        "found NaN in channel 1 at column 0, row 0",
        "with a mask",
    ]);
}

#[test]
fn alpha_over_black_marks_the_object_and_keeps_the_score() {
    let folder = folder();
    let bytes = openexr::write(&ball(0.2), Some(&disk()), &[]).unwrap();
    fs::write(folder.path().join("alpha.exr"), bytes).unwrap();
    let [plain, alpha] =
        ["b.exr", "alpha.exr"].map(|b| json(&lookalike(folder.path(), &format!("compare a.exr {b} --json")).done()));
    assert_eq!((plain["object"].as_str(), alpha["object"].as_str()), (Some("image"), Some("alpha")));
    assert_eq!(plain["score"], alpha["score"]);
    println!("image {}, object {}", alpha["score"], alpha["score_object"]);
    assert_ne!(alpha["score_object"], plain["score_object"]);
}

#[test]
fn exposure_is_a_value_automatic_or_from_an_earlier_run() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    fs::write(at("fit.json"), r#"{"schema": "lookalike.fit/1", "display_exposure": 1.75}"#).unwrap();
    let metadata = [(keys::DISPLAY_EXPOSURE.to_owned(), "2.5".to_owned())];
    fs::write(at("match.exr"), openexr::write(&ball(0.0), None, &metadata).unwrap()).unwrap();
    fs::write(at("match.png"), png::write(&ball(0.0), &metadata).unwrap()).unwrap();
    let exposure = |flag: &str| {
        let flags = format!("compare a.exr b.exr --json {flag}");
        json(&lookalike(folder.path(), &flags).done())["display_exposure"].as_f64().unwrap()
    };
    assert_eq!(exposure(""), 1.0);
    assert_eq!(exposure("--display-exposure 0.5"), 0.5);
    assert_eq!(exposure("--display-exposure from:fit.json"), 1.75);
    assert_eq!(exposure("--display-exposure from:match.exr"), 2.5);
    assert_eq!(exposure("--display-exposure from:match.png"), 2.5);
    // Pixel 1397 of the 1440 in ascending order determines it: 43 of the 616 pixels of the disk are brighter.
    let auto = exposure("--display-exposure auto");
    assert!(auto > 1.0 && auto < 2.0, "{auto}");

    fs::write(at("other.json"), r#"{"display_exposure": null}"#).unwrap();
    for (file, phrase) in [
        ("other.json", "expected a \"display_exposure\" above 0, found null"),
        ("a.exr", "lookalike.displayExposure"),
        ("nothing.json", "there is no such file"),
    ] {
        lookalike(folder.path(), &format!("compare a.exr b.exr --display-exposure from:{file}"))
            .refused(&[&format!("cannot use {file} as the source of the display exposure"), phrase]);
    }
}

#[test]
fn display_values_are_decoded_and_mixing_them_with_radiance_is_warned_of() {
    let folder = folder();
    write_png(&folder.path().join("a.png"), &ball(0.0));
    write_png(&folder.path().join("b.png"), &ball(0.2));
    let both = lookalike(folder.path(), "compare a.png b.png --json").done();
    let linear = lookalike(folder.path(), "compare a.exr b.exr --json").done();
    let (shown, radiance) = (json(&both)["score"].as_f64().unwrap(), json(&linear)["score"].as_f64().unwrap());
    // The PNGs have eight bits.
    assert!((shown / radiance - 1.0).abs() < 0.02 && both.stderr.is_empty(), "{shown} {radiance} {}", both.stderr);
    let mixed = lookalike(folder.path(), "compare a.exr b.png").done();
    assert!(mixed.stderr.contains("warning: b.png holds display values, a.exr radiance"), "{}", mixed.stderr);
    let exposed = lookalike(folder.path(), "compare a.png b.png --display-exposure 2").done();
    assert!(exposed.stderr.contains("on top of the exposure they were made at"), "{}", exposed.stderr);
}

#[test]
fn map_shows_where_the_images_differ() {
    let folder = folder();
    let mut half = ball(0.0);
    half.pixels_mut().iter_mut().enumerate().filter(|(i, p)| i % 40 > 24 && p[1] > 0.0).for_each(|(_, p)| p[2] += 0.4);
    write_exr(&folder.path().join("half.exr"), &half);
    for (_, metric, _) in MetricKind::TABLE {
        let flags = format!("compare a.exr half.exr --metric {metric} --map map.png");
        let answer = lookalike(folder.path(), &flags).done();
        assert!(answer.stderr.contains("wrote map.png (black: no difference"), "{}", answer.stderr);
        let map = read(&folder.path().join("map.png"));
        assert_eq!((map.width(), map.height()), (40, 36));
        let bright = |column: usize| map.pixel(column, 18).iter().sum::<f32>();
        assert!(bright(29) > 5.0 * bright(9), "{metric}: {} {}", bright(29), bright(9));
    }
    lookalike(folder.path(), "compare a.exr b.exr --map map.exr").refused(&["cannot write map.exr", "ends in .png"]);
    lookalike(folder.path(), "compare a.exr b.exr --map no/map.png").refused(&["the folder no does not exist"]);
}

fn read(path: &Path) -> Image {
    decode("map", &fs::read(path).unwrap()).unwrap().image
}

#[test]
fn score_of_the_object_comes_first() {
    let folder = folder();
    fs::write(folder.path().join("alpha.exr"), openexr::write(&ball(0.2), Some(&disk()), &[]).unwrap()).unwrap();
    let found = json(&lookalike(folder.path(), "compare a.exr alpha.exr --json").done());
    let table = lookalike(folder.path(), "compare a.exr alpha.exr").done().stdout;
    let line = |start: &str| table.lines().find(|line| line.trim_start().starts_with(start)).expect(start).to_owned();
    assert_eq!(line("on ").trim(), "on object   on image");
    let scores = [&found["score_object"], &found["score"]].map(|score| format!("{:.6}", score.as_f64().unwrap()));
    assert_ne!(scores[0], scores[1]);
    assert_eq!(line("cssim  ").split_whitespace().skip(1).collect::<Vec<_>>(), scores);
}

#[test]
fn default_output_is_a_table_of_the_five_features() {
    let folder = folder();
    let answer = lookalike(folder.path(), "compare a.exr b.exr").done();
    for phrase in ["cssim of b.exr against a.exr", "lightness ", "contrast ", "structure ", "chroma ", "hue "] {
        assert!(answer.stdout.contains(phrase), "{}", answer.stdout);
    }
    assert!(answer.stdout.contains("display exposure: 1 ("), "{}", answer.stdout);
    let icid = lookalike(folder.path(), "compare a.exr b.exr --metric icid").done();
    assert!(icid.stdout.contains("icid of b.exr") && !icid.stdout.contains("chroma"), "{}", icid.stdout);
}
