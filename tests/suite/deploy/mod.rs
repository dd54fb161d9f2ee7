//! The files under `deploy/`: the job script on stand-ins for Slurm's commands and, with `--features slow`, on a real Slurm; the files
//! for Kubernetes against the command line and each other.

mod job_script;
mod kubernetes;
#[cfg(feature = "slow")]
mod slurm;
mod submission;

use std::path::PathBuf;

/// A file or folder of the sources.
fn source(path: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("..").join(path).canonicalize().unwrap()
}
