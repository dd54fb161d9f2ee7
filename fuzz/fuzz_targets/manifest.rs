//! The manifest of a batch: any text gives a list of fits or an error.
#![no_main]

use libfuzzer_sys::fuzz_target;
use std::{cell::LazyCell, fs};
use tempfile::TempDir;

thread_local! {
    static FOLDER: LazyCell<TempDir> = LazyCell::new(|| {
        let folder = tempfile::tempdir().expect("a temporary folder");
        for name in ["gold.exr", "tin.exr", "sky.hdr"] {
            fs::write(folder.path().join(name), "").expect("an input file");
        }
        folder
    });
}

fuzz_target!(|text: &str| {
    // Only patterns inside this folder: others may search the whole disk, which takes too long.
    if text.contains(['/', '\\']) || text.contains("..") || text.contains("**") {
        return;
    }
    FOLDER.with(|folder| {
        let path = folder.path().join("manifest.toml");
        fs::write(&path, text).expect("an input file");
        match lookalike_app::fuzzing::manifest(&path) {
            Ok(fits) => assert!(fits > 0),
            Err(error) => assert!(error.contains("manifest.toml"), "does not name its file: {error}"),
        }
    });
});
