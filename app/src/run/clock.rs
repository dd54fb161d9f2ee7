//! Seconds per stage and per process. They are shown to the user; no result depends on them.

use lookalike::nodes;
use lookalike_coordinator::events::RunEvent;
use nix::sys::{
    resource::{Usage, UsageWho, getrusage},
    time::TimeVal,
};
use std::time::Instant;

/// Records when the stages end.
#[derive(Debug)]
pub(crate) struct Clock {
    began: Instant,
    ends: [Option<f64>; 4],
}

const NAMES: [&str; 4] = ["stage one", "stage two", "polish", "pictures"];
const LAST_KINDS: [&str; 4] = [nodes::SEARCH, nodes::SELECT, nodes::POLISH, nodes::REPORT];

impl Clock {
    pub(crate) fn start() -> Self {
        Self { began: Instant::now(), ends: [None; 4] }
    }

    pub(crate) fn note(&mut self, event: &RunEvent) {
        if let RunEvent::NodeFinished { name, .. } | RunEvent::NodeRecalled { name, .. } = event
            && let Some(stage) = LAST_KINDS.iter().position(|kind| *kind == name.kind)
        {
            self.ends[stage] = Some(self.total());
        }
    }

    /// Ends the last stage.
    pub(crate) fn end(&mut self) {
        self.ends[NAMES.len() - 1] = Some(self.total());
    }

    /// Seconds of each stage that ran; a stage begins where the one before it ended.
    pub(crate) fn stages(&self) -> Vec<(&'static str, f64)> {
        let mut last = 0.0;
        let seconds = NAMES.iter().zip(&self.ends).filter_map(|(name, end)| {
            let seconds = (*end)? - last;
            last = (*end)?;
            Some((*name, seconds))
        });
        seconds.collect()
    }

    /// Seconds since the start.
    pub(crate) fn total(&self) -> f64 {
        self.began.elapsed().as_secs_f64()
    }
}

/// User and system time of this process and of its local workers, which must have ended.
pub(crate) fn cpu_seconds() -> Vec<(&'static str, f64)> {
    let seconds = |time: TimeVal| time.tv_sec() as f64 + time.tv_usec() as f64 * 1e-6;
    let of = |usage: Usage| seconds(usage.user_time()) + seconds(usage.system_time());
    let who = [("coordinator", UsageWho::RUSAGE_SELF), ("local workers", UsageWho::RUSAGE_CHILDREN)];
    who.into_iter().filter_map(|(name, who)| Some((name, of(getrusage(who).ok()?)))).collect()
}
