//! The folder of results: made, checked and written to with errors that name it.

use anyhow::{Context, bail};
use std::{
    fs::{self, File, TryLockError},
    io::ErrorKind,
    path::{Path, PathBuf},
    sync::Arc,
};

/// An OUT folder that can be written to.
#[derive(Debug, Clone)]
pub(crate) struct OutFolder {
    path: PathBuf,
    /// Held while this lives.
    _lock: Arc<File>,
}

/// Everything that a fit or a demo writes, the mark of a finished fit first.
const RESULTS: [&str; 10] = [
    "fit.json",
    "candidates.csv",
    "match.exr",
    "match.png",
    "reference.png",
    "difference.png",
    "strip.png",
    "photo.exr",
    "environment.exr",
    "environment.png",
];

impl OutFolder {
    /// Makes the folder, or takes an existing one that holds no run.
    pub(crate) fn create(path: &Path) -> anyhow::Result<Self> {
        let folder = Self::open(path)?;
        if folder.file("fit.json").exists() {
            bail!(
                "{} already holds a finished fit (fit.json): choose another --out, or remove it first",
                path.display()
            );
        }
        Ok(folder)
    }

    /// Makes the folder, or takes an existing one and removes the results in it, the mark of a finished fit first.
    pub(crate) fn overwrite(path: &Path) -> anyhow::Result<Self> {
        let folder = Self::open(path)?;
        for name in RESULTS {
            match fs::remove_file(folder.file(name)) {
                Err(error) if error.kind() != ErrorKind::NotFound => {
                    return Err(error)
                        .with_context(|| format!("cannot remove the old {}", folder.file(name).display()));
                }
                _ => {}
            }
        }
        Ok(folder)
    }

    /// Makes the folder or takes an existing one, and locks it for this process.
    fn open(path: &Path) -> anyhow::Result<Self> {
        let cannot =
            || format!("cannot write results to {}: choose a folder you may write to with --out", path.display());
        if path.exists() && !path.is_dir() {
            bail!("{} is a file: --out takes a folder, which is made if it is not there", path.display());
        }
        fs::create_dir_all(path).with_context(cannot)?;
        let probe = path.join(".lookalike-write-test");
        fs::write(&probe, b"").with_context(cannot)?;
        fs::remove_file(&probe).with_context(cannot)?;
        let lock = File::create(path.join(".lookalike-lock")).with_context(cannot)?;
        match lock.try_lock() {
            Err(TryLockError::WouldBlock) => {
                bail!("another run is writing to {}: wait for it, or choose another --out", path.display())
            }
            // A file system without locks: as before there were any.
            Err(TryLockError::Error(_)) | Ok(()) => {}
        }
        Ok(Self { path: path.to_owned(), _lock: Arc::new(lock) })
    }

    /// Makes a folder in this one, for the results of one of several fits.
    pub(crate) fn sub(&self, name: &str) -> anyhow::Result<Self> {
        let path = self.file(name);
        fs::create_dir_all(&path).with_context(|| format!("cannot make the folder {}", path.display()))?;
        Ok(Self { path, _lock: Arc::clone(&self._lock) })
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
