//! Invalid studies: each mistake is named, with its file, and the exit code is 2.

use super::scene::{folder, study};
use std::fs;

#[test]
fn mistakes_are_named_with_their_file() {
    let base = "materials = ['paint.binary']\nprobes = ['room.exr']\n";
    for (text, phrases) in [
        ("materials = ['tin.binary']\nprobes = ['room.exr']".to_owned(), &["measured material", "tin.binary"][..]),
        ("materials = ['paint.binary']\nprobes = ['attic.hdr']".to_owned(), &["environment map", "attic.hdr"]),
        ("materials = ['room.exr']\nprobes = ['room.exr']".to_owned(), &["room.exr"]),
        (format!("{base}size = 8"), &["STUDY.toml", "between 16 and 512"]),
        (format!("{base}large-cells = [['tin', 'room']]"), &["STUDY.toml", "\"tin\" is not one of paint"]),
        (format!("{base}models = ['phong']"), &["STUDY.toml", "unknown model 'phong'"]),
        (format!("{base}sizes = [8]"), &["STUDY.toml", "unknown field `sizes`"]),
    ] {
        let folder = folder(&text);
        study(folder.path(), "--workers 1").refused(phrases);
    }
}

#[test]
fn study_with_other_settings_is_not_resumed() {
    let study_file = "materials = ['paint.binary']\nprobes = ['room.exr']\nexperiments = []\n";
    let folder = folder(study_file);
    study(folder.path(), "--workers 1").done();
    study(folder.path(), "--workers 1").refused(&["--resume"]);
    fs::write(folder.path().join("STUDY.toml"), format!("{study_file}seed = 1\n")).unwrap();
    study(folder.path(), "--workers 1 --resume").refused(&["the study"]);
}
