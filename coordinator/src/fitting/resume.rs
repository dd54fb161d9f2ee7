//! A run that is finished already, and is asked for again.

use super::{FitJob, identity::identity};
use crate::journal::{self, JOURNAL_FILE};
use anyhow::bail;

/// Whether there is nothing left to do: the run of this job is finished, and its results are as it wrote them.
pub(super) fn is_done(job: &FitJob) -> anyhow::Result<bool> {
    let path = job.out.file(JOURNAL_FILE);
    if !job.resume || !path.exists() {
        return Ok(false);
    }
    let Some(finished) = journal::finished(&path, &identity(job)?).map_err(super::journal_failed)? else {
        return Ok(false);
    };
    let mut missing = Vec::new();
    for (name, hash) in finished.outputs {
        match job.out.hash(&name)? {
            None => missing.push(name),
            Some(found) if found == hash => {}
            Some(_) => bail!(
                "{} is not what the finished run in {} wrote; keep a changed file elsewhere and remove it here, then --resume \
                 makes it again",
                name,
                job.out_name
            ),
        }
    }
    if missing.is_empty() {
        return Ok(true);
    }
    eprintln!("the run in {} is finished, but {} is missing: fitting again", job.out_name, missing.join(", "));
    Ok(false)
}
