//! Run-time choice of vector instructions for the row loops.
//!
//! [`Lanes::run`] compiles a loop body once per instruction set and runs the version of the widest one that the
//! processor supports. The bits are those of the plain loop (a test compares whole scores): every lane does the same
//! IEEE operations in the same order, products are not contracted into fused multiply-adds, and sums are not
//! reassociated. Bodies and the functions they call are marked `#[inline(always)]`, because code that is not inlined is
//! compiled for the baseline processor.

use crate::math::simd;

/// The instructions that the row loops use. The results are bit-identical.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Lanes {
    /// The widest that this processor supports, unless [`simd::limit`] is set to the baseline.
    #[default]
    Detected,
    /// Only those that every processor of the compilation target supports; for tests and comparisons.
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
