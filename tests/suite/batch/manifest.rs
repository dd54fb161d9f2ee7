//! Unusable manifests and inputs: refused with code 2 before any work, with all mistakes in one message.

use super::{QUICK, batch, folder};
use std::fs;

#[test]
fn mistakes_in_the_manifest_are_reported_with_their_lines() {
    let folder = folder("photos = 'none/*.exr'\nenvironments = 'map.exr'\n[defaults]\nsampels = 3\n");
    batch(&folder, "out", "").refused(&[
        "error: batch.toml: 2 problems",
        "batch.toml:4: unknown key \"sampels\"; the nearest one is \"samples\"",
        "batch.toml:1: no file matches \"none/*.exr\"",
    ]);
    assert!(!folder.path().join("out").exists());
}

#[test]
fn unusable_inputs_are_reported_together_with_the_fits_that_use_them() {
    let folder = folder(&format!(
        "photos = ['photo.exr', 'not-there.exr']\nenvironments = ['map.exr', 'photo.exr']\n[defaults]\n{QUICK}\
         [[fit]]\nname = 'masked'\nphoto = 'photo.exr'\nenv = 'map.exr'\nmask = 'tiny.exr'\n\
         [[fit]]\nname = 'measured'\nphoto = 'table.binary'\nenv = 'map.exr'\n"
    ));
    fs::write(folder.path().join("table.binary"), [90, 0, 0, 0, 90, 0, 0, 0, 180, 0, 0, 0]).unwrap();
    let answer = batch(&folder, "out", "--workers 1");
    answer.refused(&[
        "error: batch.toml: 4 problems",
        "batch.toml:1: not-there-map-ggx and one other: cannot use not-there.exr as the photo: there is no such file",
        "batch.toml:1: photo-photo-ggx: cannot use photo.exr as the environment map: ",
        "masked: cannot use tiny.exr as the mask: ",
        "measured: cannot use table.binary as the photo: ",
    ]);
    assert!(!folder.path().join("out/summary.json").exists());
}

#[test]
fn folder_of_an_earlier_batch_is_refused_and_unchanged() {
    let folder = folder(&format!("photos = 'photo.exr'\nenvironments = 'map.exr'\n[defaults]\n{QUICK}"));
    fs::create_dir(folder.path().join("out")).unwrap();
    fs::write(folder.path().join("out/summary.json"), "precious").unwrap();
    batch(&folder, "out", "")
        .refused(&["out/summary.json says that a batch was run there already", "--resume, choose another --out"]);
    assert_eq!(fs::read_to_string(folder.path().join("out/summary.json")).unwrap(), "precious");
}
