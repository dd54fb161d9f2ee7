//! The manifest of a batch: any text is a list of fits, or an error.
#![no_main]

use libfuzzer_sys::fuzz_target;
use std::{cell::LazyCell, fs};
use tempfile::TempDir;

thread_local! {
    static FOLDER: LazyCell<TempDir> = LazyCell::new(|| {
        let folder = tempfile::tempdir().expect("a temporary folder");
        for name in ["gold.exr", "tin.exr", "sky.hdr"] {
            fs::write(folder.path().join(name), "").expect("a file of ours");
        }
        folder
    });
}

fuzz_target!(|text: &str| {
    // Patterns are looked for in this folder alone: elsewhere they take as long as the disk is large.
    if text.contains(['/', '\\']) || text.contains("..") || text.contains("**") {
        return;
    }
    FOLDER.with(|folder| {
        let path = folder.path().join("manifest.toml");
        fs::write(&path, text).expect("a file of ours");
        match lookalike_app::fuzzing::manifest(&path) {
            Ok(fits) => assert!(fits > 0),
            Err(error) => assert!(error.contains("manifest.toml"), "does not name its file: {error}"),
        }
    });
});
