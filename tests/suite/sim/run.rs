//! One simulated run, from its seed to its end.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::num::NonZeroUsize;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, SystemTime};

use lookalike::graph::{Execution, run_in_process};
use lookalike_coordinator::access::Credentials;
use lookalike_coordinator::state::RunSummary;
use lookalike_tests::journal::JournalView;
use tempfile::TempDir;
use turmoil::{Builder, Sim};

use super::chance::Chance;
use super::events::{Event, Link};
use super::processes::{PORT, coordinate, policy, work};
use super::stage::{Place, Stage};
use super::web::{Web, registry};

/// A longer run hangs: every fault is much shorter.
const LONGEST_RUN: Duration = Duration::from_secs(300);

/// The longest time between the end of a coordinator and that of a worker that it has told to end, with any network fault.
const LAST_WORDS: Duration = Duration::from_secs(5);

/// The outcome of a run.
#[derive(Clone, Debug)]
pub(super) struct Ending {
    /// The faults, and how often each happened.
    pub(super) faults: BTreeMap<&'static str, u32>,
    /// How long it took, in simulated time.
    pub(super) time: Duration,
    /// The summary of its last coordinator.
    pub(super) summary: RunSummary,
    pub(super) nodes: usize,
    pub(super) coordinators: u32,
    /// All events, with their times.
    pub(super) trace: String,
}

/// Simulate the run of a seed.
///
/// # Errors
/// When a check fails: its message, with the trace.
pub(super) fn simulate(seed: u64) -> Result<Ending, String> {
    let folder = temporary_folder();
    let mut run = Run::new(seed, &folder);
    let outcome = run.go_on().and_then(|()| run.judge());
    outcome.map_err(|wrong| format!("{wrong}\n\n{}\n{wrong}", run.stage.trace()))
}

/// In memory where that is possible, because the time of disk accesses is simulated.
fn temporary_folder() -> TempDir {
    let memory = Path::new("/dev/shm");
    let folder = if memory.is_dir() { tempfile::tempdir_in(memory) } else { tempfile::tempdir() };
    folder.expect("a temporary folder")
}

/// A run in progress.
pub(super) struct Run {
    pub(super) stage: Arc<Stage>,
    pub(super) sim: Sim<'static>,
    pub(super) chance: Chance,
    pub(super) workers: usize,
    /// Planned events by time, then in the order in which they were planned.
    pub(super) events: BTreeMap<(Duration, u64), Event>,
    pub(super) planned: u64,
    pub(super) faults_left: u64,
    /// The longest time between two faults, in milliseconds.
    pub(super) pause_ms: u64,
    /// The workers whose links have a fault.
    pub(super) broken: BTreeMap<usize, Link>,
    /// Places without a process.
    pub(super) absent: BTreeSet<Place>,
    /// The workers that have ended without having been asked to, and when.
    pub(super) left_unasked: Vec<(usize, Duration)>,
    /// When coordinators ended.
    pub(super) coordinators_ended: Vec<Duration>,
    pub(super) faults: BTreeMap<&'static str, u32>,
}

impl Run {
    fn new(seed: u64, folder: &TempDir) -> Self {
        let mut chance = Chance::new(seed, 0);
        let mut builder = Builder::new();
        builder.rng_seed(seed).enable_random_order().epoch(SystemTime::UNIX_EPOCH);
        builder.simulation_duration(2 * LONGEST_RUN).tick_duration(Duration::from_millis(chance.of(&[5, 10, 20])));
        builder.min_message_latency(Duration::from_millis(1)).max_message_latency(chance.time(2, 150));
        let mut sim = builder.build();
        let longest_node = chance.of(&[50, 500, 2000]);
        let stage = Arc::new(Stage::new(seed, folder.path().to_owned(), (1, longest_node)));
        let policy = policy(&mut chance);
        let address = format!("{}:{PORT}", sim.lookup(Place::Coordinator.host()));
        let credentials = Credentials::new(address, SystemTime::now()).expect("credentials");
        credentials.write(&folder.path().join("access.json")).expect("an access file");
        let shared = Arc::clone(&stage);
        sim.host(Place::Coordinator.host(), move || {
            let stage = Arc::clone(&shared);
            async move {
                coordinate(stage, policy).await;
                Ok(())
            }
        });
        let workers = usize::try_from(chance.between(1, 5)).unwrap_or(1);
        for index in 0..workers {
            let (shared, late) = (Arc::clone(&stage), chance.time(0, 5000));
            let threads =
                NonZeroUsize::new(usize::try_from(chance.between(1, 4)).unwrap_or(1)).unwrap_or(NonZeroUsize::MIN);
            sim.host(Place::Worker(index).host(), move || {
                let stage = Arc::clone(&shared);
                async move {
                    work(stage, index, threads, late).await;
                    Ok(())
                }
            });
        }
        let faults_left = chance.between(0, 30);
        let pause_ms = chance.of(&[300, 1000, 3000]);
        let mut run = Self {
            stage,
            sim,
            chance,
            workers,
            events: BTreeMap::new(),
            planned: 0,
            faults_left,
            pause_ms,
            broken: BTreeMap::new(),
            absent: BTreeSet::new(),
            left_unasked: Vec::new(),
            coordinators_ended: Vec::new(),
            faults: BTreeMap::new(),
        };
        run.plan_fault();
        run
    }

