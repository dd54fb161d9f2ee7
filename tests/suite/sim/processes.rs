//! The processes of a simulated run: consecutive coordinators, and workers, each the program itself in a simulated world.

use std::collections::BTreeMap;
use std::num::NonZeroUsize;
use std::sync::Arc;
use std::time::Duration;

use lookalike::graph::WorkerId;
use lookalike_coordinator::events::{Departure, RunEvent};
use lookalike_coordinator::journal::{JournalOptions, RunIdentity};
use lookalike_coordinator::policy::{Policy, Speculation};
use lookalike_coordinator::runner::{self, RunnerOptions};
use lookalike_worker::ending::Wishes;
use lookalike_worker::{WorkerOptions, run_in};
use tokio::time::sleep;

use super::chance::Chance;
use super::stage::{Place, Stage};
use super::web::{Web, registry};
use super::world::SimWorld;

/// The port of every coordinator.
pub(super) const PORT: u16 = 4100;

/// The policy of a run.
pub(super) fn policy(chance: &mut Chance) -> Policy {
    let heartbeat = chance.time(100, 600);
    Policy {
        heartbeat,
        // Late messages alone must not lose a worker.
        lost_after: heartbeat * 2 + chance.time(1000, 3000),
        spare_leases: usize::try_from(chance.between(0, 4)).unwrap_or(0),
        suspect_after: u32::try_from(chance.between(2, 3)).unwrap_or(2),
        node_crashes: u32::try_from(chance.between(2, 4)).unwrap_or(2),
        suspect_patience: chance.time(100, 2000),
        speculation: Speculation { factor: chance.happens(0.8).then_some(2.0), after: chance.time(200, 3000) },
        verify_fraction: chance.of(&[0.0, 0.0, 0.2, 1.0]),
        drain_time: chance.time(500, 5000),
        // No process gives up, because every fault is repaired in time.
        grace: Duration::from_mins(30),
        wait_for_workers: Duration::from_mins(30),
        ..Policy::default()
    }
}

/// A coordinator, the first or a later one, until the run ends.
pub(super) async fn coordinate(stage: Arc<Stage>, policy: Policy) {
    let process = stage.next_process(Place::Coordinator);
    stage.say(Place::Coordinator, "begins");
    let journal = stage.folder.join("run.sqlite");
    let options = RunnerOptions {
        listen: Some(([0, 0, 0, 0], PORT).into()),
        access: Some(stage.folder.join("access.json")),
        policy,
        journal: Some(JournalOptions { resume: true, ..JournalOptions::new(journal, RunIdentity::default()) }),
        handle_signals: false,
        ..RunnerOptions::new(0, stage.folder.join("unused.json"))
    };
    let mut watcher = Watcher { stage: Arc::clone(&stage), process, labels: Vec::new(), members: BTreeMap::new() };
    let observer = move |event: &RunEvent| watcher.watch(event);
    let world = SimWorld::new(Arc::clone(&stage), Place::Coordinator, process);
    let outcome = runner::run_in(world, options, Web::new(stage.seed), Arc::new(registry()), observer).await;
    stage.say(Place::Coordinator, if outcome.is_ok() { "is done" } else { "has failed" });
    let outcome = outcome.map(|(web, summary)| (web.results, summary)).map_err(|error| error.to_string());
    stage.state().outcome = Some(outcome);
}

/// Records the events of a coordinator and checks what must not happen.
struct Watcher {
    stage: Arc<Stage>,
    process: u32,
    /// By number of the node.
    labels: Vec<String>,
    /// The processes of the workers.
    members: BTreeMap<WorkerId, u32>,
}

impl Watcher {
    fn watch(&mut self, event: &RunEvent) {
        self.stage.say(Place::Coordinator, &format!("{event:?}"));
        match event {
            RunEvent::NodeAdded { name } => self.labels.push(name.label.to_string()),
            RunEvent::NodeFinished { name, .. } => {
                self.stage.state().finished.entry(name.label.to_string()).or_insert(self.process);
            }
            RunEvent::NodeAssigned { node, .. } => {
                let label = usize::try_from(node.0).ok().and_then(|node| self.labels.get(node)).cloned();
                label.into_iter().for_each(|label| self.given_out(&label));
            }
            RunEvent::NodeStarted { name, .. } => self.given_out(&name.label.to_string()),
            RunEvent::WorkerJoined { worker, process, .. } => {
                self.members.insert(*worker, *process);
                self.stage.state().joined.insert(*process);
            }
            RunEvent::WorkerLeft { worker, departure } => self.left(*worker, departure),
            _ => {}
        }
    }

    /// A node whose output an earlier coordinator has acknowledged must not be assigned.
    fn given_out(&self, label: &str) {
        let acknowledged = self.stage.state().finished.get(label).copied();
        if acknowledged.is_some_and(|by| by != self.process) {
            self.stage
                .wrong(format!("{label} was given out though an earlier coordinator had acknowledged its output"));
        }
    }

    /// A worker may leave only after a fault of its own, and must not break the protocol.
    fn left(&self, worker: WorkerId, departure: &Departure) {
        let process = self.members.get(&worker).copied().unwrap_or(0);
        self.stage.state().joined.remove(&process);
        let is_harmed = self.stage.state().harmed.contains(&process);
        if !is_harmed || matches!(departure, Departure::Violation(_)) {
            self.stage.wrong(format!("process {process} has left ({departure}) though it had no reason to"));
        }
    }
}

/// A worker, from its start to its end.
pub(super) async fn work(stage: Arc<Stage>, index: usize, threads: NonZeroUsize, late: Duration) {
    let place = Place::Worker(index);
    let process = stage.next_process(place);
    sleep(late).await;
    stage.say(place, &format!("process {process} begins"));
    let wishes = Wishes::default();
    stage.state().wishes.insert(place, wishes.clone());
    let options = WorkerOptions {
        threads,
        // Small enough that blobs are evicted and fetched again.
        cached_blob_bytes: 500_000,
        reconnect_for: Duration::from_mins(30),
        ..WorkerOptions::new(stage.folder.join("access.json"))
    };
    let world = SimWorld::new(Arc::clone(&stage), place, process);
    let ended = run_in(world, &options, registry(), wishes.clone()).await;
    stage.say(place, &format!("process {process} ends: {ended:?}"));
    if let Err(error) = ended {
        stage.wrong(format!("{place:?} has ended: {}", lookalike_worker::with_causes(&error)));
    }
    let was_asked = wishes.drain.is_cancelled();
    stage.state().ended.push((index, was_asked));
}
