//! What happens when something happens: plain functions from state and event to state and actions. No sockets, no clock,
//! no waiting: time comes in as an argument, and everything the coordinator does goes out through the [`Outbox`].
//!
//! Scheduling reacts to events: whenever a node is ready and a worker has a place, the lease is given at once. A lease may
//! end without a result (its worker left) or be overtaken by the result of an earlier attempt; any attempt's result is as
//! good as another's, because nodes are pure functions. Results that differ show that one was not, and end the run.

use std::time::Duration;

use lookalike::graph::{
    Blob, BlobHash, Change, Completion, FailureReason, GraphEdit, NodeFailure, NodeId, NodeState, Placement, PlanError,
    Planner, WorkerId,
};

use crate::comm::{Action, Departure, Lease, Outbox, RunEvent, Site};
use crate::core::{Core, Member, Record, Starving};
use crate::runner::RunError;

/// Something that happened.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// A worker has said hello and was welcomed.
    WorkerJoined {
        /// Its number, never used before.
        worker: WorkerId,
        /// How many nodes it executes at a time.
        threads: usize,
        /// Its process id on its own machine.
        process: u32,
    },
    /// A worker's connection is gone.
    WorkerLeft {
        /// The worker.
        worker: WorkerId,
        /// Why.
        departure: Departure,
    },
    /// A worker was heard of; it executes these nodes, done to so many thousandths.
    Heartbeat {
        /// The worker.
        worker: WorkerId,
        /// The nodes it executes, with their progress.
        executing: Vec<(NodeId, u16)>,
    },
    /// A worker begins to execute a node.
    Started {
        /// The worker.
        worker: WorkerId,
        /// The node.
        node: NodeId,
        /// The attempt under which it was assigned.
        attempt: u32,
    },
    /// A node has an output; its hash was verified.
    Finished {
        /// Where it ran.
        site: Site,
        /// The node.
        node: NodeId,
        /// The attempt under which it was assigned.
        attempt: u32,
        /// The output.
        output: Blob,
    },
    /// A worker that is about to join executes a node already: an earlier coordinator of this run gave it.
    Continues {
        /// The worker.
        worker: WorkerId,
        /// The node, by its number of today.
        node: NodeId,
    },
    /// A worker has the output of a node that an earlier coordinator of this run gave it; its hash was verified.
    Recovered {
        /// The worker.
        worker: WorkerId,
        /// The node, by its number of today.
        node: NodeId,
        /// The output.
        output: Blob,
    },
    /// A node has no output and never will: its own error.
    Failed {
        /// Where it ran.
        site: Site,
        /// The node.
        node: NodeId,
        /// The attempt under which it was assigned.
        attempt: u32,
        /// The error.
        failure: NodeFailure,
    },
    /// A worker wants a blob.
    BlobRequested {
        /// The worker.
        worker: WorkerId,
        /// The name of the blob.
        hash: BlobHash,
    },
    /// The last local worker was given up, and no other can join.
    LocalWorkersGivenUp {
        /// How the last one ended.
        last_status: String,
    },
    /// The time of [`Core::next_deadline`] has come.
    DeadlinePassed,
}

/// Begin a run: let the planner add the first nodes and act upon them.
///
/// # Errors
/// Those of the planner.
pub fn start(core: &mut Core, planner: &mut impl Planner, now: Duration, outbox: &mut Outbox) -> Result<(), RunError> {
    planner.start(&mut GraphEdit::new(&mut core.graph))?;
    settle(core, planner, now, outbox)
}

