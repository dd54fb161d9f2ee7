//! A histogram of durations.

use std::time::Duration;

/// Upper bounds of the buckets in seconds. The last bucket is unbounded.
pub(super) const BOUNDS: [f64; 14] =
    [0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 15.0, 60.0];

/// The number of durations in each bucket, and their sum.
#[derive(Debug, Clone, Default)]
pub(super) struct Histogram {
    /// Not cumulative; the last bucket is unbounded.
    counts: [u64; BOUNDS.len() + 1],
    sum_seconds: f64,
}

impl Histogram {
    pub(super) fn observe(&mut self, duration: Duration) {
        let seconds = duration.as_secs_f64();
        self.counts[BOUNDS.partition_point(|bound| *bound < seconds)] += 1;
        self.sum_seconds += seconds;
    }

    /// For each bound, the number of durations up to it; then the total number.
    pub(super) fn cumulative(&self) -> [u64; BOUNDS.len() + 1] {
        let mut sum = 0;
        self.counts.map(|count| {
            sum += count;
            sum
        })
    }

    pub(super) fn sum_seconds(&self) -> f64 {
        self.sum_seconds
    }
}
