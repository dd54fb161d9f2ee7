//! The check of an output folder before any work: a run replaces only files that it wrote itself.
//!
//! | what is in OUT | new run | `--resume` | `--force` | `demo` |
//! |---|---|---|---|---|
//! | a run (journal) | refused | resumed | replaced | replaced if it is a demo |
//! | a file with one of our names | refused | kept if the run wrote it, else refused | replaced | as a run |
//! | another file that an earlier run wrote, unchanged | kept | kept | removed | removed |
//! | an input of the run with such a name | refused | refused | refused | refused |
//! | a symbolic link or a folder with such a name | refused | refused | refused | refused |

use super::ledger::{LEDGER, Ledger, hash_of};
use crate::{problems::Problems, settings::OldFiles};
use anyhow::bail;
use lookalike_coordinator::{
    atomic::draft_of,
    journal::{self, JOURNAL_FILE, LOCK_FILE, status::STATUS_FILE},
};
use serde_json::Value;
use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    io::{ErrorKind, Read},
    path::{Path, PathBuf},
};

/// The file that marks a finished fit.
pub(crate) const MARK: &str = "fit.json";

/// The file that marks a batch that has begun.
pub(crate) const BATCH_MARK: &str = "summary.json";

/// The files of every fit.
pub(crate) const FIT_FILES: [&str; 6] =
    ["candidates.csv", "match.exr", "match.png", "reference.png", "difference.png", MARK];

/// The file that tells workers how to reach the run.
pub(crate) const ACCESS_FILE: &str = "access.json";

/// The private key for [`ACCESS_FILE`].
const KEY_FILE: &str = "access.key.pem";

/// Files of every run beside its journal. They are rewritten throughout the run, so their hashes are not checked.
const RUN_FILES: [&str; 3] = [STATUS_FILE, ACCESS_FILE, KEY_FILE];

/// The files that a run reads and writes.
#[derive(Debug, Clone)]
pub(crate) struct Claim<'a> {
    /// The command: `fit`, `batch`, `study` or `demo`.
    pub(crate) command: &'static str,
    pub(crate) out: &'a Path,
    pub(crate) old: OldFiles,
    /// Names of files in the folder that the run writes.
    pub(crate) files: Vec<&'static str>,
    /// Names of files that the run appends to, so their hashes are not checked.
    pub(crate) growing: Vec<&'static str>,
    /// Names of folders in the folder that the run creates and fills.
    pub(crate) folders: Vec<&'static str>,
    /// Names of folders in the folder that each receive the files of one fit.
    pub(crate) fits: Vec<&'a str>,
    /// Files that the run reads.
    pub(crate) inputs: Vec<&'a Path>,
    /// The access file that was made beforehand, if any.
    pub(crate) access: Option<&'a Path>,
}

impl<'a> Claim<'a> {
    /// A claim of a folder for the files of one fit.
    pub(crate) fn of_fit(out: &'a Path, old: OldFiles) -> Self {
        let (growing, folders, fits, inputs) = Default::default();
        Self { command: "fit", out, old, files: FIT_FILES.into(), growing, folders, fits, inputs, access: None }
    }

    /// Refuses the folder if the run would replace files that it must not. Changes nothing.
    ///
    /// # Errors
    /// All files in the way, and what to do about them.
    pub(crate) fn check(&self) -> anyhow::Result<()> {
        self.check_lock()?;
        self.check_against(&Ledger::read(self.out)?)
    }

    /// Refuses a lock file or a ledger that this program did not write.
    pub(super) fn check_lock(&self) -> anyhow::Result<()> {
        if self.out.exists() && !self.out.is_dir() {
            bail!("{} is a file: --out takes a folder, which is created if necessary", self.out.display());
        }
        for (name, beginning) in [(LOCK_FILE, b"process "), (LEDGER, b"# lookal")] {
            let path = self.out.join(name);
            let mut words = [0; 8];
            let is_ours = is_file(&path)
                && fs::File::open(&path)
                    .and_then(|mut file| file.read(&mut words))
                    .is_ok_and(|n| n == 0 || &words == beginning);
            if is_there(&path) && !is_ours {
                bail!("{}", self.in_the_way(name));
            }
        }
        Ok(())
    }

