//! The settings of `lookalike access new`.

use super::Advertise;
use std::path::PathBuf;

/// An access file to be made before the runs it is for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AccessSettings {
    /// Under which host and port workers will reach the coordinator; always with a port.
    pub address: Advertise,
    /// The file to write. The coordinator's key goes beside it.
    pub out: PathBuf,
}
