//! The folder of results: made, checked and written to with errors that name it.

use anyhow::{Context, bail};
use std::{
    fs,
    path::{Path, PathBuf},
};

/// An OUT folder that can be written to.
#[derive(Debug, Clone)]
pub(crate) struct OutFolder {
    path: PathBuf,
}

impl OutFolder {
    /// Makes the folder, or takes an existing one that holds no run.
    pub(crate) fn create(path: &Path) -> anyhow::Result<Self> {
        let folder = Self::overwrite(path)?;
        if folder.file("fit.json").exists() {
            bail!(
                "{} already holds a finished fit (fit.json): choose another --out, or remove it first",
                path.display()
            );
        }
        Ok(folder)
    }

    /// Makes the folder, or takes an existing one and forgets the run in it.
    pub(crate) fn overwrite(path: &Path) -> anyhow::Result<Self> {
        let cannot =
            || format!("cannot write results to {}: choose a folder you may write to with --out", path.display());
        if path.exists() && !path.is_dir() {
            bail!("{} is a file: --out takes a folder, which is made if it is not there", path.display());
        }
        fs::create_dir_all(path).with_context(cannot)?;
        let probe = path.join(".lookalike-write-test");
        fs::write(&probe, b"").with_context(cannot)?;
        fs::remove_file(&probe).with_context(cannot)?;
        Ok(Self { path: path.to_owned() })
    }

    /// The path of a file in the folder.
    pub(crate) fn file(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    /// Writes a file: beside its place first, then renamed, so that nobody sees half of it.
    pub(crate) fn write(&self, name: &str, bytes: &[u8]) -> anyhow::Result<()> {
        let (path, partial) = (self.file(name), self.file(&format!("{name}.partial")));
        fs::write(&partial, bytes)
            .and_then(|()| fs::rename(&partial, &path))
            .with_context(|| format!("cannot write {}: is the disk full?", path.display()))
    }
}
