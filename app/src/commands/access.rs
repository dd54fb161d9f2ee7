//! `lookalike access new`: makes an access file before the runs that use it.

use crate::settings::AccessSettings;
use lookalike_coordinator::access::{Credentials, key_path};
use std::{process::ExitCode, time::SystemTime};

pub(crate) fn run(settings: AccessSettings) -> anyhow::Result<ExitCode> {
    let AccessSettings { address, out } = settings;
    Credentials::new(address.to_string(), SystemTime::now())?.create(&out)?;
    eprintln!("wrote {} for workers, and {} for the coordinator only", out.display(), key_path(&out).display());
    Ok(ExitCode::SUCCESS)
}
