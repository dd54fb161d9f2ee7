//! Scenarios: events in, recorded actions out. No sockets and no waiting; the tests set the time.

use std::time::Duration;

use lookalike::graph::{
    Blob, BlobHash, FailureReason, GraphEdit, Input, NodeFailure, NodeId, NodeSpec, Placement, PlanError, Planner,
    WorkerId,
};
use lookalike::protocol::ProcessName;

use super::{Event, Executing, Stop, handle, handle_arrived, start};
use crate::actions::{Action, Outbox, WorkerProcess};
use crate::events::{Departure, RunEvent, Site};
use crate::policy::{Policy, Speculation};
use crate::state::Core;

mod differing;
mod draining;
mod quarantine;
mod returning;
mod short;
mod speculation;
mod verification;

const A: WorkerId = WorkerId(1);
const B: WorkerId = WorkerId(2);
const C: WorkerId = WorkerId(3);

/// A fixed plan, and the calls that its planner received.
#[derive(Default)]
pub(super) struct Script {
    pub(super) nodes: Vec<NodeSpec>,
    pub(super) blob: Vec<u8>,
    /// Added once node 0 is complete.
    pub(super) follow_up: Option<NodeSpec>,
    /// Added when the planner is asked to look again.
    pub(super) late: Option<NodeSpec>,
    /// Released once node 0 is complete.
    pub(super) released: Vec<NodeId>,
    pub(super) released_blob: Option<BlobHash>,
    pub(super) tolerates_failures: bool,
    /// Refuses every output with this error.
    pub(super) not_verified: bool,
    /// Does not ask for second computations.
    pub(super) checks_itself: bool,
    pub(super) completed: Vec<NodeId>,
    pub(super) failed: Vec<(NodeId, FailureReason)>,
}

impl Planner for Script {
    fn start(&mut self, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        graph.add_blob(self.blob.clone())?;
        self.nodes.iter().try_for_each(|spec| graph.add_node(spec.clone()).map(|_| ()))
    }

    fn completed(&mut self, node: NodeId, _: &Blob, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        self.completed.push(node);
        if self.not_verified {
            let what = "the cost of gamma 2".to_owned();
            return Err(PlanError::NotVerified { what, claimed: 0.5, recomputed: 0.25 });
        }
        if node == NodeId(0) {
            self.follow_up.take().map(|spec| graph.add_node(spec)).transpose()?;
            self.released.drain(..).for_each(|node| graph.release(node));
            self.released_blob.take().into_iter().for_each(|hash| graph.release_blob(hash));
        }
        Ok(())
    }

    fn failed(&mut self, node: NodeId, reason: &FailureReason, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        self.failed.push((node, reason.clone()));
        let (kind, label) = graph.spec(node).map(|spec| (spec.kind.clone(), spec.label.clone())).unwrap();
        let error = PlanError::NodeFailed { kind, label: label.to_string(), reason: reason.clone() };
        if self.tolerates_failures { Ok(()) } else { Err(error) }
    }

    fn look_again(&mut self, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        self.late.take().map_or(Ok(()), |spec| graph.add_node(spec).map(|_| ()))
    }

    fn is_verified_by_repetition(&self, _: &NodeSpec) -> bool {
        !self.checks_itself
    }
}

pub(super) fn node(label: &str, inputs: Vec<Input>, placement: Placement) -> NodeSpec {
    NodeSpec { kind: "test".into(), label: label.into(), parameters: vec![], inputs, placement, priority: 0 }
}

/// A process with this number in its name. The process id is always the same, as in containers.
pub(super) fn process(number: u64) -> WorkerProcess {
    WorkerProcess { id: 1, name: ProcessName(u128::from(number).to_le_bytes()), is_local: false }
}

fn independent(count: usize) -> Script {
    let nodes = (0..count).map(|index| node(&format!("n{index}"), vec![], Placement::Worker)).collect();
    Script { nodes, ..Script::default() }
}

/// The state under test, with a clock that only tests advance.
struct Bench {
    core: Core,
    planner: Script,
    outbox: Outbox,
    now: Duration,
    processes: u64,
}

impl Bench {
    fn new(planner: Script) -> Self {
        Self::with(planner, Policy::default())
    }

    fn with(planner: Script, policy: Policy) -> Self {
        let core = Core::new(policy, 1);
        let mut bench = Self { core, planner, outbox: Outbox::default(), now: Duration::ZERO, processes: 0 };
        start(&mut bench.core, &mut bench.planner, bench.now, &mut bench.outbox).unwrap();
        bench
    }