/// Act upon an event. `now` is the time since the run began and never goes back.
///
/// # Errors
/// What ends the run: an error of the planner, which by default is any failed node; results that differ; no worker for
/// too long.
pub fn handle(
    core: &mut Core,
    planner: &mut impl Planner,
    event: Event,
    now: Duration,
    outbox: &mut Outbox,
) -> Result<(), RunError> {
    match event {
        Event::WorkerJoined { worker, threads, process } => join(core, worker, threads, process, now, outbox),
        Event::WorkerLeft { worker, departure } => leave(core, worker, &departure, outbox),
        Event::Heartbeat { worker, executing } => {
            renew(core, worker, now);
            for (node, permille) in executing.into_iter().filter(|(node, _)| holds(core, worker, *node)) {
                outbox.tell(RunEvent::NodeProgress { node, permille });
            }
        }
        Event::Started { worker, node, attempt } => started(core, worker, node, attempt, now, outbox),
        Event::Finished { site, node, attempt, output } => {
            finished(core, (site, node, attempt), output, now, outbox)?;
        }
        Event::Continues { worker, node } => core.continued.push((worker, node)),
        Event::Recovered { worker, node, output } => {
            renew(core, worker, now);
            accept(core, Site::Worker(worker), node, output, now, outbox)?;
        }
        Event::Failed { site, node, attempt, failure } => {
            if answered(core, (site, node, attempt), now, outbox) && core.graph.is_open(node) {
                retract(core, node, outbox);
                core.graph.fail(node, FailureReason::Node(failure));
            }
        }
        Event::BlobRequested { worker, hash } => send_blob(core, worker, hash, now, outbox),
        Event::LocalWorkersGivenUp { last_status } => core.given_up = Some(last_status),
        Event::DeadlinePassed => {
            let is_due = |member: &Member| member.deadline <= now;
            let silent: Vec<_> = core.workers.iter().filter(|(_, member)| is_due(member)).map(|(id, _)| *id).collect();
            for worker in silent {
                drop_worker(core, worker, &Departure::Silent, outbox);
            }
        }
    }
    settle(core, planner, now, outbox)
}

/// Let everything follow that follows: tell the planner what happened, queue what became ready, give out leases.
fn settle(core: &mut Core, planner: &mut impl Planner, now: Duration, outbox: &mut Outbox) -> Result<(), RunError> {
    while let Some(change) = core.graph.next_change() {
        match change {
            Change::Added(node) => {
                core.records.push(Record::default());
                outbox.tell(RunEvent::NodeAdded { name: core.name(node) });
            }
            Change::Ready(node) => make_ready(core, node, now, outbox),
            Change::Completed(node) => {
                core.summary.completed_nodes += 1;
                if let Some(output) = core.graph.output(node).cloned() {
                    let outcome = planner.completed(node, &output, &mut GraphEdit::new(&mut core.graph));
                    outcome.map_err(|error| refused(core, node, error))?;
                }
            }
            Change::Failed(node) => {
                core.summary.failed_nodes += 1;
                if let Some(NodeState::Failed(reason)) = core.graph.state(node).cloned() {
                    outbox.tell(RunEvent::NodeFailed { name: core.name(node), reason: reason.clone() });
                    planner.failed(node, &reason, &mut GraphEdit::new(&mut core.graph))?;
                }
            }
        }
    }
    schedule(core, outbox);
    watch_starvation(core, now, outbox)
}

/// What the planner says of an output, with the name of whom it came from where that one did wrong.
fn refused(core: &mut Core, node: NodeId, error: PlanError) -> RunError {
    if !matches!(error, PlanError::NotVerified { .. } | PlanError::WrongOutput { .. }) {
        return RunError::Plan(error);
    }
    let site = core.record(node).and_then(|record| record.finished_by).unwrap_or(Site::Coordinator);
    RunError::WrongResult { name: Box::new(core.name(node)), site, error }
}

