//! The best score of a fit so far, readable from other threads while the fit runs.

use std::sync::atomic::{AtomicU64, Ordering};

/// A score that the fit sets and other threads read. For display only; it does not reach a result.
#[derive(Debug)]
pub struct BestScore(AtomicU64);

impl Default for BestScore {
    fn default() -> Self {
        Self(AtomicU64::new(f64::NAN.to_bits()))
    }
}

impl BestScore {
    /// The best score so far; `None` before stage two.
    #[must_use]
    pub fn get(&self) -> Option<f64> {
        let score = f64::from_bits(self.0.load(Ordering::Relaxed));
        (!score.is_nan()).then_some(score)
    }

    pub(crate) fn set(&self, score: f64) {
        self.0.store(score.to_bits(), Ordering::Relaxed);
    }
}