    fn try_handle(&mut self, event: Event) -> Result<Vec<String>, Stop> {
        let outcome = handle(&mut self.core, &mut self.planner, event, self.now, &mut self.outbox);
        let said = self.outbox.take().iter().filter_map(line).collect();
        outcome.map(|()| said)
    }

    fn handle(&mut self, event: Event) -> Vec<String> {
        self.try_handle(event).unwrap()
    }

    fn join(&mut self, worker: WorkerId, threads: usize) -> Vec<String> {
        self.processes += 1;
        self.join_as(worker, threads, process(1000 + self.processes))
    }

    /// A process joins, which may have been connected before.
    fn join_as(&mut self, worker: WorkerId, threads: usize, process: WorkerProcess) -> Vec<String> {
        self.handle(Event::WorkerJoined { worker, threads, process })
    }

    fn start(&mut self, worker: WorkerId, node: u64, attempt: u32) -> Vec<String> {
        self.handle(Event::Started { worker, node: NodeId(node), attempt })
    }

    fn finish(&mut self, worker: WorkerId, node: u64, attempt: u32, byte: u8) -> Vec<String> {
        self.handle(finished(Site::Worker(worker), node, attempt, byte))
    }

    fn lose(&mut self, worker: WorkerId, departure: Departure) -> Vec<String> {
        self.handle(Event::WorkerLeft { worker, departure })
    }

    fn pass_time(&mut self, seconds: u64) -> Result<Vec<String>, Stop> {
        self.now += Duration::from_secs(seconds);
        self.try_handle(Event::DeadlinePassed)
    }

    /// Time passes while these workers send heartbeats.
    fn live(&mut self, milliseconds: u64, workers: &[WorkerId]) -> Vec<String> {
        self.now += Duration::from_millis(milliseconds);
        let heard =
            workers.iter().flat_map(|worker| self.handle(Event::Heartbeat { worker: *worker, executing: Vec::new() }));
        let mut said: Vec<String> = heard.collect();
        said.extend(self.handle(Event::DeadlinePassed));
        let next = self.core.next_deadline();
        assert!(next.is_none_or(|next| next > self.now), "it would be asked again and again: {next:?}");
        said
    }
}

fn finished(site: Site, node: u64, attempt: u32, byte: u8) -> Event {
    Event::Finished { site, node: NodeId(node), attempt, output: Blob::new(vec![byte]) }
}

/// The essential part of an action, in a few words. A lease is `node.attempt`.
fn line(action: &Action) -> Option<String> {
    Some(match action {
        Action::Assign { worker, lease } => format!("{worker} gets {}.{}", lease.node.0, lease.attempt),
        Action::Cancel { worker, lease } => format!("{worker} drops {}.{}", lease.node.0, lease.attempt),
        Action::Acknowledge { worker, node, attempt } => format!("{worker} is thanked for {}.{attempt}", node.0),
        Action::SendBlob { worker, blob } => format!("{worker} gets {} bytes", blob.len()),
        Action::ForgoBlob { worker } => format!("{worker} gets nothing"),
        Action::Drop { worker } => format!("{worker} is disconnected"),
        Action::Keep { node, output } => format!("keep {} bytes of {}", output.len(), node.0),
        Action::CancelHere { node } => format!("stop {} here", node.0),
        Action::RunHere { node, attempt } => format!("run {}.{attempt} here", node.0),
        Action::Tell(RunEvent::NodeFailed { name, reason }) => format!("{} failed: {reason}", name.label),
        Action::Tell(RunEvent::NodeRequeued { name, crashes, .. }) => format!("{} requeued, {crashes}", name.label),
        Action::Tell(RunEvent::NodeSuspected { name, deaths }) => format!("{} suspected, {deaths}", name.label),
        Action::Tell(RunEvent::AnswersDiffer { name, first, second, error }) => {
            format!("{} differs between {first} and {second}: {error}", name.label)
        }
        Action::Tell(RunEvent::NodeSpeculated { name, worker }) => format!("{} is slow, {worker} helps", name.label),
        Action::Tell(RunEvent::WaitingForWorkers { waited, .. }) => format!("waiting since {} s", waited.as_secs()),
        Action::Tell(_) => return None,
    })
}

