//! `run.written`: the files that a run wrote into its folder, each with the hash of its bytes. Only these may be replaced.

use anyhow::{Context, bail};
use lookalike::graph::BlobHash;
use std::{
    collections::BTreeSet,
    fs::{self, File, OpenOptions},
    io::{self, Read, Write},
    path::{Component, Path, PathBuf},
    sync::{Mutex, PoisonError},
};

/// The name of the ledger.
pub(super) const LEDGER: &str = "run.written";

/// The files that a run wrote.
#[derive(Debug)]
pub(super) struct Ledger {
    path: PathBuf,
    state: Mutex<State>,
}

#[derive(Debug, Default)]
struct State {
    /// The command that began the run.
    command: Option<String>,
    /// Names relative to the folder, with hashes.
    written: BTreeSet<(String, String)>,
    file: Option<File>,
}

impl Ledger {
    /// The ledger of a folder; empty if the folder has no ledger.
    ///
    /// # Errors
    /// If it cannot be read, or names a file outside the folder, so that this program did not write it.
    pub(super) fn read(folder: &Path) -> anyhow::Result<Self> {
        let path = folder.join(LEDGER);
        let text = match fs::read_to_string(&path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => String::new(),
            text => text.with_context(|| format!("cannot read {}", path.display()))?,
        };
        let mut state = State::default();
        // If the process was killed, the last line may be incomplete.
        for line in text.split_inclusive('\n').filter_map(|line| line.strip_suffix('\n')) {
            match (line.strip_prefix("# lookalike "), line.split_once("  ")) {
                (Some(command), _) => state.command = Some(command.to_owned()),
                (None, Some((_, name))) if !is_inside(name) => bail!(
                    "{} lists {name:?}, which is not a file of this folder, so it is damaged or another program wrote it: choose another \
                     --out, or move {LEDGER} elsewhere",
                    path.display()
                ),
                (None, Some((hash, name))) => _ = state.written.insert((name.to_owned(), hash.to_owned())),
                (None, None) => {}
            }
        }
        Ok(Self { path, state: Mutex::new(state) })
    }

    /// Whether a run has begun in the folder.
    pub(super) fn is_begun(&self) -> bool {
        self.lock().command.is_some()
    }

    /// Whether the run in the folder is one of this command.
    pub(super) fn is_of(&self, command: &str) -> bool {
        self.lock().command.as_deref() == Some(command)
    }

    /// Whether the run wrote a file of this name with these bytes.
    pub(super) fn has(&self, name: &str, hash: &str) -> bool {
        self.lock().written.contains(&(name.to_owned(), hash.to_owned()))
    }

    /// Whether the run wrote a file of this name.
    pub(super) fn has_name(&self, name: &str) -> bool {
        self.lock().written.range((name.to_owned(), String::new())..).next().is_some_and(|(known, _)| known == name)
    }

    /// The names of all files that the run wrote.
    pub(super) fn names(&self) -> BTreeSet<String> {
        self.lock().written.iter().map(|(name, _)| name.clone()).collect()
    }

    /// Begins the ledger of a new run.
    pub(super) fn begin(&self, command: &str) -> anyhow::Result<()> {
        lookalike_coordinator::atomic::write(&self.path, format!("# lookalike {command}\n").as_bytes())
            .with_context(|| format!("cannot write {}", self.path.display()))?;
        *self.lock() = State { command: Some(command.to_owned()), ..State::default() };
        Ok(())
    }

    /// Adds a file to the ledger, before it is moved into place. The line is synchronised to the disk first, because after a power
    /// loss a file without a line would be taken for the user's.
    pub(super) fn note(&self, name: &str, hash: &str) -> anyhow::Result<()> {
        let mut state = self.lock();
        let entry = (name.to_owned(), hash.to_owned());
        if state.written.contains(&entry) {
            return Ok(());
        }
        // Reopened after a failure, so that the next line does not continue an incomplete one.
        let file = state.file.take().map_or_else(|| self.open(), Ok);
        let noted = file.and_then(|mut file| {
            file.write_all(format!("{hash}  {name}\n").as_bytes())?;
            file.sync_data()?;
            Ok(file)
        });
        state.file = Some(noted.with_context(|| format!("cannot write {}", self.path.display()))?);
        state.written.insert(entry);
        Ok(())
    }

    /// Opens the file for appending, and ends an incomplete last line.
    fn open(&self) -> io::Result<File> {
        let mut file = OpenOptions::new().read(true).append(true).open(&self.path)?;
        let mut text = Vec::new();
        file.read_to_end(&mut text)?;
        let whole = text.iter().rposition(|byte| *byte == b'\n').map_or(0, |last| last + 1);
        file.set_len(whole as u64)?;
        Ok(file)
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, State> {
        // A panic leaves neither the set nor the file half changed.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Whether a name is that of a file in the folder, or of one in a folder there. Files of these names may be removed.
fn is_inside(name: &str) -> bool {
    let parts: Vec<_> = Path::new(name).components().collect();
    matches!(parts.len(), 1 | 2) && parts.iter().all(|part| matches!(part, Component::Normal(_)))
}

/// The hash of a file's bytes, in the form that the ledger and the journal use.
pub(super) fn hash_of(bytes: &[u8]) -> String {
    BlobHash::of(bytes).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ledger_is_read_back_but_for_a_line_that_was_cut_off() {
        let folder = tempfile::tempdir().unwrap();
        let ledger = Ledger::read(folder.path()).unwrap();
        assert!(!ledger.is_begun());
        ledger.begin("fit").unwrap();
        ledger.note("match.exr", "ab").unwrap();
        ledger.note("a b/match.exr", "cd").unwrap();
        let path = folder.path().join(LEDGER);
        let text = fs::read_to_string(&path).unwrap();
        assert_eq!(text, "# lookalike fit\nab  match.exr\ncd  a b/match.exr\n");
        fs::write(&path, text + "ef  fit").unwrap();
        let ledger = Ledger::read(folder.path()).unwrap();
        assert!(
            ledger.is_of("fit")
                && ledger.has("match.exr", "ab")
                && ledger.has_name("match.exr")
                && !ledger.has("match.exr", "cd")
        );
        assert_eq!(ledger.names().into_iter().collect::<Vec<_>>(), ["a b/match.exr", "match.exr"]);
        ledger.note("match.png", "01").unwrap();
        let ledger = Ledger::read(folder.path()).unwrap();
        assert!(ledger.has("match.png", "01") && ledger.names().len() == 3, "a line that was cut off is not continued");
    }

    #[test]
    fn ledger_with_a_name_outside_its_folder_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(LEDGER);
        for name in ["../mine", "a/../../mine", "../../x", "/etc/hosts", "..", "a/b/c", ".", ""] {
            fs::write(&path, format!("# lookalike fit\nab  match.exr\ncd  {name}\n")).unwrap();
            let error = Ledger::read(folder.path()).unwrap_err().to_string();
            assert!(error.contains(&format!("run.written lists {name:?}")), "{error}");
        }
    }
}
