//! Compares the results of an earlier run with what it recorded.

use crate::outputs::{OutFolder, changed};
use anyhow::bail;

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
