//! Random numbers from a seed, in streams that are independent of each other.

use std::time::Duration;

use lookalike::math::sampling::{key, uniform};

/// A stream of random numbers.
#[derive(Clone, Debug)]
pub(super) struct Chance {
    seed: u64,
    stream: u64,
    drawn: u64,
}

impl Chance {
    pub(super) fn new(seed: u64, stream: u64) -> Self {
        Self { seed, stream, drawn: 0 }
    }

    /// A number in [0, 1).
    pub(super) fn share(&mut self) -> f64 {
        uniform(self.word())
    }

    pub(super) fn word(&mut self) -> u64 {
        self.drawn += 1;
        key(&[self.seed, self.stream, self.drawn])
    }

    /// Whether an event with this probability happens.
    pub(super) fn happens(&mut self, probability: f64) -> bool {
        self.share() < probability
    }

    /// A whole number from `least` to `most`.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small number, 0 or more")]
    pub(super) fn between(&mut self, least: u64, most: u64) -> u64 {
        least + (self.share() * (most - least + 1) as f64) as u64
    }

    /// An index into something of this length, which is not 0.
    pub(super) fn index(&mut self, length: usize) -> usize {
        usize::try_from(self.between(0, length as u64 - 1)).unwrap_or(0)
    }

    /// One of these.
    pub(super) fn of<T: Copy>(&mut self, choices: &[T]) -> T {
        choices[self.index(choices.len())]
    }

    /// A duration between these, in whole milliseconds.
    pub(super) fn time(&mut self, least_ms: u64, most_ms: u64) -> Duration {
        Duration::from_millis(self.between(least_ms, most_ms))
    }
}
