//! Running a graph, as fits, batches and studies do it: the engine with its runtime, the clock, the check for a finished run.

mod clock;
mod failure;
mod metrics;
mod names;
mod resume;
mod session;

pub(crate) use clock::{Clock, cpu_seconds};
pub(crate) use failure::journal_failed;
pub(crate) use metrics::listen;
pub(crate) use names::{FITS, NAMES};
pub(crate) use resume::missing;
pub(crate) use session::{Session, access_file};
