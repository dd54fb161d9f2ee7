//! The settings of `lookalike access new`.

use super::Advertise;
use std::path::PathBuf;

/// An access file that is created before the runs that use it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AccessSettings {
    /// Host and port where workers will reach the coordinator; the port is always given.
    pub address: Advertise,
    /// The file to write. The coordinator's key goes beside it.
    pub out: PathBuf,
}