#[test]
fn nodes_fan_out_to_the_least_busy_worker_earliest_first() {
    let mut bench = Bench::new(independent(6));
    let first = bench.join(A, 1);
    assert_eq!(first, ["worker 1 gets 0.1", "worker 1 gets 1.1", "worker 1 gets 2.1"]);
    let second = bench.join(B, 2);
    assert_eq!(second, ["worker 2 gets 3.1", "worker 2 gets 4.1", "worker 2 gets 5.1"]);
    assert_eq!(bench.finish(A, 0, 1, 0), ["worker 1 is thanked for 0.1"]);
}

#[test]
fn queued_node_moves_to_an_idle_worker() {
    let mut bench = Bench::new(independent(3));
    bench.join(A, 1);
    bench.start(A, 0, 1);
    assert_eq!(bench.join(B, 1), ["worker 1 drops 2.1", "worker 2 gets 2.2"]);
    // Worker 1 finished before the message reached it: its result is accepted, and worker 2 gets the other waiting node.
    let late = bench.finish(A, 2, 1, 2);
    let expected = ["worker 1 is thanked for 2.1", "worker 2 drops 2.2", "worker 1 drops 1.1", "worker 2 gets 1.2"];
    assert_eq!(late, expected);
}

#[test]
fn worker_is_not_sent_more_bytes_than_it_may_leave_unread() {
    let large = NodeSpec { parameters: vec![0; 1 << 20], ..node("n", vec![], Placement::Worker) };
    let mut bench = Bench::new(Script { nodes: vec![large; 40], ..Script::default() });
    // It has threads for all of them, but eight of them take 8 MiB.
    assert_eq!(bench.join(A, 64).len(), 8);
    // A node that it has begun has left its queue.
    assert_eq!(bench.start(A, 0, 1), ["worker 1 gets 8.1"]);
    assert_eq!(bench.finish(A, 1, 1, 0), ["worker 1 is thanked for 1.1", "worker 1 gets 9.1"]);
    assert_eq!(bench.core.members.get(A).unwrap().waiting.len(), 8);
}

#[test]
fn nodes_that_the_planner_adds_when_polled_are_assigned_at_once() {
    let late = Some(node("late", vec![], Placement::Worker));
    let mut bench = Bench::new(Script { late, ..independent(1) });
    bench.join(A, 2);
    assert_eq!(bench.handle(Event::LookAgain), ["worker 1 gets 1.1"]);
    assert!(bench.handle(Event::LookAgain).is_empty());
}

#[test]
fn nodes_of_a_lost_worker_are_requeued_once() {
    let mut bench = Bench::new(independent(2));
    bench.join(A, 2);
    bench.start(A, 0, 1);
    bench.join(B, 2);
    let lost = bench.lose(A, Departure::Lost);
    assert_eq!(lost, ["n0 requeued, 1", "n1 requeued, 0", "worker 2 gets 0.2", "worker 2 gets 1.2"]);
    assert!(bench.lose(A, Departure::Lost).is_empty());
    bench.finish(B, 0, 2, 0);
    bench.finish(B, 1, 2, 1);
    assert!(bench.core.is_finished());
    assert_eq!(bench.core.summary().requeued_nodes, 2);
}

#[test]
fn only_executing_nodes_of_workers_that_died_are_suspected() {
    let mut bench = Bench::new(independent(1));
    for (round, departure) in [Departure::Goodbye, Departure::Silent, Departure::Lost].into_iter().enumerate() {
        let worker = WorkerId(20 + round as u64);
        bench.join(worker, 1);
        if departure != Departure::Lost {
            bench.start(worker, 0, u32::try_from(round).unwrap() + 1);
        }
        assert_eq!(bench.lose(worker, departure), ["n0 requeued, 0"]);
    }
}

#[test]
fn second_result_is_dropped_when_equal_and_an_error_when_different() {
    let mut bench = Bench::new(independent(2));
    bench.join(A, 2);
    bench.lose(A, Departure::Lost);
    bench.join(B, 2);
    bench.finish(B, 0, 2, 7);
    // Worker 1 reconnects under another number and sends its result.
    bench.join(C, 2);
    assert_eq!(bench.finish(C, 0, 1, 7), ["worker 3 is thanked for 0.1"]);
    assert_eq!(bench.core.summary().duplicate_results, 1);
    let error = bench.try_handle(finished(Site::Worker(C), 0, 1, 8)).unwrap_err();
    assert!(matches!(&error, Stop::ResultsDiffer { name, .. } if name.label.name == "n0"), "{error}");
    assert!(
        error.to_string().contains("from worker 2, output") && error.to_string().contains("from worker 3)"),
        "{error}"
    );
}

