//! Nodes that may kill their workers: whom to suspect of a death, and when to believe it.
//!
//! Only what a worker was executing can have killed it. After a few deaths in which a node took part
//! ([`Policy::suspect_after`](crate::core::Policy::suspect_after)) it is a *suspect*: it runs alone, on a worker that has
//! executed nothing before or at least nothing else at the same time. Only deaths there count against it, and so many of
//! them ([`Policy::node_crashes`](crate::core::Policy::node_crashes)) fail it by name.
//!
//! Somebody who kills workers from outside may hit a suspect's worker as well. What tells the two apart is whom else they
//! hit: as long as workers die whose deaths no suspect explains, a suspect is excused, though not for ever.
//!
//! A connection that ends may be a death or a fault of the network. It was none if somebody turns out to go on with what the dead
//! should have died of.

use std::time::Duration;

use lookalike::graph::NodeId;

use super::schedule;
use crate::comm::{Departure, Outbox, RunEvent};
use crate::core::{Core, Death, Member, Place};

/// How many deaths of a suspect's workers are excused for one that would count: where a machine fails all the time, a node that
/// kills its workers has to fail in the end.
const EXCUSES_PER_CRASH: u32 = 10;

/// How many unexplained deaths are remembered.
const REMEMBERED: usize = 8;

/// A worker has died: count it against the nodes that it executed.
pub(super) fn count_death(core: &mut Core, member: &Member, why: &Departure, now: Duration, outbox: &mut Outbox) {
    let executing: Vec<(NodeId, Duration)> =
        member.leases.iter().filter_map(|(node, held)| Some((*node, held.started_at?))).collect();
    // Whoever breaks the protocol and comes back is no better for it.
    let attempt_of = |node| member.leases.get(&node).filter(|_| *why == Departure::Lost).map(|held| held.attempt);
    if let Some((suspect, since)) = executing.iter().find(|(node, _)| member.alone_with == Some(*node)) {
        return count_death_alone(core, *suspect, *since, attempt_of(*suspect));
    }
    if !executing.iter().any(|(node, _)| core.is_suspect(*node)) {
        core.unexplained.push_back((now, executing.iter().map(|(node, _)| *node).collect()));
        if core.unexplained.len() > REMEMBERED {
            core.unexplained.pop_front();
        }
    }
    let limit = core.policy.suspect_after;
    for (node, _) in executing {
        let Some(record) = core.record(node) else { continue };
        record.mourn(Death::InCompany, attempt_of(node));
        let deaths = record.deaths.total();
        if record.deaths.in_company == limit {
            core.summary.suspected_nodes += 1;
            outbox.tell(RunEvent::NodeSuspected { name: core.name(node), deaths });
        }
        // Another worker may run it too; a third shall not.
        core.watch(node);
    }
}

/// A suspect's worker has died, which it had for itself since then.
fn count_death_alone(core: &mut Core, suspect: NodeId, since: Duration, attempt: Option<u32>) {
    let lately = since.saturating_sub(core.policy.lost_after);
    let others_die = core.unexplained.iter().any(|(when, executed)| *when >= lately && !executed.contains(&suspect));
    let most_excuses = core.policy.node_crashes.saturating_mul(EXCUSES_PER_CRASH);
    let Some(record) = core.record(suspect) else { return };
    let is_excused = others_die && record.deaths.excused < most_excuses;
    record.mourn(if is_excused { Death::Excused } else { Death::Alone }, attempt);
}

/// Somebody executes this attempt of a node. If its worker was thought to have died meanwhile, only its connection had ended.
pub(super) fn absolve(core: &mut Core, node: NodeId, attempt: u32, now: Duration, outbox: &mut Outbox) {
    let was_suspect = core.is_suspect(node);
    let Some(record) = core.record(node) else { return };
    if !record.revive(attempt) || !core.graph.is_open(node) {
        return;
    }
    if was_suspect && !core.is_suspect(node) {
        if core.look(node).is_some_and(|record| matches!(record.place, Place::Suspects(_))) {
            schedule::await_now(core, node, now);
        }
        core.watch(node);
    }
    let deaths = core.look(node).map_or(0, |record| record.deaths.total());
    outbox.tell(RunEvent::NodeAbsolved { name: core.name(node), deaths });
}
