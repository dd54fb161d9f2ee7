//! The real program on real files; shared by the modules of the suite.

use lookalike::image::{Image, openexr, png};
use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};

/// Exit code and output of the program.
#[derive(Debug)]
pub(crate) struct Answer {
    pub(crate) code: Option<i32>,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

/// Runs the program in a folder, with arguments separated by white space.
pub(crate) fn lookalike(folder: &Path, arguments: &str) -> Answer {
    run(Command::new(env!("CARGO_BIN_EXE_lookalike-under-test")).args(arguments.split_whitespace()).current_dir(folder))
}

/// As [`lookalike`], on a given number of threads.
pub(crate) fn lookalike_on_threads(folder: &Path, threads: usize, arguments: &str) -> Answer {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lookalike-under-test"));
    command.env("RAYON_NUM_THREADS", threads.to_string());
    run(command.args(arguments.split_whitespace()).current_dir(folder))
}

fn run(command: &mut Command) -> Answer {
    let Output { status, stdout, stderr } = command.env_remove("RUST_LOG").output().expect("the binary starts");
    let text = |bytes| String::from_utf8(bytes).expect("output is UTF-8");
    Answer { code: status.code(), stdout: text(stdout), stderr: text(stderr) }
}

impl Answer {
    /// Asserts exit code 0.
    #[track_caller]
    pub(crate) fn done(self) -> Self {
        assert_eq!(self.code, Some(0), "{}", self.stderr);
        self
    }

    /// Asserts that the input was refused: code 2, nothing on stdout, each phrase on stderr, and no panic.
    #[track_caller]
    pub(crate) fn refused(&self, phrases: &[&str]) {
        assert!(!self.stderr.contains("panicked"), "{}", self.stderr);
        assert_eq!(self.code, Some(2), "{}", self.stderr);
        assert_eq!(self.stdout, "");
        assert!(self.stderr.starts_with("error: ") && !self.stderr.contains('\x1b'), "{}", self.stderr);
        for phrase in phrases {
            assert!(self.stderr.contains(phrase), "expected {phrase:?} in: {}", self.stderr);
        }
    }
}

/// An image from a function of column and row.
pub(crate) fn image(width: usize, height: usize, pixel: impl Fn(usize, usize) -> [f32; 3]) -> Image {
    Image::from_pixels(width, height, (0..width * height).map(|i| pixel(i % width, i / width)).collect())
}

/// Writes OpenEXR without alpha or metadata.
pub(crate) fn write_exr(path: &Path, image: &Image) {
    fs::write(path, openexr::write(image, None, &[]).unwrap()).unwrap();
}

/// Writes PNG.
pub(crate) fn write_png(path: &Path, image: &Image) {
    fs::write(path, png::write(image, &[]).unwrap()).unwrap();
}

/// A MERL file of one value, 1/sr.
pub(crate) fn write_merl(path: &Path, [r, g, b]: [f64; 3]) {
    let mut bytes: Vec<u8> = [90_i32, 90, 180].iter().flat_map(|n| n.to_le_bytes()).collect();
    for stored in [r * 1500.0, g * 1500.0 / 1.15, b * 1500.0 / 1.66] {
        bytes.extend(std::iter::repeat_n(stored.to_le_bytes(), 90 * 90 * 180).flatten());
    }
    fs::write(path, bytes).unwrap();
}

/// The folder of real input; `None`, with a message, where it does not exist.
pub(crate) fn data() -> Option<PathBuf> {
    let beside = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data"));
    let data = std::env::var_os("LOOKALIKE_DATA").map_or(beside, PathBuf::from);
    if data.join("probes").is_dir() && data.join("materials").is_dir() {
        return Some(data);
    }
    println!("skipped: no probes and materials in {}; set LOOKALIKE_DATA", data.display());
    None
}