#[test]
fn late_result_of_an_earlier_attempt_counts() {
    let mut bench = Bench::new(independent(1));
    bench.join(A, 1);
    bench.start(A, 0, 1);
    bench.lose(A, Departure::Silent);
    bench.join(B, 1);
    bench.start(B, 0, 2);
    bench.join(C, 1);
    let late = bench.finish(C, 0, 1, 5);
    assert_eq!(late, ["worker 3 is thanked for 0.1", "worker 2 drops 0.2"]);
    assert!(bench.core.is_finished());
    assert_eq!(bench.planner.completed, [NodeId(0)]);
}

#[test]
fn late_result_removes_its_node_from_the_queue() {
    let mut bench = Bench::new(independent(1));
    bench.join(A, 1);
    bench.lose(A, Departure::Lost);
    bench.finish(A, 0, 1, 5);
    assert!(bench.core.is_finished());
    assert!(bench.join(B, 1).is_empty());
}

#[test]
fn answer_without_a_lease_ends_the_membership() {
    let mut bench = Bench::new(independent(4));
    bench.join(A, 1);
    assert_eq!(bench.finish(A, 3, 1, 0)[0], "worker 1 is disconnected");
    bench.join(B, 1);
    assert_eq!(bench.finish(B, 0, 9, 0)[0], "worker 2 is disconnected");
}

#[test]
fn blob_is_sent_on_request_and_counted() {
    let blob = vec![1; 40];
    let hash = BlobHash::of(&blob);
    let nodes = (0..2).map(|_| node("n", vec![Input::Blob(hash)], Placement::Worker)).collect();
    let mut bench = Bench::new(Script { nodes, blob, ..Script::default() });
    bench.join(A, 2);
    assert_eq!(bench.handle(Event::BlobRequested { worker: A, hash }), ["worker 1 gets 40 bytes"]);
    assert_eq!((bench.core.summary().blobs_sent, bench.core.summary().blob_bytes_sent), (1, 40));
    assert!(bench.handle(Event::BlobRequested { worker: B, hash }).is_empty());
}

#[test]
fn blob_is_sent_only_while_a_lease_of_the_worker_reads_it() {
    let blob = vec![1; 40];
    let hash = BlobHash::of(&blob);
    let nodes = vec![node("n", vec![], Placement::Worker), node("n", vec![Input::Blob(hash)], Placement::Worker)];
    let mut bench = Bench::new(Script { nodes, blob, ..Script::default() });
    bench.join(A, 1);
    // Node 1 moves from A to B. A may have requested its input before it received the cancellation.
    bench.join(B, 1);
    bench.join(C, 1);
    assert_eq!(bench.handle(Event::BlobRequested { worker: B, hash }), ["worker 2 gets 40 bytes"]);
    for worker in [A, C] {
        assert_eq!(bench.handle(Event::BlobRequested { worker, hash }), [format!("{worker} gets nothing")]);
    }
}

#[test]
fn hashes_of_inputs_are_kept_no_longer_than_the_leases_that_read_them() {
    let blob = vec![1; 40];
    let shared = Input::Blob(BlobHash::of(&blob));
    let mut nodes = vec![node("first", vec![], Placement::Worker)];
    // Each node reads its predecessor's output and, twice, the blob.
    let reader = |source| node("n", vec![Input::OutputOf(NodeId(source)), shared, shared], Placement::Worker);
    nodes.extend((0..50).map(reader));
    let mut bench = Bench::new(Script { nodes, blob, ..Script::default() });
    bench.join(A, 1);
    for number in 0..50 {
        bench.finish(A, number, 1, u8::try_from(number).unwrap());
        assert_eq!(bench.core.members.get(A).unwrap().input_count(), 2, "after node {number}");
    }
    bench.finish(A, 50, 1, 50);
    assert_eq!(bench.core.members.get(A).unwrap().input_count(), 0);
}

#[test]
fn node_waits_for_the_output_it_reads_and_coordinator_nodes_run_here() {
    let mut planner = independent(2);
    let inputs = [0, 1].map(|index| Input::OutputOf(NodeId(index))).to_vec();
    planner.nodes.push(node("join", inputs, Placement::Coordinator));
    let mut bench = Bench::new(planner);
    bench.join(A, 4);
    assert_eq!(bench.finish(A, 1, 1, 1), ["worker 1 is thanked for 1.1"]);
    assert_eq!(bench.finish(A, 0, 1, 0), ["worker 1 is thanked for 0.1", "run 2.1 here"]);
    assert!(!bench.core.is_finished());
    bench.handle(finished(Site::Coordinator, 2, 1, 2));
    assert!(bench.core.is_finished());
}

