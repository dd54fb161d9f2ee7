//! Runs slow nodes on a second worker that would otherwise be idle. The first answer is accepted.

use std::time::Duration;

use lookalike::graph::{NodeId, WorkerId};

use super::leases::{assign, is_origin};
use crate::actions::Outbox;
use crate::events::RunEvent;
use crate::state::Core;

/// How many stalled workers are tried at a time. This is enough, because their nodes soon end on a second worker.
const STALLED_LOOKED_AT: usize = 8;

/// Give slow nodes to workers that have a thread without a lease, and set the time when the next node becomes slow.
pub(super) fn speculate(core: &mut Core, now: Duration, outbox: &mut Outbox) {
    core.next_slow = None;
    let policy = core.policy.speculation;
    if policy.factor.is_none() {
        return;
    }
    while let Some(idle) = Idle::of(core) {
        let running = core.pace.slowest(policy, now, |node| idle.for_node(core, node).is_some());
        let node = running.or_else(|| unbegun(core, &idle, now.checked_sub(policy.after)?));
        let Some((node, worker)) = node.and_then(|node| Some((node, idle.for_node(core, node)?))) else {
            let stalled = core.members.next_stalled(now.checked_sub(policy.after)).map(|since| since + policy.after);
            core.next_slow = core.pace.next_slow(policy, now).into_iter().chain(stalled).min();
            return;
        };
        assign(core, worker, node, now, outbox);
        core.summary.speculated_nodes += 1;
        outbox.tell(RunEvent::NodeSpeculated { name: core.name(node), worker });
    }
}

/// A node that its only holder has not begun although it has had a free thread since `since`.
fn unbegun(core: &Core, idle: &Idle, since: Duration) -> Option<NodeId> {
    let is_wanted = |node: &&NodeId| {
        let is_held_once = core.look(**node).is_some_and(|record| record.holders.len() == 1);
        is_held_once && !core.is_suspect(**node) && idle.for_node(core, **node).is_some()
    };
    let stalled = core.members.stalled(since).take(STALLED_LOOKED_AT);
    stalled.filter_map(|(_, member)| member.waiting.iter().find(is_wanted)).next().copied()
}

/// Up to two workers that have a thread without a lease. If there are two, at least one of them does not hold a given node with
/// one holder.
struct Idle {
    first: WorkerId,
    second: Option<WorkerId>,
}

impl Idle {
    fn of(core: &Core) -> Option<Self> {
        let mut workers = core.members.with_thread();
        Some(Self { first: workers.next()?, second: workers.next() })
    }

    /// The worker of the two that may run this node.
    fn for_node(&self, core: &Core, node: NodeId) -> Option<WorkerId> {
        let holders = &core.look(node)?.holders;
        let is_able = |worker: &WorkerId| !holders.contains(worker) && !is_origin(core, node, *worker);
        [Some(self.first), self.second].into_iter().flatten().find(is_able)
    }
}
