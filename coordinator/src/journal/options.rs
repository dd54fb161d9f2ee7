//! The location of a run's journal, and the run's identity.

use std::fmt;
use std::path::PathBuf;
use std::sync::Arc;

use super::identity::RunIdentity;
use super::names::Names;
use super::parts::PartLedger;

/// The journal's file in a folder of results.
pub const JOURNAL_FILE: &str = "run.sqlite";

/// Returns the best score of a run so far, once there is one. Lower is better.
pub type Score = Arc<dyn Fn() -> Option<f64> + Send + Sync>;

/// The journal of a run: its file and the run's identity.
#[derive(Clone)]
pub struct JournalOptions {
    /// The file. Its folder must exist, and only one process may use it at a time: see [`RunLock`](super::RunLock).
    pub path: PathBuf,
    /// The inputs and settings that determine the result.
    pub identity: RunIdentity,
    /// Whether to resume an unfinished run. If the file does not exist, a new run begins either way.
    pub resume: bool,
    /// The best score so far, shown in the status of the run.
    pub score: Option<Score>,
    /// The states of the parts, in a run of many.
    pub parts: PartLedger,
    /// The names under which users know parts and scores.
    pub names: Names,
}

impl JournalOptions {
    /// The options of a new run.
    #[must_use]
    pub fn new(path: PathBuf, identity: RunIdentity) -> Self {
        Self { path, identity, resume: false, score: None, parts: PartLedger::default(), names: Names::default() }
    }
}

/// Omits the score, which is a function.
impl fmt::Debug for JournalOptions {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { path, identity, resume, parts, names, .. } = self;
        let mut text = formatter.debug_struct("JournalOptions");
        text.field("path", path).field("identity", identity).field("resume", resume).field("parts", parts);
        text.field("names", names);
        text.finish_non_exhaustive()
    }
}