/// Complete a node from what an earlier coordinator of this run has left. Whether there was something.
fn recall(core: &mut Core, node: NodeId, outbox: &mut Outbox) -> bool {
    let Some(key) = core.graph.key(node) else { return false };
    let Some(memory) = core.recall.as_mut().map(|recall| recall.recall(key)) else { return false };
    if let Some(record) = core.record(node) {
        record.key = Some(key);
        record.crashes = memory.crashes;
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

fn make_ready(core: &mut Core, node: NodeId, now: Duration, outbox: &mut Outbox) {
    if core.recall.is_some() {
        if recall(core, node, outbox) {
            return;
        }
        outbox.tell(RunEvent::NodeReady { node });
    }
    let is_for_worker = core.graph.spec(node).is_none_or(|spec| spec.placement == Placement::Worker);
    if is_for_worker {
        core.queue.insert(node);
        return;
    }
    core.summary.attempts += 1;
    if let Some(record) = core.record(node) {
        record.attempts += 1;
        record.holder = Some(Site::Coordinator);
        record.started_at = Some(now);
        let attempt = record.attempts;
        outbox.push(Action::RunHere { node, attempt });
        outbox.tell(RunEvent::NodeStarted { name: core.name(node), site: Site::Coordinator });
    }
}

fn join(core: &mut Core, worker: WorkerId, threads: usize, process: u32, now: Duration, outbox: &mut Outbox) {
    let deadline = now + core.policy.lost_after;
    let threads = threads.max(1);
    let (leases, executing, readable) = Default::default();
    let member = Member { threads, leases, executing, readable, deadline };
    core.workers.insert(worker, member);
    core.summary.workers_joined += 1;
    outbox.tell(RunEvent::WorkerJoined { worker, threads, process });
    for (_, node) in core.continued.extract_if(.., |(continuing, _)| *continuing == worker).collect::<Vec<_>>() {
        if core.queue.remove(&node) {
            assign(core, worker, node, outbox);
            // It has begun: nobody else shall get it for having idle threads.
            let attempt = core.record(node).map_or(0, |record| record.attempts);
            started(core, worker, node, attempt, now, outbox);
        }
    }
}

/// Take back what a worker held. The nodes it executed are suspects if it may have died of them.
fn leave(core: &mut Core, worker: WorkerId, departure: &Departure, outbox: &mut Outbox) {
    let Some(member) = core.workers.remove(&worker) else {
        return;
    };
    core.summary.workers_left += 1;
    outbox.tell(RunEvent::WorkerLeft { worker, departure: departure.clone() });
    let crash_limit = core.policy.node_crashes;
    for node in member.leases.into_keys() {
        let is_suspect = departure.is_suspicious() && member.executing.contains(&node);
        let Some(record) = core.record(node) else { continue };
        record.holder = None;
        record.started_at = None;
        record.crashes += u32::from(is_suspect);
        let crashes = record.crashes;
        if is_suspect && crashes >= crash_limit {
            core.graph.fail(node, FailureReason::Crashed { crashes });
        } else {
            core.queue.insert(node);
            core.summary.requeued_nodes += 1;
            outbox.tell(RunEvent::NodeRequeued { name: core.name(node), worker, crashes });
        }
    }
}

/// Throw a worker out.
fn drop_worker(core: &mut Core, worker: WorkerId, departure: &Departure, outbox: &mut Outbox) {
    if core.workers.contains_key(&worker) {
        outbox.push(Action::Drop { worker });
        leave(core, worker, departure, outbox);
    }
}

/// A worker was heard of: its membership and its leases go on.
fn renew(core: &mut Core, worker: WorkerId, now: Duration) {
    let deadline = now + core.policy.lost_after;
    if let Some(member) = core.workers.get_mut(&worker) {
        member.deadline = deadline;
        member.leases.values_mut().for_each(|lease| lease.deadline = deadline);
    }
}

fn holds(core: &Core, worker: WorkerId, node: NodeId) -> bool {
    core.workers.get(&worker).is_some_and(|member| member.leases.contains_key(&node))
}

fn started(core: &mut Core, worker: WorkerId, node: NodeId, attempt: u32, now: Duration, outbox: &mut Outbox) {
    renew(core, worker, now);
    let Some(member) = core.workers.get_mut(&worker) else { return };
    // A lease that has ended or changed meanwhile: the message crossed ours.
    if member.leases.get(&node).is_none_or(|lease| lease.attempt != attempt) || !member.executing.insert(node) {
        return;
    }
    if let Some(record) = core.record(node) {
        record.started_at = Some(now);
    }
    outbox.tell(RunEvent::NodeStarted { name: core.name(node), site: Site::Worker(worker) });
}

/// An answer: (where from, for which node, for which attempt).
type Answer = (Site, NodeId, u32);

fn finished(core: &mut Core, answer: Answer, output: Blob, now: Duration, outbox: &mut Outbox) -> Result<(), RunError> {
    let (site, node, _) = answer;
    if answered(core, answer, now, outbox) { accept(core, site, node, output, now, outbox) } else { Ok(()) }
}

/// Take an output, wherever it comes from.
fn accept(
    core: &mut Core,
    site: Site,
    node: NodeId,
    output: Blob,
    now: Duration,
    outbox: &mut Outbox,
) -> Result<(), RunError> {
    let bytes = output.len();
    let hash = output.hash();
    if matches!(site, Site::Worker(_)) {
        core.summary.output_bytes_received += bytes as u64;
    }
    match core.graph.complete(node, output) {
        Completion::Accepted => {
            retract(core, node, outbox);
            let record = core.record(node);
            let started_at = record.and_then(|record| {
                record.finished_by = Some(site);
                record.started_at
            });
            let elapsed = started_at.map_or(Duration::ZERO, |started_at| now.saturating_sub(started_at));
            outbox.tell(RunEvent::NodeFinished { name: core.name(node), site, bytes, elapsed });
        }
        Completion::Duplicate => core.summary.duplicate_results += 1,
        // The node has failed before; the planner knows it, and nothing can be taken back.
        Completion::Refused => {}
        Completion::Different { first } => {
            return Err(RunError::ResultsDiffer { name: Box::new(core.name(node)), site, first, second: hash });
        }
    }
    Ok(())
}

/// An answer has come: its lease ends. Whether it is an answer to something that was asked; who answers anything else is
/// thrown out.
fn answered(core: &mut Core, (site, node, attempt): Answer, now: Duration, outbox: &mut Outbox) -> bool {
    let was_asked = core.record(node).is_some_and(|record| (1..=record.attempts).contains(&attempt));
    let Site::Worker(worker) = site else {
        return was_asked;
    };
    if !was_asked {
        let what = format!("it answered for {node}, attempt {attempt}, which was never given out");
        drop_worker(core, worker, &Departure::Violation(what), outbox);
        return false;
    }
    renew(core, worker, now);
    if let Some(member) = core.workers.get_mut(&worker) {
        if member.leases.remove(&node).is_some() {
            member.executing.remove(&node);
            if let Some(record) = core.record(node) {
                record.holder = None;
            }
        }
        outbox.push(Action::Acknowledge { worker, node, attempt });
    }
    true
}

/// Nobody needs to run this node any more.
fn retract(core: &mut Core, node: NodeId, outbox: &mut Outbox) {
    core.queue.remove(&node);
    if let Some(Site::Worker(holder)) = core.record(node).and_then(|record| record.holder.take()) {
        take_back(core, holder, node, outbox);
    }
}

/// End a lease and tell its worker.
fn take_back(core: &mut Core, worker: WorkerId, node: NodeId, outbox: &mut Outbox) {
    if let Some(member) = core.workers.get_mut(&worker) {
        member.executing.remove(&node);
        if let Some(lease) = member.leases.remove(&node) {
            outbox.push(Action::Cancel { worker, lease });
        }
    }
}

fn send_blob(core: &mut Core, worker: WorkerId, hash: BlobHash, now: Duration, outbox: &mut Outbox) {
    renew(core, worker, now);
    let Some(member) = core.workers.get(&worker) else { return };
    let Some(blob) = core.graph.blob(hash).filter(|_| member.readable.contains(&hash)).cloned() else {
        let what = format!("it asked for blob {hash}, which none of its nodes reads");
        drop_worker(core, worker, &Departure::Violation(what), outbox);
        return;
    };
    let bytes = blob.len();
    core.summary.blobs_sent += 1;
    core.summary.blob_bytes_sent += bytes as u64;
    outbox.push(Action::SendBlob { worker, blob });
    outbox.tell(RunEvent::BlobSent { worker, bytes });
}

/// Give out leases: the earliest ready node to the least busy worker, as long as there are both.
fn schedule(core: &mut Core, outbox: &mut Outbox) {
    let spare = core.policy.spare_leases;
    while !core.queue.is_empty() {
        let Some(worker) = core.least_busy(|member| member.leases.len() < member.threads + spare) else {
            return;
        };
        if let Some(node) = core.queue.pop_first() {
            assign(core, worker, node, outbox);
        }
    }
    balance(core, outbox);
}

/// With nothing left in the queue, move nodes that merely wait on one worker to a worker with an idle thread.
fn balance(core: &mut Core, outbox: &mut Outbox) {
    while let Some(idle) = core.least_busy(|member| member.leases.len() < member.threads) {
        let surplus = |member: &Member| member.leases.len().saturating_sub(member.threads);
        let waiting = |member: &Member| member.leases.keys().rfind(|node| !member.executing.contains(node)).copied();
        let busiest = core.workers.iter().filter(|(_, member)| surplus(member) > 0).max_by_key(|(_, m)| surplus(m));
        let Some((from, node)) = busiest.and_then(|(worker, member)| Some((*worker, waiting(member)?))) else {
            return;
        };
        take_back(core, from, node, outbox);
        assign(core, idle, node, outbox);
    }
}

fn assign(core: &mut Core, worker: WorkerId, node: NodeId, outbox: &mut Outbox) {
    let epoch = core.epoch;
    let Some(record) = core.record(node) else { return };
    record.attempts += 1;
    record.holder = Some(Site::Worker(worker));
    let attempt = record.attempts;
    core.summary.attempts += 1;
    let inputs = core.graph.input_blobs(node).unwrap_or_default();
    if let Some(member) = core.workers.get_mut(&worker) {
        let lease = Lease { node, attempt, epoch, deadline: member.deadline };
        member.leases.insert(node, lease);
        member.readable.extend(inputs.iter().map(Blob::hash));
        outbox.push(Action::Assign { worker, lease });
    }
}

/// Work without a worker: remind the user, and give up after a while.
fn watch_starvation(core: &mut Core, now: Duration, outbox: &mut Outbox) -> Result<(), RunError> {
    if core.queue.is_empty() || !core.workers.is_empty() {
        core.starving = None;
        return Ok(());
    }
    if let Some(last_status) = core.given_up.clone() {
        return Err(RunError::LocalWorkersKeepDying { last_status });
    }
    let limit = core.starvation_limit();
    // Never zero: the next deadline has to lie ahead.
    let remind_every = core.policy.remind_every.max(Duration::from_millis(1));
    let starving = core.starving.get_or_insert(Starving { since: now, next_reminder: now + remind_every });
    let waited = now.saturating_sub(starving.since);
    if waited >= limit {
        let had_workers = core.summary.workers_joined > 0;
        return Err(if had_workers { RunError::LostAllWorkers { waited } } else { RunError::NoWorkerCame { waited } });
    }
    if now >= starving.next_reminder {
        starving.next_reminder = now + remind_every;
        outbox.tell(RunEvent::WaitingForWorkers { waited, limit });
    }
    Ok(())
}

#[cfg(test)]
mod property_tests;
#[cfg(test)]
mod recall_tests;
#[cfg(test)]
mod tests;
