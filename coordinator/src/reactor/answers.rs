//! Answers of workers: which one is accepted, and what happens to the others.

use std::time::Duration;

use lookalike::graph::{Blob, BlobHash, FailureReason, NodeFailure, NodeId, NodeSpec, NodeState};
use lookalike::protocol::ProcessName;

use super::error::{NodeAnswer, Stop};
use super::{leases, membership, results};
use crate::actions::{Action, Outbox};
use crate::events::{Departure, Site};
use crate::state::{Candidate, Core};

/// The site, the node and the attempt of an answer.
pub(super) type Answer = (Site, NodeId, u32);

pub(super) fn finished(
    core: &mut Core,
    answer: Answer,
    output: Blob,
    (arrived, now): (Duration, Duration),
    outbox: &mut Outbox,
) -> Result<(), Stop> {
    let (site, node, attempt) = answer;
    let process = process_of(core, site);
    let Some(since) = answered(core, answer, now, outbox) else {
        return Ok(());
    };
    let took = since.map(|since| arrived.saturating_sub(since));
    if matches!(site, Site::Worker(_)) {
        core.summary.output_bytes_received += output.len() as u64;
    }
    take(core, node, Candidate { site, process, attempt, output, took }, now, outbox)
}

fn process_of(core: &Core, site: Site) -> Option<ProcessName> {
    let Site::Worker(worker) = site else { return None };
    core.members.get(worker).map(|member| member.process.name)
}

/// Accept an output, or keep it until the second one arrives.
fn take(core: &mut Core, node: NodeId, result: Candidate, now: Duration, outbox: &mut Outbox) -> Result<(), Stop> {
    let is_open = core.graph.state(node) == Some(&NodeState::Ready);
    if is_open && core.look(node).is_some_and(|record| record.is_verified) {
        return verify(core, node, result, now, outbox);
    }
    results::accept(core, node, result, now, outbox)
}

pub(super) fn failed(
    core: &mut Core,
    answer: Answer,
    failure: NodeFailure,
    now: Duration,
    outbox: &mut Outbox,
) -> Result<(), Stop> {
    let (second_site, node, _) = answer;
    if answered(core, answer, now, outbox).is_none() {
        return Ok(());
    }
    if !core.graph.is_open(node) {
        let has_output = matches!(core.graph.state(node), Some(NodeState::Completed(_)));
        // A cancelled execution does not contradict the output.
        if has_output && failure != NodeFailure::Cancelled {
            results::tell_difference(core, node, second_site, failure.to_string(), outbox);
        }
        return Ok(());
    }
    if let Some(first) = core.record(node).and_then(|record| record.candidate.take()) {
        let first_answer = NodeAnswer::Output(first.output.hash());
        let second = NodeAnswer::Failure(Box::new(failure));
        let name = Box::new(core.name(node));
        return Err(Stop::ResultsDiffer { name, first_site: first.site, first: first_answer, second_site, second });
    }
    core.record(node).into_iter().for_each(|record| record.finished_by = Some(second_site));
    core.graph.fail(node, FailureReason::Node(failure));
    Ok(())
}

/// Process the end of a lease by an answer. Returns since when the node ran under it (if known); `None` if the attempt was never
/// given out. A worker that answers for such an attempt is dropped.
fn answered(core: &mut Core, answer: Answer, now: Duration, outbox: &mut Outbox) -> Option<Option<Duration>> {
    let (site, node, attempt) = answer;
    let was_asked = core.was_given_out(node, attempt);
    let since = match site {
        Site::Coordinator => core.record(node).and_then(|record| record.here_since.take()),
        Site::Worker(worker) if was_asked => {
            leases::renew(core, worker, now);
            let member = core.members.get(worker);
            if member.is_some() {
                outbox.push(Action::Acknowledge { worker, node, attempt });
            }
            let held = member.and_then(|member| member.leases.get(&node)).filter(|held| held.attempt == attempt);
            let since = held.and_then(|held| held.started_at);
            if held.is_some() {
                core.end_lease(worker, node, now);
            }
            since
        }
        Site::Worker(worker) => {
            let what = format!("it answered for {node}, attempt {attempt}, which was never given out");
            membership::drop_worker(core, worker, &Departure::Violation(what), now, outbox);
            None
        }
    };
    was_asked.then_some(since)
}

/// Process an output of a node that is verified by a second computation: keep the first output, compare the second.
fn verify(core: &mut Core, node: NodeId, result: Candidate, now: Duration, outbox: &mut Outbox) -> Result<(), Stop> {
    // A suspect node's first result is accepted without a second computation.
    let is_suspect = core.is_suspect(node);
    let Some(record) = core.record(node) else { return Ok(()) };
    let first = match record.candidate.take() {
        None if is_suspect => return results::accept(core, node, result, now, outbox),
        None => result,
        Some(first) if first.output != result.output => {
            return Err(results::differ(core, node, (first.site, first.output.hash()), &result));
        }
        Some(first) if is_second_computation(&first, &result) => {
            core.summary.verified_nodes += 1;
            return results::accept(core, node, *first, now, outbox);
        }
        // A duplicate: the worker never received the acknowledgement.
        Some(first) => *first,
    };
    record.candidate = Some(Box::new(first));
    if record.holders.is_empty() {
        leases::await_now(core, node, now);
    }
    Ok(())
}

/// Whether an output was computed a second time. A process that reconnects may send one output under two leases, but if it has
/// reported the start of the second one, it has computed the output again.
fn is_second_computation(first: &Candidate, second: &Candidate) -> bool {
    let is_another = first.process.is_some() && second.process.is_some() && first.process != second.process;
    first.attempt != second.attempt && (is_another || second.took.is_some())
}

/// Whether this node is in the share to be verified, which is the same in every run.
pub(super) fn is_chosen(core: &Core, spec: &NodeSpec, node: NodeId) -> bool {
    let fraction = core.policy.verify_fraction;
    if fraction <= 0.0 {
        return false;
    }
    let inputs = core.graph.input_hashes(node).unwrap_or_default();
    let mut named = core.policy.verify_seed.to_le_bytes().to_vec();
    named.extend_from_slice(spec.kind.as_bytes());
    named.extend_from_slice(&BlobHash::of(&spec.parameters).0);
    inputs.iter().for_each(|input| named.extend_from_slice(&input.0));
    let [a, b, c, d, ..] = BlobHash::of(&named).0;
    // Uniform in [0, 1).
    f64::from(u32::from_le_bytes([a, b, c, d])) / (f64::from(u32::MAX) + 1.0) < fraction
}
