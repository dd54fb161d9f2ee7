//! The folder of results: checked and locked before any work. Only files that the run wrote are replaced.

use super::{
    claim::{Claim, FIT_FILES, changed, is_file, is_there},
    ledger::{Ledger, hash_of},
};
use crate::settings::OldFiles;
use anyhow::{Context, bail};
use lookalike_coordinator::{
    atomic,
    journal::{self, JOURNAL_FILE, RunLock},
};
use std::{
    fs,
    io::ErrorKind,
    path::{Path, PathBuf},
    sync::Arc,
    time::SystemTime,
};

/// A locked OUT folder whose old files are still there.
#[derive(Debug)]
pub(crate) struct ClaimedFolder {
    folder: OutFolder,
    command: &'static str,
    old: OldFiles,
    /// Files to remove when the run begins.
    replaced: Vec<PathBuf>,
}

/// An OUT folder, or a folder in it, that can be written to.
#[derive(Debug, Clone)]
pub(crate) struct OutFolder {
    /// The prefix of its file names in the ledger.
    prefix: String,
    root: Arc<Root>,
}

#[derive(Debug)]
struct Root {
    path: PathBuf,
    ledger: Ledger,
    /// Held until the last clone is dropped.
    _lock: RunLock,
}

impl ClaimedFolder {
    /// Creates the folder if necessary, checks it and locks it.
    ///
    /// # Errors
    /// If it cannot be written to, another process holds its lock, or the claim is refused.
    pub(crate) fn take(claim: &Claim<'_>) -> anyhow::Result<Self> {
        claim.check_lock()?;
        let path = claim.out;
        let cannot =
            || format!("cannot write results to {}: choose a folder you may write to with --out", path.display());
        fs::create_dir_all(path).with_context(cannot)?;
        // A name that no other process has, on this machine or another.
        let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
        let probe = path.join(format!(".lookalike-write-test-{}-{}", std::process::id(), now.as_nanos()));
        fs::File::create_new(&probe).with_context(cannot)?;
        fs::remove_file(&probe).with_context(cannot)?;
        let lock = RunLock::take(path)?;
        let ledger = Ledger::read(path)?;
        claim.check_against(&ledger)?;
        let replaced = match claim.old {
            OldFiles::Refuse | OldFiles::Resume => Vec::new(),
            OldFiles::Replace | OldFiles::ReplaceDemo => claim.replaced(&ledger),
        };
        let root = Arc::new(Root { path: path.to_owned(), ledger, _lock: lock });
        let folder = OutFolder { prefix: String::new(), root };
        Ok(Self { folder, command: claim.command, old: claim.old, replaced })
    }

    /// Begins the run: removes the files of an old run that it replaces.
    ///
    /// # Errors
    /// If an old file cannot be removed, or the folder cannot be written to.
    pub(crate) fn begin(self) -> anyhow::Result<OutFolder> {
        let Self { folder, command, old, replaced } = self;
        if matches!(old, OldFiles::Replace | OldFiles::ReplaceDemo) {
            let cannot = |path: &Path| format!("cannot remove the old {}", path.display());
            for path in &replaced {
                fs::remove_file(path).with_context(|| cannot(path))?;
            }
            // The ledger is replaced last, because it identifies the run that wrote the files.
            let journal = folder.file(JOURNAL_FILE);
            journal::remove(&journal).with_context(|| cannot(&journal))?;
        }
        // A run of another command that ended before it had a journal is not resumed.
        let is_continued = folder.file(JOURNAL_FILE).exists() || folder.root.ledger.is_of(command);
        if old != OldFiles::Resume || !folder.root.ledger.is_begun() || !is_continued {
            folder.root.ledger.begin(command)?;
        }
        Ok(folder)
    }
}

impl Claim<'_> {
    /// Removes the files that the run replaces, ahead of the run.
    ///
    /// # Errors
    /// Those of [`ClaimedFolder::take`] and [`ClaimedFolder::begin`].
    pub(crate) fn replace_now(&self) -> anyhow::Result<()> {
        ClaimedFolder::take(self)?.begin()?;
        Ok(())
    }
}

impl OutFolder {
    /// The files of a fit that exist, each with the BLAKE3 of its bytes.
    pub(crate) fn results(&self) -> anyhow::Result<Vec<(String, String)>> {
        self.hashes(FIT_FILES)
    }

    /// The existing ones of the named files, each with the BLAKE3 of its bytes.
    pub(crate) fn hashes<'a>(&self, names: impl IntoIterator<Item = &'a str>) -> anyhow::Result<Vec<(String, String)>> {
        let there = names.into_iter().filter_map(|name| Some((name.to_owned(), self.hash(name).transpose()?)));
        there.map(|(name, hash)| Ok((name, hash?))).collect()
    }

    /// The BLAKE3 of a file's bytes; `None` if there is no such file.
    pub(crate) fn hash(&self, name: &str) -> anyhow::Result<Option<String>> {
        match fs::read(self.file(name)) {
            Ok(bytes) => Ok(Some(hash_of(&bytes))),
            Err(error) if error.kind() == ErrorKind::NotFound => Ok(None),
            Err(error) => Err(error).with_context(|| format!("cannot read {}", self.file(name).display())),
        }
    }

    /// Creates a folder in this one.
    ///
    /// # Errors
    /// If it cannot be created, or is a symbolic link, which may point anywhere.
    pub(crate) fn sub(&self, name: &str) -> anyhow::Result<Self> {
        let path = self.file(name);
        if path.is_symlink() {
            bail!(
                "{} is a symbolic link, which is not followed: remove it and repeat the command with --resume",
                path.display()
            );
        }
        fs::create_dir_all(&path).with_context(|| format!("cannot create the folder {}", path.display()))?;
        Ok(Self { prefix: format!("{}{name}/", self.prefix), root: Arc::clone(&self.root) })
    }

    /// The path of a file in the folder.
    pub(crate) fn file(&self, name: &str) -> PathBuf {
        self.root.path.join(format!("{}{name}", self.prefix))
    }

    /// Writes a file atomically.
    ///
    /// # Errors
    /// If it cannot be written, or a file of this name exists that the run did not write.
    pub(crate) fn write(&self, name: &str, bytes: &[u8]) -> anyhow::Result<()> {
        let (path, full_name) = (self.file(name), format!("{}{name}", self.prefix));
        if is_there(&path) {
            let old = if is_file(&path) { self.hash(name)? } else { None };
            if !old.is_some_and(|hash| self.root.ledger.has(&full_name, &hash)) {
                bail!("{}", changed(&full_name, &self.root.path.display().to_string()));
            }
        }
        self.root.ledger.note(&full_name, &hash_of(bytes))?;
        atomic::write(&path, bytes).with_context(|| format!("cannot write {}: is the disk full?", path.display()))
    }
}
