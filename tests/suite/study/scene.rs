//! A measured material, a light, and a study of them.

use crate::program::{Answer, lookalike, write_exr};
use lookalike::brdf::{CookTorrance, Material};
use lookalike_tests::{merl, scene::synthetic};
use serde_json::Value;
use std::{fs, path::Path};
use tempfile::TempDir;

/// The small preset: every method on one material under one light. Photos of 16 x 16 pixels, and with `--features slow` of 32 x 32
/// pixels and every experiment.
pub(crate) fn preset() -> String {
    let base = "materials = ['paint.binary']\nprobes = ['room.exr']\nheld-out = ['dusk.exr']\nphoto-samples = 64\n";
    let rest = match cfg!(feature = "slow") {
        true => {
            "experiments = ['methods', 'held-out', 'low-resolution', 'samples']\nsize = 32\n\
             low-resolutions = [16]\nfull-gammas = [1.0, 3.0]\n"
        }
        false => "experiments = ['methods']\nsize = 16\n",
    };
    format!("{base}{rest}")
}

/// A folder with `paint.binary`, `room.exr`, `dusk.exr` and `STUDY.toml`.
pub(crate) fn folder(study: &str) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let paint = Material::new(&CookTorrance, vec![0.3, 0.12, 0.08, 0.8, 0.8, 0.8, 0.06, 0.25]).unwrap();
    fs::write(folder.path().join("paint.binary"), merl::file_of(&paint)).unwrap();
    write_exr(&folder.path().join("room.exr"), &synthetic::room_at_dusk(16).to_image());
    write_exr(&folder.path().join("dusk.exr"), &synthetic::room(16).to_image());
    fs::write(folder.path().join("STUDY.toml"), study).unwrap();
    folder
}

/// Runs the study of a folder into its `out`, without a display unless `more` asks for one.
pub(crate) fn study(folder: &Path, more: &str) -> Answer {
    let display = if more.contains("--progress") { "" } else { "--progress none" };
    lookalike(folder, &format!("study STUDY.toml --out out {display} {more}"))
}

/// The rows of `results.json`, without fields that differ from run to run.
pub(crate) fn results(folder: &Path) -> Vec<Value> {
    let text = fs::read_to_string(folder.join("out/results.json")).unwrap();
    let mut rows: Vec<Value> = serde_json::from_str(&text).unwrap();
    for row in &mut rows {
        let seconds = row.as_object_mut().unwrap().remove("cpu_seconds").expect("every row has its cost");
        assert!(seconds.as_f64().is_some_and(|seconds| seconds > 0.0), "{row}: {seconds}");
    }
    rows
}
