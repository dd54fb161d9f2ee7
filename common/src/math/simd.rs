//! Run-time choice of vector instructions, and the switch that limits it.
//!
//! `dispatch` compiles a loop once per instruction set and runs the version of the widest one that the processor supports.
//! The results have the same bits at every level (design section 9), because the loops use plain IEEE operations in a fixed
//! order, without contraction; only the width of the vectors differs. A test uses the switch to check this: it runs one fit
//! at both levels.

use pulp::{Arch, Scalar, WithSimd};
use std::sync::atomic::{AtomicBool, Ordering};

/// The instructions that `dispatch` uses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Level {
    /// The widest that this processor supports.
    #[default]
    Detected,
    /// Only those that every processor of the compilation target supports.
    Baseline,
}

static BASELINE: AtomicBool = AtomicBool::new(false);

/// Sets the level of every later `dispatch` of this process, on any thread.
pub fn limit(level: Level) {
    BASELINE.store(level == Level::Baseline, Ordering::Relaxed);
}

/// The current level.
#[must_use]
pub fn level() -> Level {
    if BASELINE.load(Ordering::Relaxed) { Level::Baseline } else { Level::Detected }
}

/// Whether this processor supports more than the baseline. If not, the two levels are the same.
#[must_use]
pub fn has_levels() -> bool {
    format!("{:?}", Arch::new()) != format!("{:?}", Arch::Scalar)
}

/// Runs a loop at the current level. The loop and the functions it calls should be `#[inline(always)]`: code that is not
/// inlined is compiled for the baseline.
#[inline(always)]
pub fn dispatch<Op: WithSimd>(op: Op) -> Op::Output {
    match level() {
        Level::Detected => Arch::new().dispatch(op),
        Level::Baseline => op.with_simd(Scalar),
    }
}
