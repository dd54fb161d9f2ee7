//! `lookalike batch` from end to end: the real program, its worker processes and its files, on small scenes.

mod ending;
mod manifest;
mod others;
mod outputs;
mod resume;
mod same_bits;
mod watching;

use crate::{
    fit::scene,
    program::{Answer, image, lookalike, write_exr},
};
use serde_json::Value;
use std::{fs, path::Path};
use tempfile::TempDir;

/// Columns and rows of the photos.
const SIZE: usize = 24;

/// Settings of a cheap fit.
const QUICK: &str = "model = 'ggx'\nsamples = 16\ngammas = '1:2:0.5'\npolish = false\n";

/// A folder with two photos of one scene (`photo.exr`, and `red.exr`, the same through a red glass), one that is too small to be
/// judged (`tiny.exr`: its fit fails in the run), the light `map.exr` and a manifest.
fn folder(manifest: &str) -> TempDir {
    let folder = scene::folder_of_size(SIZE);
    let photo = scene::picture(&folder.path().join("photo.exr")).image;
    let (width, height) = (photo.width(), photo.height());
    let red = image(width, height, |c, r| {
        let [red, green, blue] = photo.pixel(c, r);
        [red, 0.5 * green, 0.3 * blue]
    });
    write_exr(&folder.path().join("red.exr"), &red);
    write_exr(&folder.path().join("tiny.exr"), &image(10, 10, |c, _| [0.1 + 0.01 * c as f32; 3]));
    fs::write(folder.path().join("batch.toml"), manifest).unwrap();
    folder
}

fn batch(folder: &TempDir, out: &str, flags: &str) -> Answer {
    lookalike(folder.path(), &format!("batch batch.toml --out {out} --progress none {flags}"))
}

fn summary(out: &Path) -> Value {
    serde_json::from_slice(&fs::read(out.join("summary.json")).unwrap()).unwrap()
}

/// The states of the fits, in their order.
fn states(summary: &Value) -> Vec<String> {
    let fits = summary["fits"].as_array().unwrap();
    fits.iter().map(|fit| fit["state"].as_str().unwrap().to_owned()).collect()
}