#[test]
fn node_that_finishes_may_add_nodes() {
    let follow_up = Some(node("follow-up", vec![Input::OutputOf(NodeId(0))], Placement::Worker));
    let mut bench = Bench::new(Script { follow_up, ..independent(1) });
    bench.join(A, 1);
    assert_eq!(bench.finish(A, 0, 1, 0), ["worker 1 is thanked for 0.1", "worker 1 gets 1.1"]);
    bench.finish(A, 1, 1, 1);
    assert!(bench.core.is_finished());
    assert_eq!(bench.planner.completed, [NodeId(0), NodeId(1)]);
}

#[test]
fn application_error_is_not_retried_and_fails_what_depends_on_it() {
    let mut planner = Script { tolerates_failures: true, ..independent(2) };
    planner.nodes.push(node("child", vec![Input::OutputOf(NodeId(0))], Placement::Worker));
    let mut bench = Bench::new(planner);
    bench.join(A, 3);
    let failure = NodeFailure::new("the table is empty");
    let failed = Event::Failed { site: Site::Worker(A), node: NodeId(0), attempt: 1, failure };
    let expected = [
        "worker 1 is thanked for 0.1",
        "n0 failed: the table is empty",
        "child failed: it needs the output of \"n0\" (node 0), which failed",
    ];
    assert_eq!(bench.handle(failed), expected);
    bench.finish(A, 1, 1, 1);
    assert!(bench.core.is_finished());
    assert_eq!((bench.core.summary().completed_nodes, bench.core.summary().failed_nodes), (1, 2));
    // A late output is reported.
    let late = bench.finish(A, 0, 1, 9);
    assert_eq!(late[1], "n0 differs between worker 1 and worker 1: the table is empty");
}

#[test]
fn silent_worker_is_lost_after_its_lease_and_any_message_renews_the_lease() {
    let mut bench = Bench::new(independent(1));
    bench.join(A, 1);
    bench.start(A, 0, 1);
    assert_eq!(bench.core.next_deadline(), Some(Duration::from_secs(5)));
    assert!(bench.pass_time(4).unwrap().is_empty());
    bench.handle(Event::Heartbeat {
        worker: A,
        executing: vec![Executing { node: NodeId(0), attempt: 1, permille: 400 }],
    });
    assert_eq!(bench.core.next_deadline(), Some(Duration::from_secs(9)));
    assert!(bench.pass_time(4).unwrap().is_empty());
    assert_eq!(bench.pass_time(1).unwrap(), ["worker 1 is disconnected", "n0 requeued, 0"]);
}

#[test]
fn run_without_workers_reports_it_repeatedly() {
    let mut bench = Bench::new(independent(1));
    assert_eq!(bench.core.next_deadline(), Some(Duration::from_secs(30)));
    assert_eq!(bench.pass_time(30).unwrap(), ["waiting since 30 s"]);
    assert_eq!(bench.pass_time(31).unwrap(), ["waiting since 61 s"]);
    assert_eq!(bench.core.next_deadline(), Some(Duration::from_secs(91)));
    let error = bench.pass_time(539).unwrap_err();
    assert!(error.to_string().starts_with("no worker connected in 600 s"), "{error}");
}

#[test]
fn run_waits_after_its_last_worker_until_a_new_one_joins() {
    let mut bench = Bench::new(independent(1));
    bench.join(A, 1);
    bench.lose(A, Departure::Lost);
    assert_eq!(bench.pass_time(59).unwrap(), ["waiting since 59 s"]);
    assert_eq!(bench.join(B, 1), ["worker 2 gets 0.2"]);
    bench.lose(B, Departure::Lost);
    assert!(bench.pass_time(1).unwrap().is_empty());
    let error = bench.pass_time(59).unwrap_err();
    assert!(error.to_string().starts_with("all workers were lost, and no other connected in 60 s"), "{error}");
}

