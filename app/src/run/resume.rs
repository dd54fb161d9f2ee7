//! Detects that the requested run is finished already.

use crate::outputs::{OutFolder, changed};
use anyhow::bail;
use lookalike_coordinator::journal::{self, JOURNAL_FILE, RunIdentity};

/// Whether nothing is left to do: the run in a folder is finished, and its results are as it wrote them.
///
/// # Errors
/// If that run has other inputs or settings, or a result was changed.
pub(crate) fn is_finished(
    out: &OutFolder,
    out_name: &str,
    identity: &RunIdentity,
    mut say: impl FnMut(&str),
) -> anyhow::Result<bool> {
    let path = out.file(JOURNAL_FILE);
    if !path.exists() {
        return Ok(false);
    }
    let Some(finished) = journal::finished(&path, identity).map_err(super::failure::journal_failed)? else {
        return Ok(false);
    };
    let missing = missing(out, out_name, &finished.outputs)?;
    if missing.is_empty() {
        say(&format!("the run in {out_name} is finished, and its results are as it wrote them"));
        return Ok(true);
    }
    say(&format!("the run in {out_name} is finished, but {} is missing: fitting again", missing.join(", ")));
    Ok(false)
}

/// The missing ones of the files that the run in a folder wrote.
///
/// # Errors
/// If one was changed: a user may have edited it.
pub(crate) fn missing(out: &OutFolder, out_name: &str, files: &[(String, String)]) -> anyhow::Result<Vec<String>> {
    let mut missing = Vec::new();
    for (name, hash) in files {
        match out.hash(name)? {
            None => missing.push(name.clone()),
            Some(found) if found == *hash => {}
            Some(_) => bail!("{}", changed(name, out_name)),
        }
    }
    Ok(missing)
}
