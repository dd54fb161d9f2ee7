//! Quarantine of nodes that may kill their workers: which nodes a death is counted against.
//!
//! Only a node that a worker was executing can have killed it. After
//! [`Policy::suspect_after`](crate::policy::Policy::suspect_after) deaths in which a node took part, it is a *suspect*: it runs
//! alone, on a worker that has executed nothing before or at least executes nothing else at the same time. Only deaths there are
//! counted against it, and [`Policy::node_crashes`](crate::policy::Policy::node_crashes) of them make it fail.
//!
//! A suspect's worker may also be killed from outside. Other deaths are the evidence: while workers die whose deaths no suspect
//! explains, the deaths of a suspect's workers are not counted, up to a limit.
//!
//! A broken connection looks like a death. If its process reconnects, the death is subtracted again.

use std::time::Duration;

use lookalike::graph::NodeId;
use lookalike::protocol::ProcessName;

use super::leases;
use crate::actions::Outbox;
use crate::events::RunEvent;
use crate::state::{Core, Death, Deaths, Member, Place, Unexplained};

/// For each death that counts, at most this many deaths of a suspect's workers are not counted. So a node that kills its workers
/// fails after a bounded number of deaths, even if workers keep dying for other reasons.
const NOT_COUNTED_PER_CRASH: u32 = 10;

/// How many unexplained deaths are remembered.
const REMEMBERED: usize = 8;

/// A worker appears to have died: count its death against the nodes that it executed. Returns what was counted.
pub(super) fn count_death(
    core: &mut Core,
    member: &Member,
    now: Duration,
    outbox: &mut Outbox,
) -> Vec<(NodeId, Death)> {
    let executing: Vec<(NodeId, Duration)> =
        member.leases.iter().filter_map(|(node, held)| Some((*node, held.started_at?))).collect();
    if let Some((suspect, since)) = executing.iter().find(|(node, _)| member.alone_with == Some(*node)) {
        let death = judge_death_alone(core, *suspect, *since);
        return count(core, &[*suspect], death, outbox);
    }
    if !executing.iter().any(|(node, _)| core.is_suspect(*node)) {
        let executed = executing.iter().map(|(node, _)| *node).collect();
        core.unexplained.push_back(Unexplained { when: now, process: member.process.name, executed });
        if core.unexplained.len() > REMEMBERED {
            core.unexplained.pop_front();
        }
    }
    let executed: Vec<NodeId> = executing.iter().map(|(node, _)| *node).collect();
    count(core, &executed, Death::InCompany, outbox)
}

fn count(core: &mut Core, nodes: &[NodeId], death: Death, outbox: &mut Outbox) -> Vec<(NodeId, Death)> {
    let limit = core.policy.suspect_after;
    for node in nodes {
        let Some(record) = core.record(*node) else { continue };
        *of(&mut record.deaths, death) += 1;
        let (in_company, deaths) = (record.deaths.in_company, record.deaths.total());
        outbox.tell(RunEvent::DeathsCounted { name: core.name(*node), deaths });
        if death == Death::InCompany && in_company == limit {
            core.summary.suspected_nodes += 1;
            outbox.tell(RunEvent::NodeSuspected { name: core.name(*node), deaths });
        }
        // This changes whether a second worker may run it.
        core.watch(*node);
    }
    nodes.iter().map(|node| (*node, death)).collect()
}

/// A process that appeared to have died has reconnected: subtract the deaths that were counted for it.
pub(super) fn take_back_death(
    core: &mut Core,
    process: ProcessName,
    counted: &[(NodeId, Death)],
    now: Duration,
    outbox: &mut Outbox,
) {
    core.unexplained.retain(|death| death.process != process);
    for (node, death) in counted {
        let Some(record) = core.record(*node) else { continue };
        let count = of(&mut record.deaths, *death);
        *count = count.saturating_sub(1);
        let (deaths, place) = (record.deaths.total(), record.place);
        outbox.tell(RunEvent::DeathsCounted { name: core.name(*node), deaths });
        if matches!(place, Place::Suspects(_)) && !core.is_suspect(*node) {
            leases::await_now(core, *node, now);
        }
        core.watch(*node);
    }
}

fn of(deaths: &mut Deaths, death: Death) -> &mut u32 {
    match death {
        Death::InCompany => &mut deaths.in_company,
        Death::Alone => &mut deaths.alone,
        Death::NotCounted => &mut deaths.not_counted,
    }
}

/// How to count the death of a suspect's worker, on which the suspect had run alone since `since`.
fn judge_death_alone(core: &Core, suspect: NodeId, since: Duration) -> Death {
    let lately = since.saturating_sub(core.policy.lost_after);
    let is_other = |death: &Unexplained| death.when >= lately && !death.executed.contains(&suspect);
    let others_die = core.unexplained.iter().any(is_other);
    let most = core.policy.node_crashes.saturating_mul(NOT_COUNTED_PER_CRASH);
    let not_counted = core.look(suspect).map_or(0, |record| record.deaths.not_counted);
    if others_die && not_counted < most { Death::NotCounted } else { Death::Alone }
}
