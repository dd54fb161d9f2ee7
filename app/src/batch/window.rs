//! How many fits run at a time: enough to keep all workers busy, few enough for memory.

use super::backlog::Load;
use crate::settings::StageTwo;
use lookalike::graph::WorkerId;
use lookalike_coordinator::events::RunEvent;
use std::{
    collections::BTreeMap,
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicUsize, Ordering},
    },
};

/// How many nodes the workers can run at a time, updated by the run's events and read by [`Window`].
#[derive(Debug)]
pub(super) struct Demand {
    threads: AtomicUsize,
    workers: Mutex<BTreeMap<WorkerId, usize>>,
    expected: usize,
}

impl Demand {
    /// Before workers join, each expected worker counts as one thread.
    pub(super) fn expecting(workers: usize) -> Self {
        Self { threads: AtomicUsize::new(workers), workers: Mutex::default(), expected: workers }
    }

    /// Counts workers that join and leave.
    pub(super) fn note(&self, event: &RunEvent) {
        let mut workers = self.workers.lock().unwrap_or_else(PoisonError::into_inner);
        match event {
            RunEvent::WorkerJoined { worker, threads, .. } => _ = workers.insert(*worker, *threads),
            RunEvent::WorkerLeft { worker, .. } => _ = workers.remove(worker),
            _ => return,
        }
        let threads: usize = workers.values().sum();
        self.threads.store(threads.max(self.expected), Ordering::Relaxed);
    }

    fn threads(&self) -> usize {
        self.threads.load(Ordering::Relaxed).max(1)
    }
}

/// Nodes that should be ready for each thread of the workers: one to run now and one to run next.
const READY_PER_THREAD: usize = 2;

/// The most bytes that running fits may take together (1 GiB), unless a single fit takes more.
const MOST_BYTES: usize = 1 << 30;

/// Bytes that a fit takes per pixel of its photo: photo, coverage, view, and a full-resolution table of typical size. If the
/// widths of a material's candidates differ much, its tables take up to three times as much.
const BYTES_PER_PIXEL: usize = 400;

/// Decides whether another fit begins.
#[derive(Debug)]
pub(super) struct Window {
    demand: Arc<Demand>,
    stage_two: StageTwo,
    /// Threads of this process.
    cores: usize,
}

impl Window {
    pub(super) fn new(demand: Arc<Demand>, stage_two: StageTwo) -> Self {
        Self { demand, stage_two, cores: rayon::current_num_threads() }
    }

    /// Whether another fit with this many pixels should begin beside those that are in memory, with `ready` nodes for the
    /// workers.
    pub(super) fn has_room(&self, there: Load, ready: usize, pixels: usize) -> bool {
        let threads = self.demand.threads();
        // Polish occupies one thread per fit. If it runs in this process, more fits would only wait for its threads.
        let most_active = match self.stage_two {
            StageTwo::Workers => 2 * threads,
            StageTwo::Coordinator => self.cores + threads.div_ceil(4) + 1,
        };
        let bytes = (there.pixels + pixels).saturating_mul(BYTES_PER_PIXEL);
        ready < READY_PER_THREAD * threads && there.fits < most_active && bytes <= MOST_BYTES
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lookalike_coordinator::events::Departure;

    fn window(threads: usize, stage_two: StageTwo) -> Window {
        let demand = Arc::new(Demand::expecting(1));
        demand.note(&RunEvent::WorkerJoined { worker: WorkerId(1), threads, process: 0 });
        Window { demand, stage_two, cores: 2 }
    }

    fn has_room(window: &Window, fits: usize, ready: usize, there: usize, pixels: usize) -> bool {
        window.has_room(Load { fits, pixels: there }, ready, pixels)
    }

    #[test]
    fn fits_begin_until_the_workers_have_enough_to_do() {
        let window = window(8, StageTwo::Workers);
        assert!(has_room(&window, 1, 15, 0, 0) && !has_room(&window, 1, 16, 0, 0));
        assert!(has_room(&window, 15, 0, 0, 0) && !has_room(&window, 16, 0, 0, 0));
        window.demand.note(&RunEvent::WorkerLeft { worker: WorkerId(1), departure: Departure::Lost });
        assert!(has_room(&window, 1, 1, 0, 0) && !has_room(&window, 1, 2, 0, 0), "the expected worker still counts");
    }

    #[test]
    fn fits_do_not_queue_up_for_a_coordinator_that_cannot_keep_up() {
        let window = window(8, StageTwo::Coordinator);
        assert!(has_room(&window, 4, 0, 0, 0) && !has_room(&window, 5, 0, 0, 0));
    }

    #[test]
    fn fits_under_way_have_room_in_memory() {
        let window = window(64, StageTwo::Workers);
        assert!(has_room(&window, 9, 0, 9 << 18, 1 << 18) && !has_room(&window, 10, 0, 10 << 18, 1 << 18));
    }
}
