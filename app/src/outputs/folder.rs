//! The folder of results: made, checked and written to with errors that name it.

use anyhow::{Context, bail};
use lookalike::graph::BlobHash;
use lookalike_coordinator::journal::{self, JOURNAL_FILE, RunLock, status::STATUS_FILE};
use std::{
    fs,
    io::ErrorKind,
    path::{Path, PathBuf},
    sync::Arc,
};

/// An OUT folder that can be written to.
#[derive(Debug, Clone)]
pub(crate) struct OutFolder {
    path: PathBuf,
    /// Held while this lives.
    _lock: Arc<RunLock>,
}

/// The mark of a finished fit.
pub(crate) const MARK: &str = "fit.json";

/// What every fit leaves behind.
pub(crate) const FIT_FILES: [&str; 6] =
    ["candidates.csv", "match.exr", "match.png", "reference.png", "difference.png", MARK];

/// Everything else that a fit or a demo writes.
const RESULTS: [&str; 10] = [
    STATUS_FILE,
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
    /// Makes the folder, or takes an existing one that holds no run, or one to be gone on with.
    pub(crate) fn create(path: &Path, resume: bool) -> anyhow::Result<Self> {
        let folder = Self::open(path)?;
        let shown = path.display();
        match (folder.file(MARK).exists(), folder.file(JOURNAL_FILE).exists(), resume) {
            (_, true, true) | (false, false, _) => Ok(folder),
            (true, _, false) => {
                bail!("{shown} already holds a finished fit ({MARK}): choose another --out, or remove it first")
            }
            (true, false, true) => bail!(
                "{shown} holds a finished fit ({MARK}) without the journal of its run, so there is nothing to resume: choose \
                 another --out, or remove it first"
            ),
            (false, true, false) => bail!(
                "{shown} already holds a run that is not finished ({JOURNAL_FILE}): go on with it with --resume, choose another \
                 --out, or remove that folder first"
            ),
        }
    }

    /// Makes the folder, or takes an existing one and removes the run and the results in it, the mark of a finished fit first.
    pub(crate) fn overwrite(path: &Path) -> anyhow::Result<Self> {
        let folder = Self::open(path)?;
        let cannot = |name: &str| format!("cannot remove the old {}", folder.file(name).display());
        let remove = |name: &str| match fs::remove_file(folder.file(name)) {
            Err(error) if error.kind() != ErrorKind::NotFound => Err(error).with_context(|| cannot(name)),
            _ => Ok(()),
        };
        remove(MARK)?;
        journal::remove(&folder.file(JOURNAL_FILE)).with_context(|| cannot(JOURNAL_FILE))?;
        RESULTS.into_iter().try_for_each(remove)?;
        Ok(folder)
    }

    /// The results of a fit that are there, each with the BLAKE3 of its bytes.
    pub(crate) fn results(&self) -> anyhow::Result<Vec<(String, String)>> {
        let names = RESULTS.into_iter().chain([MARK]).filter(|name| *name != STATUS_FILE);
        let there = names.filter_map(|name| Some((name.to_owned(), self.hash(name).transpose()?)));
        there.map(|(name, hash)| Ok((name, hash?))).collect()
    }

    /// The BLAKE3 of a file's bytes; `None` if there is no such file.
    pub(crate) fn hash(&self, name: &str) -> anyhow::Result<Option<String>> {
        match fs::read(self.file(name)) {
            Ok(bytes) => Ok(Some(BlobHash::of(&bytes).to_string())),
            Err(error) if error.kind() == ErrorKind::NotFound => Ok(None),
            Err(error) => Err(error).with_context(|| format!("cannot read {}", self.file(name).display())),
        }
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
        let lock = RunLock::take(path)?;
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
