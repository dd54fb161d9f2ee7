//! Errors of the journal as errors of the program.

use crate::exit::Exit;
use lookalike_coordinator::journal::JournalError;

/// What went wrong with a journal, with its exit code.
pub(crate) fn journal_failed(error: JournalError) -> anyhow::Error {
    let exit = if error.exit_code() == 2 { Exit::BadInput } else { Exit::ClusterFailed };
    anyhow::Error::new(error).context(exit)
}
