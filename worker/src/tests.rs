//! Tests of the task state machine: what a worker does, in order, without sockets and threads.

use std::sync::Arc;

use lookalike::graph::{Blob, DecodedCache, NodeFailure, RunContext};
use lookalike::protocol::{Assignment, LeaseName, RunName, ToCoordinator};

use crate::cache::BlobCache;
use crate::execute::Completed;
use crate::tasks::{Action, Tasks};

const RUN: RunName = RunName([1; 16]);

fn tasks(threads: usize) -> Tasks {
    let mut tasks = Tasks::new(threads, BlobCache::new(1000));
    assert!(tasks.welcomed(RUN, 1).is_empty());
    tasks
}

fn context() -> RunContext {
    RunContext::new(Arc::new(DecodedCache::new(0)))
}

fn lease(node: u64, attempt: u32) -> LeaseName {
    LeaseName { node, attempt, epoch: 1 }
}

fn assignment(lease: LeaseName, inputs: &[&Blob]) -> Assignment {
    let inputs = inputs.iter().map(|blob| blob.hash().0).collect();
    Assignment { lease, kind: "sum".into(), label: format!("sum {}", lease.node), parameters: vec![7], inputs }
}

/// The actions as one line of text each.
fn said(actions: &[Action]) -> Vec<String> {
    let line = |action: &Action| match action {
        Action::Send(ToCoordinator::Fetch { hash }) => format!("fetch {}", hash[0]),
        Action::Send(ToCoordinator::Started(lease)) => format!("started {}.{}", lease.node, lease.attempt),
        Action::Send(ToCoordinator::Failed { lease, kind, message }) => {
            format!("failed {} ({kind:?}): {message}", lease.node)
        }
        Action::Send(ToCoordinator::Heartbeat { executing }) => {
            let nodes: Vec<_> = executing.iter().map(|node| node.lease.node).collect();
            format!("executes {nodes:?}")
        }
        Action::Send(other) => format!("{other:?}"),
        Action::Announce { lease, serial: _ } => format!("announce {}.{}", lease.node, lease.attempt),
        Action::SendOutput { lease, output } => format!("output {}.{} {}", lease.node, lease.attempt, output[0]),
        Action::Execute(job) => format!("execute with {} inputs", job.inputs.len()),
    };
    actions.iter().map(line).collect()
}

/// Report the announcements among these actions as written; returns the serial numbers of the jobs that then execute.
fn announce(tasks: &mut Tasks, actions: &[Action]) -> Vec<u64> {
    let serials = actions.iter().filter_map(|action| match action {
        Action::Announce { serial, .. } => Some(*serial),
        _ => None,
    });
    let executed = |serial| match tasks.announced(serial).pop() {
        Some(Action::Execute(job)) => Some(job.serial),
        _ => None,
    };
    serials.filter_map(executed).collect()
}

fn output(serial: u64, byte: u8) -> Completed {
    Completed { serial, result: Ok(Blob::new(vec![byte])) }
}

#[test]
fn shared_input_is_fetched_once_and_kept() {
    let mut tasks = tasks(2);
    let table = Blob::new(vec![3; 100]);
    let fetch = format!("fetch {}", table.hash().0[0]);
    assert_eq!(said(&tasks.assigned(assignment(lease(0, 1), &[&table]), context)), [fetch]);
    assert!(tasks.assigned(assignment(lease(1, 1), &[&table, &table]), context).is_empty());
    let actions = tasks.fetched(table.clone(), context);
    assert_eq!(said(&actions), ["announce 0.1", "announce 1.1"]);
    // All threads are busy, but nothing must be fetched any more.
    assert!(tasks.assigned(assignment(lease(2, 1), &[&table]), context).is_empty());
    assert_eq!(announce(&mut tasks, &actions).len(), 2);
}

#[test]
fn inputs_that_have_arrived_survive_a_full_cache() {
    let mut tasks = Tasks::new(1, BlobCache::new(100));
    tasks.welcomed(RUN, 1);
    let [first, second] = [1, 2].map(|byte| Blob::new(vec![byte; 80]));
    tasks.assigned(assignment(lease(0, 1), &[&first, &second]), context);
    assert!(tasks.fetched(first, context).is_empty());
    let actions = tasks.fetched(second, context);
    let serial = said(&actions);
    assert_eq!(serial, ["announce 0.1"]);
}

#[test]
fn node_executes_only_after_it_was_announced_and_in_order_of_arrival() {
    let mut tasks = tasks(1);
    let first = tasks.assigned(assignment(lease(5, 1), &[]), context);
    assert_eq!(said(&first), ["announce 5.1"]);
    assert!(tasks.assigned(assignment(lease(3, 1), &[]), context).is_empty());
    assert!(tasks.assigned(assignment(lease(4, 1), &[]), context).is_empty());
    assert!(tasks.executing().is_empty());
    let serials = announce(&mut tasks, &first);
    assert_eq!(tasks.executing()[0].lease, lease(5, 1));
    let next = tasks.completed(output(serials[0], 9), context);
    assert_eq!(said(&next), ["output 5.1 9", "announce 3.1"]);
}

