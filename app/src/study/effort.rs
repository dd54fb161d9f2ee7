//! The time and the workers that all processes of a study used, for the report.

use crate::outputs::OutFolder;
use anyhow::Context;
use serde::{Deserialize, Serialize};
use std::fs;

pub(super) const FILE: &str = "effort.json";

/// Time and workers.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Effort {
    /// Seconds during which cells were computed: from the start of each process to the end of its last cell.
    pub(super) seconds: f64,
    /// The most workers that joined a single process.
    pub(super) workers: u32,
}

impl Effort {
    /// The effort of earlier processes; zero if no process has ended in order.
    pub(super) fn read(out: &OutFolder) -> Self {
        fs::read_to_string(out.file(FILE)).ok().and_then(|text| serde_json::from_str(&text).ok()).unwrap_or_default()
    }

    pub(super) fn write(&self, out: &OutFolder) -> anyhow::Result<()> {
        out.write(FILE, serde_json::to_string(self).context(FILE)?.as_bytes())
    }
}