    /// Checks everything else, against the ledger of the folder.
    pub(super) fn check_against(&self, ledger: &Ledger) -> anyhow::Result<()> {
        let shown = self.out.display();
        self.check_inputs(ledger)?;
        let has_journal = is_there(&self.out.join(JOURNAL_FILE));
        match self.old {
            _ if has_journal && !is_file(&self.out.join(JOURNAL_FILE)) => bail!("{}", self.in_the_way(JOURNAL_FILE)),
            OldFiles::Refuse if has_journal || self.has_mark() => bail!("{}", self.old_run()),
            OldFiles::Resume if !has_journal && self.command == "fit" && is_there(&self.out.join(MARK)) => bail!(
                "{shown} holds a finished fit ({MARK}) without the journal of its run, so there is nothing to resume: choose \
                 another --out, or replace it with --force"
            ),
            OldFiles::ReplaceDemo
                if has_journal
                    || (ledger.is_begun() && !ledger.is_of("demo"))
                    || self.names().iter().any(|name| is_there(&self.out.join(name))) =>
            {
                self.check_demo(ledger)?;
            }
            _ => {}
        }
        let is_no_folder = |fit: &&str| {
            let path = self.out.join(fit);
            is_there(&path) && (path.is_symlink() || !path.is_dir())
        };
        let mut problems: Vec<String> =
            self.fits.iter().copied().filter(is_no_folder).map(|fit| self.in_the_way(fit)).collect();
        for fit in self.fits.iter().filter(|_| self.old != OldFiles::Replace) {
            let mark = format!("{fit}/{MARK}");
            let is_taken = is_there(&self.out.join(fit).join(JOURNAL_FILE))
                || (is_there(&self.out.join(&mark)) && !(self.old == OldFiles::Resume && ledger.has_name(&mark)));
            if is_taken {
                problems.push(format!(
                    "{shown}/{fit} holds a fit that is not of this run: choose another --out, or move that folder elsewhere"
                ));
            }
        }
        let is_told = |name: &str, problems: &[String]| {
            problems
                .iter()
                .any(|told| name.split_once('/').is_some_and(|(fit, _)| told.contains(&format!("/{fit} holds"))))
        };
        for name in self.names() {
            if is_told(&name, &problems) {
                continue;
            }
            problems.extend(self.problem_with(&name, ledger, has_journal));
        }
        Problems::check(problems, &shown.to_string())
    }

    /// The existing files that the run replaces.
    pub(super) fn replaced(&self, ledger: &Ledger) -> Vec<PathBuf> {
        // The mark goes first, so that a partly removed fit does not count as finished.
        // Of what this run does not write, only what another run wrote and nobody has changed.
        let of_ledger = ledger.names().into_iter().filter(|name| self.is_of_run(name, &self.out.join(name), ledger));
        let names = [MARK.to_owned()].into_iter().chain(self.names()).chain(of_ledger);
        let mut seen = BTreeSet::new();
        names
            .filter(|name| seen.insert(name.clone()))
            .map(|name| self.out.join(name))
            .filter(|path| is_file(path) && !path.parent().is_some_and(|it| it != self.out && it.is_symlink()))
            .collect()
    }

    /// Whether the folder holds the file that marks a run of this command.
    fn has_mark(&self) -> bool {
        match self.command {
            "batch" => is_there(&self.out.join(BATCH_MARK)),
            "study" => false,
            _ => is_there(&self.out.join(MARK)),
        }
    }

    /// All names that the run writes, relative to its folder.
    fn names(&self) -> Vec<String> {
        let own = self.files.iter().chain(&self.growing).chain(&self.folders).map(|name| (*name).to_owned());
        let of_fits = self.fits.iter().flat_map(|fit| FIT_FILES.map(|file| format!("{fit}/{file}")));
        let own_access = |name: &&str| *name == STATUS_FILE || self.access.is_none();
        let of_run = RUN_FILES.into_iter().filter(own_access).map(str::to_owned);
        own.chain(of_fits).chain(of_run).chain(journal_companions()).collect()
    }

    /// Refuses to replace an input of the run.
    fn check_inputs(&self, ledger: &Ledger) -> anyhow::Result<()> {
        let mut names: BTreeSet<String> = self.names().into_iter().collect();
        if self.old == OldFiles::Replace {
            names.extend(ledger.names());
        }
        let inputs: BTreeMap<PathBuf, &Path> =
            self.inputs.iter().filter_map(|input| Some((fs::canonicalize(input).ok()?, *input))).collect();
        let lines = names.iter().filter_map(|name| {
            let place = fs::canonicalize(self.out.join(name)).ok()?;
            let input = inputs.get(&place)?;
            Some(format!("{} is an input of this run, which would replace it: choose another --out", input.display()))
        });
        Problems::check(lines.collect(), &self.out.display().to_string())
    }

    /// Refuses to replace anything but a demo.
    fn check_demo(&self, ledger: &Ledger) -> anyhow::Result<()> {
        let generated =
            fs::read(self.out.join(MARK)).ok().and_then(|bytes| serde_json::from_slice::<Value>(&bytes).ok());
        let is_demo = match generated {
            Some(json) => json["inputs"]["photo"]["generated"] == true,
            None => !is_there(&self.out.join(MARK)) && ledger.is_of("demo"),
        };
        if is_demo {
            return Ok(());
        }
        let found = [MARK, JOURNAL_FILE].into_iter().map(str::to_owned).chain(self.names());
        let found = found.into_iter().chain([LEDGER.to_owned()]).find(|name| is_there(&self.out.join(name)));
        let found = found.unwrap_or_default();
        bail!(
            "{} holds files that are not from a demo ({found}): choose another folder with --out, or replace it with --force",
            self.out.display()
        )
    }

