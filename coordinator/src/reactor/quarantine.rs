//! Nodes that may kill their workers: whom to suspect of a death, and when to believe it.
//!
//! Only what a worker was executing can have killed it. After a few deaths in which a node took part
//! ([`Policy::suspect_after`](crate::core::Policy::suspect_after)) it is a *suspect*: it runs alone, on a worker that has
//! executed nothing before or at least nothing else at the same time. Only deaths there count against it, and so many of
//! them ([`Policy::node_crashes`](crate::core::Policy::node_crashes)) fail it by name.
//!
//! Somebody who kills workers from outside may hit a suspect's worker as well. What tells the two apart is whom else they
//! hit: as long as workers die whose deaths no suspect explains, a suspect is excused, though not for ever.

use std::time::Duration;

use lookalike::graph::NodeId;

use crate::comm::{Outbox, RunEvent};
use crate::core::{Core, Member};

/// How many deaths of a suspect's workers are excused for one that would count: where a machine fails all the time, a node that
/// kills its workers has to fail in the end.
const EXCUSES_PER_CRASH: u32 = 10;

/// How many unexplained deaths are remembered.
const REMEMBERED: usize = 8;

/// A worker has died: count it against the nodes that it executed.
pub(super) fn count_death(core: &mut Core, member: &Member, now: Duration, outbox: &mut Outbox) {
    let executing: Vec<(NodeId, Duration)> =
        member.leases.iter().filter_map(|(node, held)| Some((*node, held.started_at?))).collect();
    if let Some((suspect, since)) = executing.iter().find(|(node, _)| member.alone_with == Some(*node)) {
        return count_death_alone(core, *suspect, *since);
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
        record.deaths.in_company += 1;
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
fn count_death_alone(core: &mut Core, suspect: NodeId, since: Duration) {
    let lately = since.saturating_sub(core.policy.lost_after);
    let others_die = core.unexplained.iter().any(|(when, executed)| *when >= lately && !executed.contains(&suspect));
    let most_excuses = core.policy.node_crashes.saturating_mul(EXCUSES_PER_CRASH);
    let Some(record) = core.record(suspect) else { return };
    if others_die && record.deaths.excused < most_excuses {
        record.deaths.excused += 1;
    } else {
        record.deaths.alone += 1;
    }
}
