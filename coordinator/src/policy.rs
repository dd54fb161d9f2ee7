//! The policy of a run (design section 8): time limits for workers, and how many deaths of workers make a node fail.

use std::time::Duration;

use thiserror::Error;

/// How the coordinator treats workers and nodes. What a user may want to change has a flag of the same name.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Policy {
    /// The interval of a worker's heartbeats. They come from a thread of their own, so a node that uses every core does not delay
    /// them.
    pub heartbeat: Duration,
    /// Declare a worker lost after it has sent nothing for this long, or has read nothing for this long although messages for it are
    /// queued. At least two heartbeats.
    pub lost_after: Duration,
    /// How many leases a worker holds beyond its threads, so that it never waits for the next one. It holds more if its nodes take
    /// less than a millisecond.
    pub spare_leases: usize,
    /// A node becomes a suspect, which runs alone on a fresh worker, after this many workers have died while they executed it.
    pub suspect_after: u32,
    /// A suspect fails after this many workers have died while they executed it alone.
    pub node_crashes: u32,
    /// How long a suspect waits for a worker that has executed nothing yet. Then it takes any worker that holds no lease, and if there
    /// is none, one is freed for it.
    pub suspect_patience: Duration,
    /// When a slow node also runs on a second worker.
    pub speculation: Speculation,
    /// The share of the nodes with outputs that the planner cannot check that run twice, to compare the outputs.
    pub verify_fraction: f64,
    /// Changes which nodes are chosen for verification.
    pub verify_seed: u64,
    /// How long a worker that is asked to end may take to finish the nodes that it executes. A worker's own `--drain-time` takes
    /// precedence.
    pub drain_time: Duration,
    /// How long to wait for the first worker.
    pub wait_for_workers: Duration,
    /// The interval at which the user is told that the run waits for workers.
    pub remind_every: Duration,
    /// How long to wait for another worker after the last one was lost.
    pub grace: Duration,
}

/// The defaults of design section 8.
impl Default for Policy {
    fn default() -> Self {
        Self {
            heartbeat: Duration::from_secs(1),
            lost_after: Duration::from_secs(5),
            spare_leases: 2,
            suspect_after: 2,
            node_crashes: 3,
            // A local worker is restarted in less.
            suspect_patience: Duration::from_secs(2),
            speculation: Speculation::default(),
            verify_fraction: 0.0,
            verify_seed: 0,
            // The time that Slurm leaves between SIGTERM and SIGKILL.
            drain_time: Duration::from_secs(30),
            wait_for_workers: Duration::from_mins(10),
            remind_every: Duration::from_secs(30),
            grace: Duration::from_mins(1),
        }
    }
}

/// When a node counts as slow. An idle worker then runs it too, and the first result is used.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Speculation {
    /// A node is slow after this many times the median time of its kind. At least 1; `None`: no node is slow. Until a node of its
    /// kind has finished, the limit is this many times the longest time of any node, and at least twelve times
    /// [`after`](Self::after).
    pub factor: Option<f64>,
    /// No node is slow before it has run for this long. A node that its worker has not begun for this long, although a thread is free,
    /// is slow too.
    pub after: Duration,
}

impl Default for Speculation {
    fn default() -> Self {
        Self { factor: Some(2.0), after: Duration::from_secs(5) }
    }
}

/// An invalid value of a policy.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum PolicyError {
    /// The interval of heartbeats is too short or too long.
    #[error("--heartbeat: expected 10ms to 1h, found {}", humantime::format_duration(*.found))]
    Heartbeat {
        /// The given time.
        found: Duration,
    },
    /// One late heartbeat would make a worker lost.
    #[error(
        "--lost-after: expected at least two heartbeats, {}, found {}; wait longer, or shorten --heartbeat",
        humantime::format_duration(*.expected), humantime::format_duration(*.found)
    )]
    LostAfter {
        /// Two heartbeats.
        expected: Duration,
        /// The given time.
        found: Duration,
    },
    /// A duration over one year, most likely a typing error.
    #[error("{flag}: expected at most a year, found {}", humantime::format_duration(*.found))]
    TooLong {
        /// The flag.
        flag: &'static str,
        /// The given time.
        found: Duration,
    },
    /// A count that must be at least 1.
    #[error("{flag}: expected 1 or more, found 0")]
    Zero {
        /// The flag.
        flag: &'static str,
    },
    /// Too many spare leases, most likely a typing error.
    #[error("--spare-leases: expected at most {MOST_SPARE_LEASES}, found {found}")]
    SpareLeases {
        /// The given number.
        found: usize,
    },
    /// A factor below 1, with which most nodes would be slow, or one that is not a number or too large.
    #[error("--speculate: expected on, off, or a factor of at least 1, found {found}")]
    Factor {
        /// The given factor.
        found: f64,
    },
    /// A share outside 0 to 1.
    #[error("--verify-fraction: expected a number from 0 to 1, found {found}")]
    Fraction {
        /// The given number.
        found: f64,
    },
}