    /// The problem with a file that the run writes, if it exists and may not be replaced.
    fn problem_with(&self, name: &str, ledger: &Ledger, has_journal: bool) -> Option<String> {
        let path = self.out.join(name);
        let draft = draft_of(&path);
        // A killed process leaves drafts behind.
        if is_there(&draft) && !(is_file(&draft) && ledger.is_begun()) {
            return Some(self.in_the_way(&format!("{name}.partial")));
        }
        if !is_there(&path) {
            return None;
        }
        let is_folder = self.folders.contains(&name);
        let is_kind = if is_folder { path.is_dir() && !path.is_symlink() } else { is_file(&path) };
        if !is_kind {
            return Some(self.in_the_way(name));
        }
        let is_companion = journal_companions().any(|companion| companion == name);
        let is_rewritten = self.growing.contains(&name) || RUN_FILES.contains(&name) || is_companion;
        let is_passing = is_folder || is_rewritten;
        let is_fine = match self.old {
            OldFiles::Replace => !is_folder || ledger.is_begun(),
            // Left by a run that ended before it had a journal.
            OldFiles::Refuse => is_rewritten && ledger.is_begun(),
            // The new journal removes them.
            OldFiles::Resume if is_companion => ledger.is_begun(),
            OldFiles::Resume if is_passing => has_journal || ledger.is_begun(),
            OldFiles::Resume | OldFiles::ReplaceDemo if ledger.is_begun() => {
                is_passing || self.is_of_run(name, &path, ledger)
            }
            OldFiles::Resume => false,
            // Written by a version without ledgers.
            OldFiles::ReplaceDemo => true,
        };
        match (is_fine, self.old) {
            (true, _) => None,
            (false, OldFiles::Resume) if has_journal && !is_companion => {
                Some(changed(name, &self.out.display().to_string()))
            }
            (false, OldFiles::Replace) => Some(format!(
                "{} holds files that no run in this folder wrote: choose another --out, or move that folder elsewhere",
                path.display()
            )),
            (false, OldFiles::Refuse) if !is_folder => Some(format!(
                "{} already exists, and this run would replace it: choose another --out, move that file elsewhere, or replace \
                 it with --force",
                path.display()
            )),
            (false, _) => Some(self.in_the_way(name)),
        }
    }

    /// Whether the run in the folder wrote this file with its present content.
    fn is_of_run(&self, name: &str, path: &Path, ledger: &Ledger) -> bool {
        fs::read(path).is_ok_and(|bytes| ledger.has(name, &hash_of(&bytes)))
    }

    fn in_the_way(&self, name: &str) -> String {
        let path = self.out.join(name);
        let what = match fs::symlink_metadata(&path) {
            Ok(it) if it.is_symlink() => "is a symbolic link, which is neither followed nor replaced",
            Ok(it) if it.is_dir() => "is a folder, where this run writes a file or a folder of its own",
            _ => "is not a file of this run, which would replace it",
        };
        format!("{} {what}: choose another --out, or move it elsewhere", path.display())
    }

    /// The message that the folder holds a run already.
    fn old_run(&self) -> String {
        let shown = self.out.display();
        let has_mark = self.has_mark();
        match self.command {
            "batch" if has_mark => format!(
                "{shown}/{BATCH_MARK} says that a batch was run there already: resume it with --resume, choose another --out, \
                 or replace it with --force"
            ),
            "batch" | "study" => format!(
                "{shown}/{JOURNAL_FILE} says that a run was begun there already: resume it with --resume, choose another \
                 --out, or replace it with --force"
            ),
            _ if has_mark => format!(
                "{shown} already holds a finished fit ({MARK}): choose another --out, or replace it with --force"
            ),
            _ => format!(
                "{shown} already holds a run that is not finished ({JOURNAL_FILE}): resume it with --resume, choose another \
                 --out, or replace it with --force"
            ),
        }
    }
}

/// The names of the files beside the journal that SQLite and the journal's creation write and remove.
fn journal_companions() -> impl Iterator<Item = String> {
    let files = journal::all_files(Path::new(JOURNAL_FILE)).into_iter().skip(1);
    files.map(|file| file.to_string_lossy().into_owned())
}

/// The message that a file differs from what the run wrote.
pub(crate) fn changed(name: &str, out_name: &str) -> String {
    format!(
        "{name} is not what the run in {out_name} wrote; keep a changed file elsewhere and remove it here, then --resume makes it again"
    )
}

/// Whether anything of this name exists, including a dangling symbolic link.
pub(super) fn is_there(path: &Path) -> bool {
    !matches!(fs::symlink_metadata(path), Err(error) if matches!(error.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory))
}

/// Whether it is a regular file, not a symbolic link.
pub(super) fn is_file(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok_and(|it| it.is_file())
}
