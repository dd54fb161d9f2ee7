//! The state machine: plain functions from state and event to state and actions. No sockets, no clock, no waiting: time is an
//! argument, and every action goes out through the [`Outbox`].
//!
//! Scheduling reacts to events: a lease is given out as soon as a node is ready and a worker has a place. A lease may end
//! without a result (its worker left), or the result of another attempt may arrive first. The result of any attempt is accepted,
//! because nodes are pure functions; results that differ end the run.
//!
//! No event scans all nodes or all workers: [`state`](crate::state) has indices.

mod answers;
mod error;
mod event;
mod leases;
mod membership;
mod quarantine;
mod results;
mod schedule;
mod speculation;

use std::time::Duration;

use lookalike::graph::{Change, Completion, GraphEdit, NodeId, NodeState, Placement, PlanError, Planner};

pub use self::error::{NodeAnswer, Stop};
pub use self::event::{Event, Executing};
use crate::actions::{Action, Outbox};
use crate::events::{Departure, RunEvent, Site};
use crate::state::{Core, Record, Starving};

/// Start a run: let the planner add the first nodes, and process them.
///
/// # Errors
/// Errors of the planner.
pub fn start(core: &mut Core, planner: &mut impl Planner, now: Duration, outbox: &mut Outbox) -> Result<(), Stop> {
    planner.start(&mut GraphEdit::new(&mut core.graph))?;
    settle(core, planner, now, outbox)
}

/// Process an event that has just arrived. `now` is the time since the start of the run and never decreases.
///
/// # Errors
/// See [`handle_arrived`].
pub fn handle(
    core: &mut Core,
    planner: &mut impl Planner,
    event: Event,
    now: Duration,
    outbox: &mut Outbox,
) -> Result<(), Stop> {
    handle_arrived(core, planner, event, (now, now), outbox)
}

/// Process an event that arrived at `arrived`, not later than `now`. `arrived` is used to measure how long nodes took. Deadlines
/// use `now`, so that a slow coordinator does not make workers miss theirs.
///
/// # Errors
/// The reason for ending the run: an error of the planner, which by default is any failed node; results that differ; no worker
/// for too long.
pub fn handle_arrived(
    core: &mut Core,
    planner: &mut impl Planner,
    event: Event,
    (arrived, now): (Duration, Duration),
    outbox: &mut Outbox,
) -> Result<(), Stop> {
    match event {
        Event::WorkerJoined { worker, threads, process } => {
            membership::join(core, worker, threads, process, now, outbox);
        }
        Event::WorkerLeft { worker, departure } => membership::leave(core, worker, &departure, now, outbox),
        Event::WorkerDrains { worker } => membership::drain(core, worker, now, outbox),
        Event::Alive { worker } => leases::renew(core, worker, now),
        Event::Heartbeat { worker, executing } => {
            leases::renew(core, worker, now);
            for Executing { node, attempt, permille } in executing {
                match core.members.progress(worker, node, permille) {
                    Some(true) => outbox.tell(RunEvent::NodeProgress { node, permille }),
                    Some(false) => {}
                    None => membership::found(core, worker, (node, attempt), now, outbox),
                }
            }
        }
        Event::Started { worker, node, attempt } => {
            leases::started(core, worker, (node, attempt), (arrived, now), outbox);
        }
        Event::Finished { site, node, attempt, output } => {
            answers::finished(core, (site, node, attempt), output, (arrived, now), outbox)?;
        }
        Event::Failed { site, node, attempt, failure } => {
            answers::failed(core, (site, node, attempt), failure, now, outbox)?;
        }
        Event::BlobRequested { worker, hash } => membership::send_blob(core, worker, hash, now, outbox),
        Event::LocalWorkersGivenUp { last_status } => core.given_up = Some(last_status),
        Event::LookAgain => planner.look_again(&mut GraphEdit::new(&mut core.graph))?,
        Event::DeadlinePassed => {
            while let Some(worker) = core.members.silent(now) {
                membership::drop_worker(core, worker, &Departure::Silent, now, outbox);
            }
        }
    }
    settle(core, planner, now, outbox)
}

