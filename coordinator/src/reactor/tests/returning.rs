//! Connections that break without a death: the process reconnects under another number.

use super::*;

const LONG: u64 = 7;

fn executes(bench: &mut Bench, worker: WorkerId, node: u64, attempt: u32) -> Vec<String> {
    let executing = vec![Executing { node: NodeId(node), attempt, permille: 0 }];
    bench.handle(Event::Heartbeat { worker, executing })
}

fn deaths(bench: &Bench, node: u64) -> u32 {
    bench.core.look(NodeId(node)).unwrap().deaths.total()
}

#[test]
fn repeated_connection_resets_fail_no_node() {
    let mut bench = Bench::new(independent(1));
    let mut worker = WorkerId(1);
    bench.join_as(worker, 1, process(LONG));
    bench.start(worker, 0, 1);
    for reset in 2..20 {
        bench.now += Duration::from_secs(20);
        assert_eq!(bench.lose(worker, Departure::Lost), ["n0 requeued, 1"]);
        assert_eq!(deaths(&bench, 0), 1);
        worker = WorkerId(reset);
        let attempt = u32::try_from(reset).unwrap();
        let mut said = bench.join_as(worker, 1, process(LONG));
        // After a few losses a node would wait before it is queued, but this one is being executed.
        if said.is_empty() {
            said = executes(&mut bench, worker, 0, attempt - 1);
        }
        assert_eq!(said, [format!("{worker} gets 0.{attempt}")]);
        bench.start(worker, 0, attempt);
        assert_eq!(deaths(&bench, 0), 0);
    }
    bench.finish(worker, 0, 19, 1);
    assert!(bench.core.is_finished() && bench.planner.failed.is_empty());
    assert_eq!(bench.core.summary().suspected_nodes, 0);
}

#[test]
fn network_outage_of_all_workers_makes_no_suspects_once_they_reconnect() {
    let mut bench = Bench::new(independent(4));
    for number in 1..=2 {
        bench.join_as(WorkerId(number), 2, process(number));
    }
    // Two nodes have one death each already, and are suspects for now.
    for node in 0..4 {
        bench.core.record(NodeId(node)).unwrap().deaths.in_company = 1;
        let holder = bench.core.look(NodeId(node)).unwrap().holders[0];
        bench.start(holder, node, bench.core.look(NodeId(node)).unwrap().attempts);
    }
    for number in 1..=2 {
        bench.lose(WorkerId(number), Departure::Lost);
    }
    assert!((0..4).all(|node| bench.core.is_suspect(NodeId(node))));
    for number in 1..=2 {
        bench.join_as(WorkerId(10 + number), 2, process(number));
    }
    assert!((0..4).all(|node| !bench.core.is_suspect(NodeId(node)) && deaths(&bench, node) == 1));
    assert!(bench.core.unexplained.is_empty());
    let held = |worker| bench.core.members.get(WorkerId(worker)).unwrap().leases.len();
    assert_eq!(held(11) + held(12), 4, "nobody waits to be alone");
}

#[test]
fn process_that_does_not_reconnect_counts_as_dead_and_one_that_executed_a_node_is_not_fresh() {
    let mut bench = Bench::new(independent(2));
    bench.join_as(A, 1, process(LONG));
    bench.start(A, 0, 1);
    bench.lose(A, Departure::Lost);
    bench.join_as(B, 1, process(8));
    assert_eq!(deaths(&bench, 0), 1);
    bench.start(B, 0, 2);
    bench.lose(B, Departure::Lost);
    assert!(bench.core.is_suspect(NodeId(0)));
    // It reconnects, and a death is subtracted: the node is no longer a suspect.
    bench.join_as(C, 1, process(8));
    assert_eq!(deaths(&bench, 0), 1);
    bench.core.record(NodeId(0)).unwrap().deaths.in_company = 2;
    assert_eq!(bench.core.members.fresh(), None);
}

#[test]
fn process_that_reconnects_before_its_loss_is_noticed_has_one_membership() {
    let mut bench = Bench::new(independent(1));
    bench.join_as(A, 1, process(LONG));
    bench.start(A, 0, 1);
    let said = bench.join_as(B, 1, process(LONG));
    assert_eq!(said, ["worker 1 is disconnected", "n0 requeued, 0", "worker 2 gets 0.2"]);
    assert!(bench.core.members.get(A).is_none());
}

#[test]
fn reconnected_worker_keeps_the_nodes_it_still_executes() {
    let mut bench = Bench::new(independent(4));
    bench.join_as(A, 1, process(LONG));
    bench.start(A, 0, 1);
    bench.lose(A, Departure::Silent);
    // Node 0 goes to worker 2, which has not begun it.
    bench.join(B, 1);
    bench.join_as(C, 1, process(LONG));
    let attempt = bench.core.look(NodeId(0)).unwrap().attempts;
    let holder = bench.core.look(NodeId(0)).unwrap().holders[0];
    assert_eq!(holder, B);
    let said = executes(&mut bench, C, 0, 1);
    let next = attempt + 1;
    assert_eq!(said[..2], [format!("worker 2 drops 0.{attempt}"), format!("worker 3 gets 0.{next}")]);
    let member = bench.core.members.get(C).unwrap();
    assert!(!member.waiting.contains(&NodeId(0)), "its thread is taken");
    assert!(!member.has_too_much(2));
    // Reported again under the old lease, before it has read the new one.
    assert!(executes(&mut bench, C, 0, 1).is_empty());
}

#[test]
fn node_of_a_reconnected_worker_runs_beside_one_other_execution_but_not_two() {
    let mut bench = Bench::new(independent(1));
    bench.join_as(A, 1, process(LONG));
    bench.start(A, 0, 1);
    bench.lose(A, Departure::Silent);
    bench.join(B, 1);
    bench.start(B, 0, 2);
    bench.join_as(C, 1, process(LONG));
    assert_eq!(executes(&mut bench, C, 0, 1), ["worker 3 gets 0.3"]);
    assert_eq!(bench.core.look(NodeId(0)).unwrap().holders, [B, C]);
    bench.lose(C, Departure::Silent);
    let d = WorkerId(4);
    bench.join(d, 1);
    bench.core.give(d, NodeId(0), 2, bench.now);
    bench.handle(Event::Started { worker: d, node: NodeId(0), attempt: 2 });
    let e = WorkerId(5);
    bench.join_as(e, 1, process(LONG));
    assert_eq!(executes(&mut bench, e, 0, 3), ["worker 5 drops 0.3"]);
}

#[test]
fn node_that_a_reconnected_worker_executes_needlessly_is_cancelled() {
    let mut bench = Bench::new(independent(2));
    bench.join_as(A, 1, process(LONG));
    bench.start(A, 0, 1);
    bench.lose(A, Departure::Silent);
    bench.join(B, 1);
    bench.finish(B, 0, 2, 5);
    bench.join_as(C, 1, process(LONG));
    assert_eq!(executes(&mut bench, C, 0, 1), ["worker 3 drops 0.1"]);
    // The cancellation of what was taken back on this connection has been sent.
    let attempt = bench.core.look(NodeId(1)).unwrap().attempts;
    bench.finish(C, 1, attempt, 1);
    assert!(executes(&mut bench, C, 1, attempt).is_empty());
}
