//! Run-time choice of vector instructions for the row loops.
//!
//! A loop body given to [`Lanes::run`] is compiled once per instruction set and the widest one the processor has is
//! chosen when it runs. Only the width changes: every lane does the same IEEE operations in the same order, products are
//! never contracted into fused multiply-adds, and no sum is reassociated, so the bits are those of the plain loop
//! (a test compares whole scores). Bodies are marked `#[inline(always)]`, as are the functions they call: code that is
//! not inlined would be compiled for the baseline processor.

use crate::math::simd;

/// Which instructions the row loops use. The results are bit-identical.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Lanes {
    /// The widest this processor has, as far as [`simd::limit`] lets it.
    #[default]
    Detected,
    /// Those every processor of the target has; for tests and comparisons.
    Plain,
}

impl Lanes {
    /// Runs a loop body with the chosen instructions.
    #[inline(always)]
    pub(super) fn run<R>(self, body: impl FnOnce() -> R) -> R {
        match self {
            Self::Detected => simd::dispatch(body),
            Self::Plain => body(),
        }
    }
}
