//! Membership: workers join, report, drain and leave.

use std::time::Duration;

use lookalike::graph::{BlobHash, FailureReason, NodeId, NodeState, WorkerId};

use super::{leases, quarantine, results};
use crate::actions::{Action, Lease, Outbox, WorkerProcess};
use crate::events::{Departure, RunEvent};
use crate::state::{Core, Lost, Place};

/// The pause after a node has lost its worker for the second time. It doubles with each further loss.
const FIRST_DELAY: Duration = Duration::from_millis(100);

/// The longest of these pauses.
const LONGEST_DELAY: Duration = Duration::from_secs(5);

pub(super) fn join(
    core: &mut Core,
    worker: WorkerId,
    threads: usize,
    process: WorkerProcess,
    now: Duration,
    outbox: &mut Outbox,
) {
    if let Some(before) = core.members.of_process(process.name) {
        drop_worker(core, before, &Departure::Replaced, now, outbox);
    }
    core.members.join(worker, process, threads, now + core.policy.lost_after, now);
    core.summary.workers_joined += 1;
    outbox.tell(RunEvent::WorkerJoined { worker, threads, process: process.id });
    if let Some(mut lost) = core.departed.remove(process.name) {
        quarantine::take_back_death(core, process.name, &std::mem::take(&mut lost.deaths), now, outbox);
        core.members.change(worker, |member| member.resume(lost));
    }
}

/// A worker reports a node that it executes under a lease from an earlier connection. It gets a new lease and continues, or is
/// told to cancel.
pub(super) fn found(
    core: &mut Core,
    worker: WorkerId,
    (node, attempt): (NodeId, u32),
    now: Duration,
    outbox: &mut Outbox,
) {
    let earlier = core.members.get(worker).and_then(|member| member.earlier.get(&node));
    // For leases that were taken back on this connection, the cancellation has been sent already.
    if earlier != Some(&attempt) {
        return;
    }
    if may_continue(core, worker, node) {
        adopt(core, worker, node, now, outbox);
    } else {
        let lease = Lease { node, attempt, epoch: core.epoch };
        outbox.push(Action::Cancel { worker, lease });
    }
}

/// Whether a worker may continue a node: the node is open and not a suspect, and at most one other worker executes it.
fn may_continue(core: &Core, worker: WorkerId, node: NodeId) -> bool {
    let (Some(member), Some(record)) = (core.members.get(worker), core.look(node)) else { return false };
    let is_begun =
        |holder: &&WorkerId| core.members.get(**holder).is_some_and(|holder| !holder.waiting.contains(&node));
    let is_free = !member.leases.contains_key(&node) && member.alone_with.is_none();
    let is_wanted = core.graph.state(node) == Some(&NodeState::Ready) && !core.is_suspect(node);
    let is_other = !leases::is_origin(core, node, worker);
    is_free && is_wanted && is_other && record.holders.iter().filter(is_begun).count() < 2
}

/// Give a worker the lease of a node that it executes already. Workers that hold the node without having begun it lose that
/// lease, and this worker loses leases that it now has in excess.
fn adopt(core: &mut Core, worker: WorkerId, node: NodeId, now: Duration, outbox: &mut Outbox) {
    for holder in core.look(node).map(|record| record.holders.clone()).unwrap_or_default() {
        if core.members.get(holder).is_some_and(|holder| holder.waiting.contains(&node)) {
            leases::take_back(core, holder, node, now, outbox);
        }
    }
    leases::assign(core, worker, node, now, outbox);
    let attempt = core.look(node).map_or(0, |record| record.attempts);
    leases::started(core, worker, (node, attempt), (now, now), outbox);
    let spare_leases = core.policy.spare_leases;
    while let Some(excess) = core.members.get(worker).and_then(|member| member.excess(spare_leases)) {
        leases::take_back(core, worker, excess, now, outbox);
        if core.look(excess).is_some_and(|record| record.holders.is_empty()) {
            leases::await_now(core, excess, now);
        }
    }
}

