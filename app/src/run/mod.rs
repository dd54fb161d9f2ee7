//! What fits, batches and studies share of running: the engine with its runtime, the clock, a run that is finished already.

mod clock;
mod failure;
mod resume;
mod running;

pub(crate) use clock::{Clock, cpu_seconds};
pub(crate) use failure::journal_failed;
pub(crate) use resume::{is_finished, missing};
pub(crate) use running::{run_to_end, runner_options};
