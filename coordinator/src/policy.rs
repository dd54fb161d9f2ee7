//! The policy of a run: time limits for workers, and limits on the deaths of nodes (design section 8).

use std::time::Duration;

use thiserror::Error;

/// How the coordinator treats workers and nodes. What a user may want to change has a flag of the same name.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Policy {
    /// How often a worker shall tell that it lives (default 1 s). It does so from a thread of its own, so a node that keeps
    /// every core busy does not delay it.
    pub heartbeat: Duration,
    /// Declare a worker lost after it has sent nothing for this long, or has read nothing for this long though something waits for it
    /// (default 5 s, at least two heartbeats).
    pub lost_after: Duration,
    /// How many leases a worker holds beyond its threads, so that it never waits for the next one (default 2); more of nodes that
    /// take less than a millisecond.
    pub spare_leases: usize,
    /// After so many deaths of workers that were executing a node, the node is a suspect and runs alone on a fresh worker
    /// (default 2).
    pub suspect_after: u32,
    /// A suspect fails once so many workers have died while they executed it alone (default 3).
    pub node_crashes: u32,
    /// How long a suspect waits for a worker that has executed nothing yet, before it takes any that is idle, and makes one
    /// idle if none is (default 2 s: a local worker is started again in less).
    pub suspect_patience: Duration,
    /// When slow nodes are run on a second worker as well.
    pub speculation: Speculation,
    /// Which share of the nodes whose outputs the planner cannot check is run twice, to compare the outputs (default 0).
    pub verify_fraction: f64,
    /// Makes the choice of these nodes another one (default 0).
    pub verify_seed: u64,
    /// How long a worker that is asked to end may take to finish what it executes (default 30 s, as Slurm waits between
    /// SIGTERM and SIGKILL). A worker's own `--drain-time` wins.
    pub drain_time: Duration,
    /// How long to wait for the first worker (default 10 min).
    pub wait_for_workers: Duration,
    /// How often to tell the user about it (default 30 s).
    pub remind_every: Duration,
    /// How long to wait for another worker after the last one was lost (default 1 min).
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
            suspect_patience: Duration::from_secs(2),
            speculation: Speculation::default(),
            verify_fraction: 0.0,
            verify_seed: 0,
            drain_time: Duration::from_secs(30),
            wait_for_workers: Duration::from_mins(10),
            remind_every: Duration::from_secs(30),
            grace: Duration::from_mins(1),
        }
    }
}

/// When a node is slow: a second worker runs it too if it has nothing else to do, and the first answer counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Speculation {
    /// A node is slow once it runs this many times as long as the median of its kind (default 2, at least 1); `None`: no node
    /// ever is. Before a node of the kind is complete, it is so many times the longest time of any node, and at least twelve times
    /// [`after`](Self::after).
    pub factor: Option<f64>,
    /// A node is not slow before it has run for this long (default 5 s). A worker that does not begin with the next node for
    /// this long, though it has a thread for it, is slow with it too.
    pub after: Duration,
}

impl Default for Speculation {
    fn default() -> Self {
        Self { factor: Some(2.0), after: Duration::from_secs(5) }
    }
}

/// A policy that makes no sense.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum PolicyError {
    /// No heartbeat, or a very rare one.
    #[error("--heartbeat: expected 10ms to 1h, found {}", humantime::format_duration(*.found))]
    Heartbeat {
        /// The given time.
        found: Duration,
    },
    /// A worker would be lost because of one late heartbeat.
    #[error(
        "--lost-after: expected at least two heartbeats, {}, found {}; wait longer, or let workers tell more often with --heartbeat",
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
    /// A count that has to be at least 1.
    #[error("{flag}: expected 1 or more, found 0")]
    Zero {
        /// The flag.
        flag: &'static str,
    },
    /// Too many, most likely a typing error.
    #[error("--spare-leases: expected at most {MOST_SPARE_LEASES}, found {found}")]
    SpareLeases {
        /// The given number.
        found: usize,
    },
    /// A factor that would run every node twice, or none at all.
    #[error("--speculate: expected on, off, or a factor of at least 1, found {found}")]
    Factor {
        /// The given factor.
        found: f64,
    },
    /// Not a share.
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
    /// How long a worker waits for any word of its coordinator.
    #[must_use]
    pub fn silence(&self) -> Duration {
        SILENCES * self.lost_after
    }

    /// That the policy makes sense.
    ///
    /// # Errors
    /// What does not.
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

/// The longest time that a policy may name.
const LONGEST: Duration = Duration::from_hours(24 * 366);

/// Beyond this, no node is ever slow.
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
