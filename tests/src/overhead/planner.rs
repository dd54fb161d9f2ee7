//! Rounds of nodes, each begun when the one before is complete, and the time that each took.

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use lookalike::graph::{Blob, GraphEdit, NodeId, NodeSpec, Placement, PlanError, Planner};
use nix::sys::resource::{UsageWho, getrusage};

use super::{ROUND, WORKERS};

/// The fewest rounds before the first one that counts.
const WARM_UP: usize = 50;

/// Plans rounds, and times them.
pub(super) struct Rounds {
    /// How many workers have joined, as reported by the observer.
    joined: Arc<AtomicUsize>,
    /// The sizes of the rounds to come.
    sizes: VecDeque<usize>,
    warm_up: usize,
    size: usize,
    open: usize,
    next_node: u64,
    began: Instant,
    cpu_before: Duration,
    parts: Vec<Duration>,
    /// What was measured.
    pub(super) measured: Vec<Round>,
}

/// What one round took.
pub(super) struct Round {
    pub(super) elapsed: Duration,
    /// The processor time of this process meanwhile.
    pub(super) cpu: Duration,
    /// When each tenth of the nodes was done.
    pub(super) tenths: Vec<Duration>,
}

impl Rounds {
    /// Measure rounds of these sizes, once all workers have joined and the warm-up is over.
    pub(super) fn new(sizes: impl IntoIterator<Item = usize>, joined: Arc<AtomicUsize>) -> Self {
        Self {
            joined,
            sizes: sizes.into_iter().collect(),
            warm_up: WARM_UP,
            size: 0,
            open: 0,
            next_node: 0,
            began: Instant::now(),
            cpu_before: Duration::ZERO,
            parts: Vec::new(),
            measured: Vec::new(),
        }
    }

    fn is_warm(&self) -> bool {
        self.warm_up == 0 && self.joined.load(Ordering::Relaxed) >= WORKERS
    }

    fn begin(&mut self, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        let size = if self.is_warm() { self.sizes.pop_front() } else { Some(ROUND) };
        let Some(size) = size else { return Ok(()) };
        (self.began, self.cpu_before) = (Instant::now(), cpu_time(UsageWho::RUSAGE_SELF));
        (self.size, self.open) = (size, size);
        self.parts.clear();
        for _ in 0..size {
            self.next_node += 1;
            graph.add_node(node("nothing", self.next_node))?;
        }
        Ok(())
    }

    fn end(&mut self) {
        if !self.is_warm() {
            self.warm_up = self.warm_up.saturating_sub(1);
            return;
        }
        let cpu = cpu_time(UsageWho::RUSAGE_SELF).saturating_sub(self.cpu_before);
        let tenths = std::mem::take(&mut self.parts);
        self.measured.push(Round { elapsed: self.began.elapsed(), cpu, tenths });
    }
}

impl Planner for Rounds {
    fn start(&mut self, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        self.begin(graph)
    }

    fn completed(&mut self, _: NodeId, _: &Blob, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        self.open -= 1;
        if (self.size - self.open) * 10 >= (self.parts.len() + 1) * self.size {
            self.parts.push(self.began.elapsed());
        }
        if self.open == 0 {
            self.end();
            self.begin(graph)?;
        }
        Ok(())
    }
}

/// A node whose output no other node uses, different from any other.
pub(super) fn node(kind: &str, number: u64) -> NodeSpec {
    let (label, parameters) = (format!("{kind} {number}"), number.to_le_bytes().to_vec());
    NodeSpec {
        kind: kind.into(),
        label: label.into(),
        parameters,
        inputs: Vec::new(),
        placement: Placement::Worker,
        priority: 0,
    }
}

/// The processor time used by this process or its children.
pub(super) fn cpu_time(who: UsageWho) -> Duration {
    let Ok(usage) = getrusage(who) else { return Duration::ZERO };
    let of = |time: nix::sys::time::TimeVal| {
        let seconds = u64::try_from(time.tv_sec()).unwrap_or_default();
        Duration::from_secs(seconds) + Duration::from_micros(u64::try_from(time.tv_usec()).unwrap_or_default())
    };
    of(usage.user_time()) + of(usage.system_time())
}
