//! A run that is finished already, and is asked for again.

use crate::{
    journal::{self, JOURNAL_FILE, RunIdentity},
    outputs::OutFolder,
};
use anyhow::bail;

/// Whether there is nothing left to do: the run in a folder is finished, and its results are as it wrote them.
///
/// # Errors
/// If the run there is one of other inputs or settings, or a result was changed.
pub(crate) fn is_finished(out: &OutFolder, out_name: &str, identity: &RunIdentity) -> anyhow::Result<bool> {
    let path = out.file(JOURNAL_FILE);
    if !path.exists() {
        return Ok(false);
    }
    let Some(finished) = journal::finished(&path, identity).map_err(super::journal_failed)? else {
        return Ok(false);
    };
    let mut missing = Vec::new();
    for (name, hash) in finished.outputs {
        match out.hash(&name)? {
            None => missing.push(name),
            Some(found) if found == hash => {}
            Some(_) => bail!(
                "{} is not what the finished run in {} wrote; keep a changed file elsewhere and remove it here, then --resume \
                 makes it again",
                name,
                out_name
            ),
        }
    }
    if missing.is_empty() {
        eprintln!("the run in {out_name} is finished, and its results are as it wrote them");
        return Ok(true);
    }
    eprintln!("the run in {out_name} is finished, but {} is missing: fitting again", missing.join(", "));
    Ok(false)
}