    fn go_on(&mut self) -> Result<(), String> {
        loop {
            self.sim.step().map_err(|error| format!("a process has panicked: {error}"))?;
            self.mark_dead();
            let now = self.sim.elapsed();
            while let Some(next) = self.events.first_entry().filter(|next| next.key().0 <= now) {
                let event = next.remove();
                self.perform(event);
            }
            let state = self.stage.state();
            if let Some(wrong) = state.wrong.first() {
                return Err(wrong.clone());
            }
            if state.outcome.is_some() {
                return Ok(());
            }
            if now > LONGEST_RUN {
                return Err(format!("the run hangs: it is not over after {LONGEST_RUN:?}"));
            }
        }
    }

    /// Compare the outcome of the run with that in one process.
    fn judge(&mut self) -> Result<Ending, String> {
        let outcome = self.stage.state().outcome.take().ok_or("no outcome")?;
        let (results, summary) = outcome.map_err(|error| format!("the run has failed: {error}"))?;
        let expected = run_in_process(Web::new(self.stage.seed), &registry(), Execution::Sequential);
        let expected = expected.map_err(|error| format!("the reference has failed: {error}"))?.results;
        if results != expected {
            return Err(format!(
                "the results are others than those of one process:\n{}",
                differences(&results, &expected)
            ));
        }
        let run_twice = JournalView::of(&self.stage.folder).run_twice();
        if run_twice > 0 {
            return Err(format!("{run_twice} nodes were given out though their results were written down"));
        }
        self.end_workers()?;
        let state = self.stage.state();
        let coordinators = state.processes.get(&Place::Coordinator).copied().unwrap_or(0);
        drop(state);
        let (trace, time) = (self.stage.trace(), self.sim.elapsed());
        Ok(Ending { faults: self.faults.clone(), time, summary, nodes: results.len(), coordinators, trace })
    }

    /// Check that workers end with the run and not before. A coordinator may be killed just after it has told them to end. A worker that
    /// had a fault may not have received the message.
    fn end_workers(&mut self) -> Result<(), String> {
        let over = self.sim.elapsed();
        self.coordinators_ended.push(over);
        let is_told = |when: &Duration| self.coordinators_ended.iter().any(|end| end.abs_diff(*when) < LAST_WORDS);
        if let Some((index, when)) = self.left_unasked.iter().find(|(_, when)| !is_told(when)) {
            return Err(format!(
                "worker {index} has ended at {when:?} though the run was not over and nobody had asked it"
            ));
        }
        let state = self.stage.state();
        let told: BTreeSet<u32> = state.joined.difference(&state.harmed).copied().collect();
        drop(state);
        while self.sim.elapsed() < over + LAST_WORDS {
            self.sim.step().map_err(|error| format!("a process has panicked: {error}"))?;
        }
        for index in 0..self.workers {
            let place = Place::Worker(index);
            if told.contains(&self.stage.process(place)) && self.sim.is_host_running(place.host()) {
                return Err(format!("worker {index} goes on though the run is over"));
            }
        }
        Ok(())
    }
}

fn differences(results: &BTreeMap<String, String>, expected: &BTreeMap<String, String>) -> String {
    let labels: BTreeSet<&String> = results.keys().chain(expected.keys()).collect();
    let mut text = String::new();
    for label in labels.into_iter().filter(|label| results.get(*label) != expected.get(*label)) {
        let _ = writeln!(text, "{label}: expected {:?}, found {:?}", expected.get(label), results.get(label));
    }
    text
}
