//! Reads a file, and describes it by its path and the hash of its content.

use anyhow::{Context, anyhow};
use lookalike::image::{Image, content_hash};
use serde_json::{Value, json};
use std::{
    fs,
    io::{self, ErrorKind},
    path::{Path, PathBuf},
};

/// A file that a result depends on: its path as given, and the BLAKE3 of its decoded content.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct InputFile {
    /// The path as the user gave it.
    pub path: PathBuf,
    /// 64 hexadecimal digits: the hash of the decoded pixels of an image, or of the bytes of a table.
    pub blake3: String,
}

impl InputFile {
    /// The file `path`, from which `image` was decoded.
    #[must_use]
    pub fn of_image(path: &Path, image: &Image) -> Self {
        Self { path: path.to_owned(), blake3: content_hash(image).to_hex().to_string() }
    }

    /// `{"path", "blake3"}`, as in `fit.json`.
    #[must_use]
    pub fn to_json(&self) -> Value {
        json!({ "path": self.path.to_string_lossy(), "blake3": self.blake3 })
    }
}

impl std::fmt::Display for InputFile {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} blake3:{}", self.path.display(), self.blake3)
    }
}

/// Reads a file and passes its name and bytes to `decode`. Any error names the role of the file.
pub(super) fn read_with<T, E>(
    path: &Path,
    role: &str,
    decode: impl FnOnce(&str, &[u8]) -> Result<T, E>,
) -> anyhow::Result<T>
where
    anyhow::Error: From<E>,
{
    let decoded = read(path).and_then(|bytes| Ok(decode(&path.to_string_lossy(), &bytes)?));
    decoded.with_context(|| cannot_use(path, role))
}

/// The heading of an error about a file.
pub(super) fn cannot_use(path: &Path, role: &str) -> String {
    format!("cannot use {} as the {role}", path.display())
}

fn read(path: &Path) -> anyhow::Result<Vec<u8>> {
    // Reading a folder fails with a message that depends on the system.
    if path.is_dir() {
        return Err(anyhow!("expected a file, found a folder; give the path of a file in it"));
    }
    fs::read(path).map_err(explain)
}

fn explain(error: io::Error) -> anyhow::Error {
    match error.kind() {
        ErrorKind::NotFound => anyhow!("there is no such file; check the path"),
        ErrorKind::PermissionDenied => anyhow!("this user may not read the file; change its permissions"),
        _ => anyhow!(error),
    }
}
