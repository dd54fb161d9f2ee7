//! The workers of an earlier coordinator: nothing is given out before they are back, or had the time to be. Otherwise one would
//! be given what another has in hand, and run it a second time.

use std::time::Duration;

use lookalike::graph::WorkerId;
use lookalike::protocol::{LeaseName, ProcessName};
use tokio::time::Instant;

use crate::comm::WorkerProcess;

/// How long to wait for them: their longest pause between two attempts to connect, and a little more.
const RETURN_TIME: Duration = Duration::from_secs(6);

/// A worker that has joined while others were waited for.
#[derive(Debug)]
pub(super) struct Arrival {
    pub(super) worker: WorkerId,
    pub(super) threads: usize,
    pub(super) process: WorkerProcess,
    /// What it executes for an earlier coordinator, once it has said so.
    pub(super) executing: Option<Vec<LeaseName>>,
}

/// Who is waited for, and who has come meanwhile.
#[derive(Debug)]
pub(super) struct Survivors {
    expected: Vec<ProcessName>,
    arrivals: Vec<Arrival>,
    pub(super) until: Instant,
}

impl Survivors {
    /// Wait for these processes; `None` if there are none.
    pub(super) fn expect(expected: Vec<ProcessName>, now: Instant) -> Option<Self> {
        (!expected.is_empty()).then(|| Self { expected, arrivals: Vec::new(), until: now + RETURN_TIME })
    }

    /// A worker has joined.
    pub(super) fn joined(&mut self, worker: WorkerId, threads: usize, process: WorkerProcess) {
        self.arrivals.push(Arrival { worker, threads, process, executing: None });
    }

    /// A worker has said what it executes for an earlier coordinator.
    pub(super) fn reported(&mut self, worker: WorkerId, executing: Vec<LeaseName>) {
        let arrival = self.arrivals.iter_mut().find(|arrival| arrival.worker == worker);
        arrival.into_iter().for_each(|arrival| arrival.executing = Some(executing.clone()));
    }

    /// A worker has left again.
    pub(super) fn left(&mut self, worker: WorkerId) {
        self.arrivals.retain(|arrival| arrival.worker != worker);
    }

    /// This process is not waited for any more.
    pub(super) fn dismissed(&mut self, process: ProcessName) {
        self.expected.retain(|expected| *expected != process);
    }

    /// Whether all are there, or had the time.
    pub(super) fn are_complete(&self, now: Instant) -> bool {
        let has_reported =
            |arrival: &Arrival, name: &ProcessName| arrival.process.name == *name && arrival.executing.is_some();
        let is_here = |name: &ProcessName| self.arrivals.iter().any(|arrival| has_reported(arrival, name));
        now >= self.until || self.expected.iter().all(is_here)
    }

    /// Who has come.
    pub(super) fn into_arrivals(self) -> Vec<Arrival> {
        self.arrivals
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn name(byte: u8) -> ProcessName {
        ProcessName([byte; 16])
    }

    /// As in containers, where every process has the same number.
    fn process(byte: u8) -> WorkerProcess {
        WorkerProcess { id: 1, name: name(byte), is_local: false }
    }

    #[test]
    fn waiting_ends_when_all_have_reported_or_had_the_time() {
        let now = Instant::now();
        assert!(Survivors::expect(Vec::new(), now).is_none());
        let mut survivors = Survivors::expect(vec![11, 12, 13].into_iter().map(name).collect(), now).unwrap();
        let [a, b, stranger] = [1, 2, 3].map(WorkerId);
        survivors.joined(a, 1, process(11));
        survivors.joined(stranger, 4, process(99));
        survivors.joined(b, 1, process(12));
        survivors.reported(a, vec![LeaseName { node: 5, attempt: 1, epoch: 1 }]);
        survivors.dismissed(name(13));
        assert!(!survivors.are_complete(now) && survivors.are_complete(now + RETURN_TIME));
        survivors.reported(b, Vec::new());
        assert!(survivors.are_complete(now));
        survivors.left(a);
        assert!(!survivors.are_complete(now));
        let back = survivors.into_arrivals();
        assert_eq!(back.iter().map(|arrival| arrival.worker).collect::<Vec<_>>(), [stranger, b]);
    }
}