#[test]
fn unacknowledged_answers_are_sent_again_on_a_new_connection() {
    let mut tasks = tasks(3);
    let mut actions = tasks.assigned(assignment(lease(0, 1), &[]), context);
    actions.extend(tasks.assigned(assignment(lease(1, 1), &[]), context));
    actions.extend(tasks.assigned(assignment(lease(2, 1), &[]), context));
    let serials = announce(&mut tasks, &actions);
    tasks.completed(output(serials[0], 10), context);
    let failure = Err(NodeFailure::Panicked { message: "no".into() });
    tasks.completed(Completed { serial: serials[1], result: failure }, context);
    tasks.acknowledged(lease(0, 1));
    assert_eq!(said(&tasks.welcomed(RUN, 1)), ["failed 1 (Panic): no", "executes [2]"]);
    // Node 2 continued to execute; it is assigned to this worker again under a new lease.
    assert_eq!(said(&tasks.assigned(assignment(lease(2, 2), &[]), context)), ["started 2.2"]);
    assert_eq!(said(&tasks.completed(output(serials[2], 12), context)), ["output 2.2 12"]);
    assert_eq!(said(&tasks.assigned(assignment(lease(2, 3), &[]), context)), ["output 2.3 12"]);
}

#[test]
fn nodes_that_have_not_started_are_dropped_with_their_connection() {
    let mut tasks = tasks(1);
    let unwritten = tasks.assigned(assignment(lease(0, 1), &[]), context);
    tasks.assigned(assignment(lease(1, 1), &[]), context);
    assert_eq!(said(&tasks.welcomed(RUN, 1)), ["executes []"]);
    assert!(announce(&mut tasks, &unwritten).is_empty());
    assert_eq!(said(&tasks.assigned(assignment(lease(1, 2), &[]), context)), ["announce 1.2"]);
}

#[test]
fn another_coordinator_gets_no_results_of_nodes_of_an_earlier_one() {
    for (run, epoch) in [(RUN, 2), (RunName([2; 16]), 1)] {
        let mut tasks = tasks(2);
        let mut actions = tasks.assigned(assignment(lease(0, 1), &[]), context);
        actions.extend(tasks.assigned(assignment(lease(1, 1), &[]), context));
        let serials = announce(&mut tasks, &actions);
        tasks.completed(output(serials[0], 10), context);
        assert!(tasks.welcomed(run, epoch).is_empty());
        assert!(tasks.are_done());
        // The same number is another node there. The old execution still has its thread, but its output is dropped.
        let later = |node| LeaseName { epoch, ..lease(node, 1) };
        let own = tasks.assigned(assignment(later(1), &[]), context);
        assert_eq!(said(&own), ["announce 1.1"]);
        announce(&mut tasks, &own);
        assert_eq!(tasks.executing().iter().map(|node| node.lease).collect::<Vec<_>>(), [later(1)]);
        assert!(tasks.completed(output(serials[1], 11), context).is_empty());
    }
}

#[test]
fn cancelled_node_is_not_answered_and_frees_its_thread() {
    let mut tasks = tasks(1);
    let actions = tasks.assigned(assignment(lease(0, 1), &[]), context);
    let serials = announce(&mut tasks, &actions);
    tasks.assigned(assignment(lease(1, 1), &[]), context);
    assert!(tasks.cancelled(lease(0, 7), context).is_empty());
    assert_eq!(tasks.executing().len(), 1);
    assert!(tasks.cancelled(lease(0, 1), context).is_empty());
    let stopped = Completed { serial: serials[0], result: Err(NodeFailure::Cancelled) };
    assert_eq!(said(&tasks.completed(stopped, context)), ["announce 1.1"]);
}

#[test]
fn blob_that_a_cancelled_node_waited_for_is_requested_again() {
    let mut tasks = tasks(1);
    let [only, both] = [1, 2].map(|byte| Blob::new(vec![byte]));
    let names = [&only, &both].map(|blob| format!("fetch {}", blob.hash().0[0]));
    assert_eq!(said(&tasks.assigned(assignment(lease(0, 1), &[&only, &both]), context)), names);
    assert!(tasks.assigned(assignment(lease(1, 1), &[&both]), context).is_empty());
    // The coordinator may have dropped the first node's inputs before it read the request.
    assert!(tasks.cancelled(lease(0, 1), context).is_empty());
    assert_eq!(said(&tasks.assigned(assignment(lease(2, 1), &[&only, &both]), context)), names[..1]);
    assert_eq!(said(&tasks.fetched(both, context)), ["announce 1.1"]);
}

#[test]
fn draining_worker_finishes_started_nodes_and_starts_no_more() {
    let mut tasks = tasks(1);
    let actions = tasks.assigned(assignment(lease(0, 1), &[]), context);
    tasks.assigned(assignment(lease(1, 1), &[]), context);
    // The message that node 0 starts is being sent, so it counts as started.
    tasks.drain();
    let serials = announce(&mut tasks, &actions);
    assert!(!tasks.are_done());
    assert_eq!(said(&tasks.assigned(assignment(lease(2, 1), &[]), context)), ["Draining"]);
    assert_eq!(said(&tasks.completed(output(serials[0], 9), context)), ["output 0.1 9"]);
    assert!(!tasks.are_done(), "the answer may be lost");
    assert_eq!(said(&tasks.welcomed(RUN, 1)), ["output 0.1 9", "executes []"]);
    tasks.acknowledged(lease(0, 1));
    assert!(tasks.are_done());
}