#[test]
fn run_does_not_wait_for_workers_while_only_the_coordinator_has_nodes() {
    let mut bench =
        Bench::new(Script { nodes: vec![node("here", vec![], Placement::Coordinator)], ..Script::default() });
    assert_eq!(bench.core.next_deadline(), None);
    let given_up = Event::LocalWorkersGivenUp { last_status: "exit status: 1".into() };
    assert_eq!(bench.handle(given_up), ["run 0.1 here"]);
    bench.handle(finished(Site::Coordinator, 0, 1, 0));
    assert!(bench.core.is_finished());
}

#[test]
fn local_workers_that_keep_dying_end_the_run() {
    let mut bench = Bench::new(independent(1));
    let given_up = Event::LocalWorkersGivenUp { last_status: "signal: 11".into() };
    let error = bench.try_handle(given_up).unwrap_err();
    assert!(error.to_string().contains("keep dying, the last one with signal: 11"), "{error}");
}

#[test]
fn empty_plan_is_finished_at_once() {
    assert!(Bench::new(Script::default()).core.is_finished());
}

#[test]
fn wrong_result_ends_the_run_and_names_gamma_numbers_and_worker() {
    let mut bench = Bench::new(Script { not_verified: true, ..independent(1) });
    bench.join(A, 1);
    bench.join(B, 1);
    bench.start(A, 0, 1);
    let error = bench.try_handle(finished(Site::Worker(A), 0, 1, 7)).unwrap_err();
    let text = error.to_string();
    for part in ["\"n0\"", "from worker 1", "the cost of gamma 2: the output says 0.5, recomputation gives 0.25"] {
        assert!(text.contains(part), "{text}");
    }
    assert_eq!(error.exit_code(), 3);
}

#[test]
fn nodes_of_lower_priority_number_are_assigned_first() {
    let mut planner = independent(4);
    for (spec, priority) in planner.nodes.iter_mut().zip([2, 1, 1, 0]) {
        spec.priority = priority;
    }
    planner.follow_up = Some(NodeSpec { priority: 1, ..node("late", vec![], Placement::Worker) });
    let mut bench = Bench::new(planner);
    assert_eq!(bench.join(A, 1), ["worker 1 gets 3.1", "worker 1 gets 1.1", "worker 1 gets 2.1"]);
    assert_eq!(bench.finish(A, 3, 1, 3), ["worker 1 is thanked for 3.1", "worker 1 gets 0.1"]);
    bench.finish(A, 0, 1, 0);
    // A re-queued node keeps its place in the order.
    bench.lose(A, Departure::Goodbye);
    assert_eq!(bench.join(B, 1), ["worker 2 gets 1.2", "worker 2 gets 2.2", "worker 2 gets 4.2"]);
}

#[test]
fn cancelled_nodes_leave_queue_and_workers_and_do_not_fail() {
    let mut bench = Bench::new(Script { released: vec![NodeId(1), NodeId(3)], ..independent(4) });
    bench.join(A, 1);
    bench.start(A, 1, 1);
    let said = bench.finish(A, 0, 1, 0);
    let cancelled = "failed: cancelled: its output is no longer needed";
    let expected = [
        "worker 1 is thanked for 0.1".to_owned(),
        "worker 1 drops 1.1".to_owned(),
        format!("n1 {cancelled}"),
        format!("n3 {cancelled}"),
    ];
    assert_eq!(said, expected);
    assert_eq!((bench.core.summary().failed_nodes, bench.core.summary().cancelled_nodes), (0, 2));
    bench.finish(A, 2, 1, 2);
    assert!(bench.core.is_finished());
}

#[test]
fn request_for_a_released_blob_is_not_a_violation() {
    let blob = vec![1; 40];
    let hash = BlobHash::of(&blob);
    let nodes = vec![node("n", vec![], Placement::Worker), node("n", vec![Input::Blob(hash)], Placement::Worker)];
    let mut bench = Bench::new(Script {
        nodes,
        blob,
        released: vec![NodeId(1)],
        released_blob: Some(hash),
        follow_up: Some(node("open", vec![], Placement::Worker)),
        ..Script::default()
    });
    bench.join(A, 2);
    bench.finish(A, 0, 1, 0);
    assert_eq!(bench.handle(Event::BlobRequested { worker: A, hash }), ["worker 1 gets nothing"]);
}

#[test]
fn events_name_the_part_of_a_node() {
    let nodes = [0, 7].map(|priority| NodeSpec { priority, ..node("n", vec![], Placement::Worker) }).to_vec();
    let bench = Bench::new(Script { nodes, ..Script::default() });
    assert_eq!([0, 1].map(|node| bench.core.name(NodeId(node)).part), [0, 7]);
}
