//! The order of leases: suspects first, then second computations for verification, then the queue. If it is empty, unbegun leases
//! are moved to idle workers.

use std::time::Duration;

use lookalike::graph::{NodeId, WorkerId};

use super::leases::{assign, await_now, is_origin, take_back};
use super::speculation;
use crate::actions::Outbox;
use crate::state::Core;

/// How many nodes are tried to find one that a worker may verify. Further ones most likely have the same origin, and another
/// worker will verify them.
const CHECKS_LOOKED_AT: usize = 8;

/// Give out leases while there are both nodes and places.
pub(super) fn schedule(core: &mut Core, now: Duration, outbox: &mut Outbox) {
    while let Some(node) = core.waiting.rested(now) {
        await_now(core, node, now);
    }
    isolate_suspects(core, now, outbox);
    give_checks(core, now, outbox);
    while let Some(node) = core.waiting.next() {
        let Some(worker) = core.members.with_place().next() else { break };
        assign(core, worker, node, now, outbox);
    }
    balance(core, now, outbox);
    speculation::speculate(core, now, outbox);
}

/// Give every suspect a worker without other nodes: one that has executed nothing or, after a while, any that holds no lease. If
/// no worker is idle, free one at a time: it gets no more leases until it holds no lease.
fn isolate_suspects(core: &mut Core, now: Duration, outbox: &mut Outbox) {
    core.next_patience = None;
    while let Some((since, node)) = core.waiting.suspect() {
        let patience_ends = since + core.policy.suspect_patience;
        let is_patient = now < patience_ends;
        let any = || (!is_patient).then(|| cleared(core).or_else(|| core.members.idle())).flatten();
        if let Some(worker) = core.members.fresh().or_else(any) {
            isolate(core, worker, node, now, outbox);
        } else if is_patient {
            core.next_patience = Some(patience_ends);
            break;
        } else if core.clearing.is_some() || !clear_one(core, now, outbox) {
            return;
        }
    }
    // No suspect waits for this worker any more.
    if let Some(worker) = core.clearing.take() {
        core.members.change(worker, |member| member.is_clearing = false);
    }
}

/// The worker that is being freed, once it holds no lease.
fn cleared(core: &Core) -> Option<WorkerId> {
    core.clearing.filter(|worker| core.members.get(*worker).is_some_and(|member| member.leases.is_empty()))
}

/// Begin to free a worker; `false` if no worker can be freed.
fn clear_one(core: &mut Core, now: Duration, outbox: &mut Outbox) -> bool {
    let Some(worker) = core.members.least_busy() else { return false };
    core.clearing = Some(worker);
    let unbegun = core.members.change(worker, |member| {
        member.is_clearing = true;
        member.waiting.clone()
    });
    for node in unbegun.into_iter().flatten() {
        take_back(core, worker, node, now, outbox);
        if core.look(node).is_some_and(|record| record.holders.is_empty()) {
            await_now(core, node, now);
        }
    }
    true
}

fn isolate(core: &mut Core, worker: WorkerId, node: NodeId, now: Duration, outbox: &mut Outbox) {
    core.clearing = core.clearing.filter(|clearing| *clearing != worker);
    core.members.change(worker, |member| {
        member.is_clearing = false;
        member.alone_with = Some(node);
    });
    assign(core, worker, node, now, outbox);
}

/// Give nodes to be verified to a worker other than the origin of the first output, if there is one.
fn give_checks(core: &mut Core, now: Duration, outbox: &mut Outbox) {
    loop {
        let is_only_one = core.members.accepting() == 1;
        let places: Vec<_> = core.members.with_place().take(2).collect();
        let pair = core.waiting.checks().take(CHECKS_LOOKED_AT).find_map(|node| {
            let mut able = places.iter().filter(|worker| is_only_one || !is_origin(core, node, **worker));
            Some((node, *able.next()?))
        });
        let Some((node, worker)) = pair else { return };
        assign(core, worker, node, now, outbox);
    }
}

/// Move nodes that are waiting on one worker to a worker with an idle thread.
fn balance(core: &mut Core, now: Duration, outbox: &mut Outbox) {
    core.next_move = None;
    loop {
        let idle = core.members.with_thread().next();
        let (Some(idle), Some((from, member))) = (idle, core.members.busiest()) else { return };
        if member.movable_at() > now {
            core.next_move = Some(member.movable_at());
            return;
        }
        let has = |node: &NodeId| core.members.get(idle).is_some_and(|member| member.leases.contains_key(node));
        let movable = member.waiting.iter().rev().take(CHECKS_LOOKED_AT);
        let Some(node) = movable.copied().find(|node| !has(node) && !is_origin(core, *node, idle)) else { return };
        take_back(core, from, node, now, outbox);
        assign(core, idle, node, now, outbox);
    }
}