/// Remove a worker and take back its leases. If the nodes that it executed may have killed it, its death is counted against them.
pub(super) fn leave(core: &mut Core, worker: WorkerId, departure: &Departure, now: Duration, outbox: &mut Outbox) {
    let Some(member) = core.members.remove(worker) else { return };
    core.clearing = core.clearing.filter(|clearing| *clearing != worker);
    core.summary.workers_left += 1;
    outbox.tell(RunEvent::WorkerLeft { worker, departure: departure.clone() });
    // A draining worker may be killed at its time limit, which is not the fault of a node.
    let was_asked = member.is_draining || *departure == Departure::Goodbye;
    let counts = departure.is_suspicious() && !was_asked;
    let deaths = if counts { quarantine::count_death(core, &member, now, outbox) } else { Vec::new() };
    let (process, leases) = (member.process.name, member.leases.clone());
    if *departure != Departure::Goodbye {
        core.departed.insert(process, Lost { deaths, ..member.into_lost() });
    }
    for (node, held) in leases {
        core.forget_holder(worker, node);
        if let Some(record) = core.record(node) {
            record.losses += u32::from(!was_asked && held.started_at.is_some());
        }
        requeue(core, node, worker, now, outbox);
    }
}

/// A worker drains: take back the leases that it has not begun.
pub(super) fn drain(core: &mut Core, worker: WorkerId, now: Duration, outbox: &mut Outbox) {
    leases::renew(core, worker, now);
    core.clearing = core.clearing.filter(|clearing| *clearing != worker);
    let drained = core.members.change(worker, |member| {
        let was_draining = std::mem::replace(&mut member.is_draining, true);
        (was_draining, member.waiting.clone())
    });
    let Some((was_draining, unbegun)) = drained else { return };
    if !was_draining {
        outbox.tell(RunEvent::WorkerDraining { worker });
    }
    for node in unbegun {
        core.end_lease(worker, node, now);
        requeue(core, node, worker, now, outbox);
    }
}

/// Re-queue a node whose lease this worker has lost, unless another worker holds it or it is queued already.
fn requeue(core: &mut Core, node: NodeId, worker: WorkerId, now: Duration, outbox: &mut Outbox) {
    let Some(record) = core.look(node) else { return };
    let is_placed = !record.holders.is_empty() || record.place != Place::Nowhere;
    if is_placed || !core.graph.is_open(node) {
        return;
    }
    let deaths = record.deaths;
    if core.is_suspect(node) && results::accept_candidate(core, node, now, outbox) {
        return;
    }
    if deaths.alone >= core.policy.node_crashes {
        core.graph.fail(node, FailureReason::Crashed { crashes: deaths.alone });
        return;
    }
    await_worker(core, node, now);
    core.summary.requeued_nodes += 1;
    outbox.tell(RunEvent::NodeRequeued { name: core.name(node), worker, crashes: deaths.total() });
}

/// Queue a node, from the second loss of its worker on after a pause that grows, to limit how often a failing node runs.
fn await_worker(core: &mut Core, node: NodeId, now: Duration) {
    let losses = core.look(node).map_or(0, |record| record.losses);
    let doublings = losses.saturating_sub(2).min(16);
    let delay = (FIRST_DELAY * 2_u32.pow(doublings)).min(LONGEST_DELAY);
    if losses < 2 || core.is_suspect(node) {
        leases::await_now(core, node, now);
    } else {
        core.put(node, Place::Delayed(now + delay));
    }
}

/// Close the connection of a worker and remove it.
pub(super) fn drop_worker(
    core: &mut Core,
    worker: WorkerId,
    departure: &Departure,
    now: Duration,
    outbox: &mut Outbox,
) {
    if core.members.get(worker).is_some() {
        outbox.push(Action::Drop { worker });
        leave(core, worker, departure, now, outbox);
    }
}

pub(super) fn send_blob(core: &mut Core, worker: WorkerId, hash: BlobHash, now: Duration, outbox: &mut Outbox) {
    leases::renew(core, worker, now);
    let Some(member) = core.members.get(worker) else { return };
    // A request for another blob may be late: its node was taken back meanwhile. If a later lease reads the blob, the worker receives
    // the cancellation first, and requests the blob again.
    let blob = core.graph.blob(hash).filter(|_| member.reads(hash)).cloned();
    let Some(blob) = blob else {
        outbox.push(Action::ForgoBlob { worker });
        return;
    };
    let bytes = blob.len();
    core.summary.blobs_sent += 1;
    core.summary.blob_bytes_sent += bytes as u64;
    outbox.push(Action::SendBlob { worker, blob });
    outbox.tell(RunEvent::BlobSent { worker, bytes });
}
