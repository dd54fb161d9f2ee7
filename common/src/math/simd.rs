//! Run-time choice of vector instructions, and the switch that limits it.
//!
//! A loop given to `dispatch` is compiled once per instruction set, and the widest one that the processor has is chosen when it
//! runs. Only the width of the vectors changes: the loops use plain IEEE operations in a fixed order, without contraction, so that
//! the results have the same bits at every level (design section 9). The switch exists to show that: a test runs one fit at
//! both levels.

use pulp::{Arch, NullaryFnOnce};
use std::sync::atomic::{AtomicBool, Ordering};

/// Which instructions `dispatch` uses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Level {
    /// The widest that this processor has.
    #[default]
    Detected,
    /// Those that every processor of the target has.
    Baseline,
}

static BASELINE: AtomicBool = AtomicBool::new(false);

/// Sets the level of every later `dispatch` of this process, on any thread.
pub fn limit(level: Level) {
    BASELINE.store(level == Level::Baseline, Ordering::Relaxed);
}

/// The level in force.
#[must_use]
pub fn level() -> Level {
    if BASELINE.load(Ordering::Relaxed) { Level::Baseline } else { Level::Detected }
}

/// Whether this processor has more than the baseline, so that the two levels differ.
#[must_use]
pub fn has_levels() -> bool {
    format!("{:?}", Arch::new()) != format!("{:?}", Arch::Scalar)
}

/// Runs a loop at the level in force. The loop and what it calls should be `#[inline(always)]`: code that is not inlined is
/// compiled for the baseline.
#[inline(always)]
pub(crate) fn dispatch<Op: NullaryFnOnce>(op: Op) -> Op::Output {
    match level() {
        Level::Detected => Arch::new().dispatch(op),
        Level::Baseline => op.call(),
    }
}
