//! A small photo under a small map, and the results of fits of them.

use crate::program::{Answer, image, lookalike, write_exr};
use lookalike::{
    brdf::{CookTorrance, Material},
    image::{Decoded, Image, decode},
    light::{Environment, LightDistribution},
    render::image::Shot,
    scene::{Camera, Circle, Geometry},
};
use serde_json::Value;
use std::{
    fs::{self, Permissions},
    path::Path,
    sync::{Arc, OnceLock},
};
use tempfile::TempDir;

/// Columns and rows of the photo.
pub(crate) const SIZE: usize = 32;

/// A cheap fit: few pixels, few gammas, no polish, one worker.
pub(crate) const QUICK: &str = "--model ggx --samples 32 --gammas 1:2:0.5 --workers 1 --progress none --polish off";

/// The same with polish.
pub(crate) const QUICK_POLISHED: &str = "--model ggx --samples 32 --gammas 1:2:0.5 --workers 1 --progress none";

/// A folder with `photo.exr` and `map.exr`.
pub(crate) fn folder() -> TempDir {
    static PHOTO: OnceLock<Image> = OnceLock::new();
    folder_with(PHOTO.get_or_init(|| photo(SIZE)))
}

/// As [`folder`], with a photo of another size.
pub(crate) fn folder_of_size(size: usize) -> TempDir {
    folder_with(&photo(size))
}

fn folder_with(photo: &Image) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    write_exr(&folder.path().join("photo.exr"), photo);
    write_exr(&folder.path().join("map.exr"), &map());
    folder
}

/// A sky with a lamp and a darker, warmer ground.
fn map() -> Image {
    image(32, 16, |column, row| match (column, row) {
        (18..20, 4..6) => [40.0, 36.0, 30.0],
        (_, ..8) => [0.5, 0.6, 0.8 + 0.02 * column as f32],
        _ => [0.25, 0.2, 0.1],
    })
}

/// A plastic whose lobe ggx cannot express, with the noise of 256 samples.
fn photo(size: usize) -> Image {
    let light = LightDistribution::new(Arc::new(Environment::new(map()).unwrap()));
    let geometry = Geometry::sphere(size, size, Circle::inscribed(size, size), Camera::Orthographic).unwrap();
    let paint = Material::new(&CookTorrance, vec![0.3, 0.12, 0.08, 0.8, 0.8, 0.8, 0.06, 0.2]).unwrap();
    Shot { geometry: &geometry, light: &light, reflectance: &paint, samples: 256, seed: 11 }.render(|| ()).image
}

/// The results of a fit that many tests start from. It runs once in this process; each test gets a copy of its files.
pub(crate) struct Finished {
    flags: &'static str,
    files: OnceLock<Vec<(String, Vec<u8>, Permissions)>>,
}

/// The fit of [`QUICK`].
pub(crate) static QUICK_FIT: Finished = Finished::new(QUICK);

/// The fit of [`QUICK_POLISHED`].
pub(crate) static POLISHED: Finished = Finished::new(QUICK_POLISHED);

/// Four shards, the coarse table, six searches, one full table, judging, pictures: at least 14 nodes.
pub(crate) const MANY_NODES: &str = "--model ggx --samples 128 --gammas 1:2:0.2 --seed 5 --polish off --workers 2";

/// The fit of [`MANY_NODES`].
pub(crate) static MANY_NODES_FIT: Finished = Finished::new(MANY_NODES);

impl Finished {
    /// The fit of [`folder`] with these flags.
    pub(crate) const fn new(flags: &'static str) -> Self {
        Self { flags, files: OnceLock::new() }
    }

    /// Copies its folder of results to `out`.
    pub(crate) fn copy_to(&self, out: &Path) {
        fs::create_dir_all(out).unwrap();
        for (name, bytes, permissions) in self.files.get_or_init(|| self.run()) {
            fs::write(out.join(name), bytes).unwrap();
            fs::set_permissions(out.join(name), permissions.clone()).unwrap();
        }
    }

    /// A folder with `photo.exr`, `map.exr` and a copy of its results in `out`.
    pub(crate) fn copy(&self) -> TempDir {
        let folder = folder();
        self.copy_to(&folder.path().join("out"));
        folder
    }

    /// Its `fit.json`.
    pub(crate) fn json(&self) -> Value {
        fit_json(&self.copy().path().join("out"))
    }

    fn run(&self) -> Vec<(String, Vec<u8>, Permissions)> {
        let folder = folder();
        // `--resume` starts a run where no run can be resumed.
        fit(folder.path(), "out", &format!("{} --resume", self.flags)).done();
        let entries = fs::read_dir(folder.path().join("out")).unwrap().map(Result::unwrap);
        let file = |entry: fs::DirEntry| {
            let name = entry.file_name().into_string().unwrap();
            (name, fs::read(entry.path()).unwrap(), entry.metadata().unwrap().permissions())
        };
        entries.filter(|entry| entry.path().is_file()).map(file).collect()
    }
}

/// Fits `photo.exr` under `map.exr` into the folder `out`.
pub(crate) fn fit(folder: &Path, out: &str, flags: &str) -> Answer {
    lookalike(folder, &format!("fit photo.exr --env map.exr --out {out} {flags}"))
}

/// The `fit.json` of a fit with the flags of [`QUICK`] and these, which take precedence.
pub(crate) fn quick(flags: &str) -> Value {
    let folder = folder();
    fit(folder.path(), "out", &format!("{QUICK} {flags}")).done();
    fit_json(&folder.path().join("out"))
}

/// The content of `fit.json` in a folder of results.
pub(crate) fn fit_json(out: &Path) -> Value {
    serde_json::from_slice(&fs::read(out.join("fit.json")).unwrap()).unwrap()
}

/// The text of `fit.json` without `timing`, which must exist.
pub(crate) fn without_timing(out: &Path) -> String {
    let mut json = fit_json(out);
    json.as_object_mut().unwrap().remove("timing").expect("a timing block");
    serde_json::to_string_pretty(&json).unwrap()
}

pub(crate) fn picture(path: &Path) -> Decoded {
    decode("result", &fs::read(path).unwrap()).unwrap()
}

pub(crate) fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("not a number: {value}"))
}
