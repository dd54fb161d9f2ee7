//! Gives out leases, marks them as started, takes them back.

use std::time::Duration;

use lookalike::graph::{NodeId, WorkerId};

use crate::actions::{Action, Lease, Outbox};
use crate::events::{RunEvent, Site};
use crate::state::{Core, Place};

/// Put a node into the place where it waits for a worker.
pub(super) fn await_now(core: &mut Core, node: NodeId, now: Duration) {
    let has_candidate = core.look(node).is_some_and(|record| record.candidate.is_some());
    let place = match (core.is_suspect(node), has_candidate) {
        (true, _) => Place::Suspects(now),
        (false, true) => Place::Checks,
        (false, false) => Place::Queue(core.graph.spec(node).map_or(0, |spec| spec.priority)),
    };
    core.put(node, place);
}

/// Give a worker a lease of a node.
pub(super) fn assign(core: &mut Core, worker: WorkerId, node: NodeId, now: Duration, outbox: &mut Outbox) {
    core.put(node, Place::Nowhere);
    let epoch = core.epoch;
    let Some(record) = core.record(node) else { return };
    record.attempts += 1;
    let attempt = record.attempts;
    core.summary.attempts += 1;
    core.give(worker, node, attempt, now);
    outbox.push(Action::Assign { worker, lease: Lease { node, attempt, epoch } });
    outbox.tell(RunEvent::NodeAssigned { node, worker });
}

/// End a lease and tell its worker to cancel.
pub(super) fn take_back(core: &mut Core, worker: WorkerId, node: NodeId, now: Duration, outbox: &mut Outbox) {
    let epoch = core.epoch;
    if let Some(held) = core.end_lease(worker, node, now) {
        outbox.push(Action::Cancel { worker, lease: Lease { node, attempt: held.attempt, epoch } });
    }
}

/// A worker starts to execute a node.
pub(super) fn started(
    core: &mut Core,
    worker: WorkerId,
    (node, attempt): (NodeId, u32),
    (arrived, now): (Duration, Duration),
    outbox: &mut Outbox,
) {
    renew(core, worker, now);
    // Otherwise the lease ended or changed before this message arrived.
    if core.members.change(worker, |member| member.begin(node, attempt, (arrived, now))) == Some(true) {
        core.watch(node);
        outbox.tell(RunEvent::NodeStarted { name: core.name(node), site: Site::Worker(worker) });
    }
}

/// Renew the leases of a worker, which has sent something.
pub(super) fn renew(core: &mut Core, worker: WorkerId, now: Duration) {
    core.members.renew(worker, now + core.policy.lost_after);
}

/// Whether this worker's process computed the output to be verified, on this or an earlier connection.
pub(super) fn is_origin(core: &Core, node: NodeId, worker: WorkerId) -> bool {
    let candidate = core.look(node).and_then(|record| record.candidate.as_ref());
    let process = core.members.get(worker).map(|member| member.process.name);
    candidate.is_some_and(|candidate| {
        candidate.site == Site::Worker(worker) || (process.is_some() && candidate.process == process)
    })
}
