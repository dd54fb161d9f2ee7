//! State shared by the processes of a simulated run and the code that causes faults.

use std::collections::{BTreeMap, BTreeSet};
use std::net::{IpAddr, SocketAddr};
use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, PoisonError, Weak};
use std::time::Duration;

use lookalike_coordinator::state::RunSummary;
use lookalike_worker::ending::Wishes;

use super::wire::WireControl;

/// Where a process runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Place {
    Coordinator,
    Worker(usize),
}

impl Place {
    /// The name of its host.
    pub(super) fn host(self) -> String {
        match self {
            Self::Coordinator => "coordinator".into(),
            Self::Worker(index) => format!("worker-{index}"),
        }
    }

    /// Where a connection comes from: turmoil counts the addresses of hosts from 1, and the coordinator is the first.
    pub(super) fn of(address: SocketAddr) -> Self {
        let number = match address.ip() {
            IpAddr::V4(address) => usize::from(address.octets()[3]),
            IpAddr::V6(_) => 0,
        };
        number.checked_sub(2).map_or(Self::Coordinator, Self::Worker)
    }
}

/// The result of a run: the outcome of each node, and the summary.
pub(super) type Outcome = Result<(BTreeMap<String, String>, RunSummary), String>;

/// State shared by all processes of a run.
#[derive(Debug)]
pub(super) struct Stage {
    pub(super) seed: u64,
    pub(super) folder: PathBuf,
    /// The shortest and the longest time that most nodes take, in milliseconds.
    pub(super) node_ms: (u64, u64),
    state: Mutex<State>,
}

#[derive(Debug, Default)]
pub(super) struct State {
    /// Lines with time, place and event.
    trace: Vec<String>,
    /// Violations of what must hold.
    pub(super) wrong: Vec<String>,
    /// Each end of each connection: the worker of its link, and the place of the end.
    wires: Vec<(Place, Place, Weak<WireControl>)>,
    /// Places whose process is about to be killed by the node that it executes.
    pub(super) dying: BTreeSet<Place>,
    pub(super) stuck: BTreeSet<Place>,
    pub(super) slow: BTreeMap<Place, u32>,
    /// The means to ask the worker in a place to end.
    pub(super) wishes: BTreeMap<Place, Wishes>,
    /// The workers that have ended by themselves, and whether they were asked to.
    pub(super) ended: Vec<(usize, bool)>,
    /// How many processes each place has had.
    pub(super) processes: BTreeMap<Place, u32>,
    /// The processes that had a fault.
    pub(super) harmed: BTreeSet<u32>,
    /// The processes of the workers that have joined the present coordinator.
    pub(super) joined: BTreeSet<u32>,
    /// The nodes whose outputs were reported, and by which coordinator.
    pub(super) finished: BTreeMap<String, u32>,
    pub(super) outcome: Option<Outcome>,
}

impl Stage {
    pub(super) fn new(seed: u64, folder: PathBuf, node_ms: (u64, u64)) -> Self {
        Self { seed, folder, node_ms, state: Mutex::default() }
    }

    pub(super) fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Add a line to the trace, with the current time.
    pub(super) fn say(&self, place: Place, what: &str) {
        self.note(turmoil::sim_elapsed().unwrap_or_default(), place, what);
    }

    /// Add a line to the trace.
    pub(super) fn note(&self, at: Duration, place: Place, what: &str) {
        self.state().trace.push(format!("{:9.3} {:<11} {what}", at.as_secs_f64(), place.host()));
    }

    /// Record a violation of what must hold.
    pub(super) fn wrong(&self, what: String) {
        self.state().wrong.push(what);
    }

    /// The trace, one line each.
    pub(super) fn trace(&self) -> String {
        self.state().trace.join("\n")
    }

    /// The number of the next process in a place.
    pub(super) fn next_process(&self, place: Place) -> u32 {
        let mut state = self.state();
        let count = state.processes.entry(place).or_default();
        *count += 1;
        number(place, *count)
    }

    /// The number of the process that runs in a place, or did.
    pub(super) fn process(&self, place: Place) -> u32 {
        number(place, self.state().processes.get(&place).copied().unwrap_or(0))
    }

    /// Record a new connection on the link to a worker.
    pub(super) fn laid(&self, link: Place, end: Place, control: Weak<WireControl>) {
        let mut state = self.state();
        state.wires.retain(|(.., control)| control.strong_count() > 0);
        state.wires.push((link, end, control));
    }

    /// The ends of the open connections on the link to a worker.
    pub(super) fn wires(&self, link: Place) -> Vec<(Place, Weak<WireControl>)> {
        let state = self.state();
        let on_link = state.wires.iter().filter(|(other, ..)| *other == link);
        on_link.map(|(_, end, control)| (*end, Weak::clone(control))).collect()
    }

    /// The process in a place is about to be killed by its node: it sends nothing from now on.
    pub(super) fn mark_dying(&self, place: Place) {
        self.say(place, "runs a deadly node");
        let ends = self.wires(place).into_iter().filter(|(end, _)| *end == place);
        ends.filter_map(|(_, control)| control.upgrade()).for_each(|control| control.mute());
        self.state().dying.insert(place);
    }

    pub(super) fn is_stuck(&self, place: Place) -> bool {
        self.state().stuck.contains(&place)
    }

    pub(super) fn slowness(&self, place: Place) -> u32 {
        self.state().slow.get(&place).copied().unwrap_or(1)
    }
}

fn number(place: Place, count: u32) -> u32 {
    let place = match place {
        Place::Coordinator => 0,
        Place::Worker(index) => u32::try_from(index).unwrap_or(0) + 1,
    };
    1000 * (place + 1) + count
}