/// The most leases beyond its threads that a worker may hold.
const MOST_SPARE_LEASES: usize = 1000;

/// A worker declares its coordinator lost after this many times [`lost_after`](Policy::lost_after) of silence. A busy coordinator may send
/// its heartbeats late.
const SILENCES: u32 = 3;

impl Policy {
    /// How long a worker waits for a byte from its coordinator.
    #[must_use]
    pub fn silence(&self) -> Duration {
        SILENCES * self.lost_after
    }

    /// Check the policy.
    ///
    /// # Errors
    /// The first invalid value.
    pub fn check(&self) -> Result<(), PolicyError> {
        let beats = Duration::from_millis(10)..=Duration::from_hours(1);
        if !beats.contains(&self.heartbeat) {
            return Err(PolicyError::Heartbeat { found: self.heartbeat });
        }
        let times = [
            ("--lost-after", self.lost_after),
            ("--speculate-after", self.speculation.after),
            ("--drain-time", self.drain_time),
            ("--wait-for-workers", self.wait_for_workers),
            ("--grace", self.grace),
        ];
        if let Some((flag, found)) = times.into_iter().find(|(_, time)| *time > LONGEST) {
            return Err(PolicyError::TooLong { flag, found });
        }
        if self.lost_after < 2 * self.heartbeat {
            return Err(PolicyError::LostAfter { expected: 2 * self.heartbeat, found: self.lost_after });
        }
        let counts = [("--suspect-after", self.suspect_after), ("--node-crashes", self.node_crashes)];
        if let Some((flag, _)) = counts.into_iter().find(|(_, count)| *count == 0) {
            return Err(PolicyError::Zero { flag });
        }
        if self.spare_leases > MOST_SPARE_LEASES {
            return Err(PolicyError::SpareLeases { found: self.spare_leases });
        }
        if let Some(found) = self.speculation.factor.filter(|factor| !(1.0..=MOST_FACTOR).contains(factor)) {
            return Err(PolicyError::Factor { found });
        }
        if !(0.0..=1.0).contains(&self.verify_fraction) {
            return Err(PolicyError::Fraction { found: self.verify_fraction });
        }
        Ok(())
    }
}

/// The longest time in a policy.
const LONGEST: Duration = Duration::from_hours(24 * 366);

/// The largest factor. With it, no node is slow in practice.
const MOST_FACTOR: f64 = 1e6;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_are_valid_and_invalid_values_are_named() {
        assert_eq!(Policy::default().check(), Ok(()));
        let said = |change: fn(&mut Policy)| {
            let mut policy = Policy::default();
            change(&mut policy);
            policy.check().unwrap_err().to_string()
        };
        let late = said(|policy| policy.heartbeat = Duration::from_secs(3));
        assert!(late.starts_with("--lost-after: expected at least two heartbeats, 6s, found 5s"), "{late}");
        assert!(said(|policy| policy.heartbeat = Duration::ZERO).contains("--heartbeat"));
        assert!(said(|policy| policy.grace = Duration::MAX).starts_with("--grace: expected at most a year"));
        assert!(said(|policy| policy.node_crashes = 0).contains("--node-crashes: expected 1 or more"));
        assert!(said(|policy| policy.suspect_after = 0).contains("--suspect-after"));
        assert!(said(|policy| policy.spare_leases = 5000).contains("--spare-leases"));
        for factor in [0.5, f64::NAN, f64::INFINITY] {
            let mut policy = Policy::default();
            policy.speculation.factor = Some(factor);
            assert!(policy.check().unwrap_err().to_string().contains("--speculate"), "{factor}");
        }
        for fraction in [-0.1, 1.1, f64::NAN] {
            let policy = Policy { verify_fraction: fraction, ..Policy::default() };
            assert!(policy.check().unwrap_err().to_string().contains("from 0 to 1"), "{fraction}");
        }
    }
}
