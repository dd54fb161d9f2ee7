//! Converts errors of the journal to errors of the program.

use crate::exit::Exit;
use lookalike_coordinator::journal::JournalError;

/// An error of the journal, with its exit code.
pub(crate) fn journal_failed(error: JournalError) -> anyhow::Error {
    let exit = if error.exit_code() == 2 { Exit::BadInput } else { Exit::RunFailed };
    anyhow::Error::new(error).context(exit)
}
