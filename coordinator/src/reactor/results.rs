//! Accepts outputs: completes the node, ends its other leases, reports an answer that differs.

use std::time::Duration;

use lookalike::graph::{BlobHash, Completion, FailureReason, NodeId, NodeState};

use super::error::{NodeAnswer, Stop};
use super::leases;
use crate::actions::{Action, Outbox};
use crate::events::{RunEvent, Site};
use crate::state::{Candidate, Core, Place};

/// Accept the output of a node that waits for its verification without verifying it; `false` if no node waits.
pub(super) fn accept_candidate(core: &mut Core, node: NodeId, now: Duration, outbox: &mut Outbox) -> bool {
    let candidate = core.record(node).and_then(|record| record.candidate.take());
    // The node is open, so there is no other output that could differ.
    candidate.is_some_and(|candidate| accept(core, node, *candidate, now, outbox).is_ok())
}

pub(super) fn accept(
    core: &mut Core,
    node: NodeId,
    result: Candidate,
    now: Duration,
    outbox: &mut Outbox,
) -> Result<(), Stop> {
    let (site, bytes, took) = (result.site, result.output.len(), result.took);
    match core.graph.complete(node, result.output.clone()) {
        Completion::Accepted => {
            retract(core, node, now, outbox);
            core.record(node).into_iter().for_each(|record| record.finished_by = Some(site));
            let name = core.name(node);
            took.filter(|took| !took.is_zero()).into_iter().for_each(|took| core.pace.note(&name.kind, took));
            if core.past_outputs.is_some() {
                outbox.push(Action::Keep { node, output: result.output });
            }
            outbox.tell(RunEvent::NodeFinished { name, site, bytes, elapsed: took.unwrap_or_default() });
        }
        Completion::Duplicate => {
            core.summary.duplicate_results += 1;
            outbox.tell(RunEvent::DuplicateResult { node, site });
        }
        // The node failed before, and the planner has processed that.
        Completion::Refused => {
            if let Some(NodeState::Failed(FailureReason::Node(failure))) = core.graph.state(node) {
                let error = failure.to_string();
                tell_difference(core, node, site, error, outbox);
            }
        }
        Completion::Different { first } => {
            let site = core.look(node).and_then(|record| record.finished_by).unwrap_or(Site::Coordinator);
            return Err(differ(core, node, (site, first), &result));
        }
    }
    Ok(())
}

pub(super) fn differ(core: &Core, node: NodeId, (first_site, first): (Site, BlobHash), second: &Candidate) -> Stop {
    Stop::ResultsDiffer {
        name: Box::new(core.name(node)),
        first_site,
        first: NodeAnswer::Output(first),
        second_site: second.site,
        second: NodeAnswer::Output(second.output.hash()),
    }
}

/// The node need not run any more: cancel its executions and end its leases.
pub(super) fn retract(core: &mut Core, node: NodeId, now: Duration, outbox: &mut Outbox) {
    core.put(node, Place::Nowhere);
    let Some(record) = core.record(node) else { return };
    record.candidate = None;
    if record.here_since.is_some() {
        outbox.push(Action::CancelHere { node });
    }
    for worker in std::mem::take(&mut record.holders) {
        leases::take_back(core, worker, node, now, outbox);
    }
}

/// Report that a node has both an output and an error. The first answer stays, because the planner has processed it.
pub(super) fn tell_difference(core: &Core, node: NodeId, second: Site, error: String, outbox: &mut Outbox) {
    let first = core.look(node).and_then(|record| record.finished_by).unwrap_or(Site::Coordinator);
    outbox.tell(RunEvent::AnswersDiffer { name: core.name(node), first, second, error });
}