/// Process the consequences: inform the planner, queue the nodes that became ready, give out leases.
fn settle(core: &mut Core, planner: &mut impl Planner, now: Duration, outbox: &mut Outbox) -> Result<(), Stop> {
    while let Some(change) = core.graph.next_change() {
        match change {
            Change::Added(node) => {
                core.records.push(Record::default());
                outbox.tell(RunEvent::NodeAdded { name: core.name(node) });
            }
            Change::Ready(node) => make_ready(core, planner, node, now, outbox),
            Change::Completed(node) => {
                core.summary.completed_nodes += 1;
                if let Some(output) = core.graph.output(node).cloned() {
                    let outcome = planner.completed(node, &output, &mut GraphEdit::new(&mut core.graph));
                    outcome.map_err(|error| refused(core, node, error))?;
                }
            }
            Change::Forgotten(node) => outbox.tell(RunEvent::NodeReleased { name: core.name(node) }),
            Change::Failed(node) => {
                results::retract(core, node, now, outbox);
                if let Some(NodeState::Failed(reason)) = core.graph.state(node).cloned() {
                    outbox.tell(RunEvent::NodeFailed { name: core.name(node), reason: reason.clone() });
                    if reason.is_cancellation() {
                        // The planner requested it.
                        core.summary.cancelled_nodes += 1;
                        continue;
                    }
                    core.summary.failed_nodes += 1;
                    planner.failed(node, &reason, &mut GraphEdit::new(&mut core.graph))?;
                }
            }
        }
    }
    schedule::schedule(core, now, outbox);
    watch_starvation(core, now, outbox)
}

/// Convert the planner's error about an output. If the output is wrong, the result names the worker that computed it.
fn refused(core: &Core, node: NodeId, error: PlanError) -> Stop {
    if !matches!(error, PlanError::NotVerified { .. } | PlanError::WrongOutput { .. }) {
        return Stop::Plan(error);
    }
    let site = core.look(node).and_then(|record| record.finished_by).unwrap_or(Site::Coordinator);
    Stop::WrongResult { name: Box::new(core.name(node)), site, error }
}

/// Complete a node with the output of an earlier coordinator of this run. Returns whether there was one.
fn complete_from_past(core: &mut Core, node: NodeId, outbox: &mut Outbox) -> bool {
    let Some(key) = core.graph.key(node) else { return false };
    let Some(memory) = core.past_outputs.as_mut().map(|past| past.of(key)) else { return false };
    if let Some(record) = core.record(node) {
        record.key = Some(key);
        record.deaths = memory.deaths;
    }
    let Some(output) = memory.output else { return false };
    let bytes = output.len();
    if core.graph.complete(node, output) != Completion::Accepted {
        return false;
    }
    core.summary.recalled_nodes += 1;
    outbox.tell(RunEvent::NodeRecalled { name: core.name(node), bytes });
    true
}

fn make_ready(core: &mut Core, planner: &impl Planner, node: NodeId, now: Duration, outbox: &mut Outbox) {
    // It may have been cancelled meanwhile.
    if !core.graph.is_open(node) {
        return;
    }
    if core.past_outputs.is_some() {
        if complete_from_past(core, node, outbox) {
            return;
        }
        outbox.tell(RunEvent::NodeReady { node });
    }
    let Some(spec) = core.graph.spec(node) else { return };
    if spec.placement == Placement::Worker {
        let is_verified = answers::is_chosen(core, spec, node) && planner.is_verified_by_repetition(spec);
        core.record(node).into_iter().for_each(|record| record.is_verified = is_verified);
        leases::await_now(core, node, now);
        return;
    }
    core.summary.attempts += 1;
    if let Some(record) = core.record(node) {
        record.attempts += 1;
        record.here_since = Some(now);
        let attempt = record.attempts;
        outbox.push(Action::RunHere { node, attempt });
        outbox.tell(RunEvent::NodeStarted { name: core.name(node), site: Site::Coordinator });
    }
}

/// While nodes wait and there is no worker, remind the user, and end the run at the limit.
fn watch_starvation(core: &mut Core, now: Duration, outbox: &mut Outbox) -> Result<(), Stop> {
    if core.waiting.is_empty() || !core.members.is_empty() {
        core.starving = None;
        return Ok(());
    }
    if let Some(last_status) = core.given_up.clone() {
        return Err(Stop::LocalWorkersKeepDying { last_status });
    }
    let limit = core.starvation_limit();
    // Never zero, because the next deadline must lie ahead.
    let remind_every = core.policy.remind_every.max(Duration::from_millis(1));
    let starving = core.starving.get_or_insert(Starving { since: now, next_reminder: now + remind_every });
    let waited = now.saturating_sub(starving.since);
    if waited >= limit {
        let had_workers = core.summary.workers_joined > 0;
        return Err(if had_workers { Stop::LostAllWorkers { waited } } else { Stop::NoWorkerCame { waited } });
    }
    if now >= starving.next_reminder {
        starving.next_reminder = now + remind_every;
        outbox.tell(RunEvent::WaitingForWorkers { waited, limit });
    }
    Ok(())
}

#[cfg(test)]
mod past_outputs_tests;
#[cfg(test)]
mod property_tests;
#[cfg(test)]
mod random_kill_tests;
#[cfg(test)]
mod tests;
