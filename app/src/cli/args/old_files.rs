//! `--resume` and `--force`. Each command describes `--resume` in its own words, so the flags are declared there.

use crate::settings::OldFiles;

/// The flags as parsed; the grammar refuses both together.
pub(super) struct OldFilesFlags {
    pub(super) resume: bool,
    pub(super) force: bool,
}

impl From<OldFilesFlags> for OldFiles {
    fn from(flags: OldFilesFlags) -> Self {
        match flags {
            OldFilesFlags { force: true, .. } => Self::Replace,
            OldFilesFlags { resume: true, .. } => Self::Resume,
            OldFilesFlags { .. } => Self::Refuse,
        }
    }
}
