use super::*;

fn failed(worker: WorkerId, node: u64, attempt: u32) -> Event {
    let failure = NodeFailure::new("no memory");
    Event::Failed { site: Site::Worker(worker), node: NodeId(node), attempt, failure }
}

/// Node 0 was executed by worker 1, whose connection broke, and is executed by worker 2.
fn executed_twice() -> Bench {
    let mut bench = Bench::new(Script { tolerates_failures: true, ..independent(2) });
    bench.join(A, 1);
    bench.start(A, 0, 1);
    bench.lose(A, Departure::Silent);
    bench.join(B, 1);
    bench.start(B, 0, 2);
    bench.join(C, 1);
    bench
}

#[test]
fn error_after_an_output_is_reported_with_both_sites() {
    let mut bench = executed_twice();
    bench.finish(B, 0, 2, 5);
    let said = bench.handle(failed(C, 0, 1));
    assert_eq!(said[1], "n0 differs between worker 2 and worker 3: no memory");
    assert_eq!(bench.planner.completed, [NodeId(0)], "what came first counts");
}

#[test]
fn output_after_an_error_is_reported_with_both_sites() {
    let mut bench = executed_twice();
    bench.handle(failed(B, 0, 2));
    let said = bench.finish(C, 0, 1, 5);
    assert_eq!(said[1], "n0 differs between worker 2 and worker 3: no memory");
    assert_eq!((bench.planner.completed.len(), bench.planner.failed.len()), (0, 1));
}

#[test]
fn answer_of_a_cancelled_node_is_ignored_and_coordinator_nodes_are_cancelled_at_once() {
    let released = vec![NodeId(1)];
    let mut planner = Script { released, ..independent(1) };
    planner.nodes.push(node("here", vec![], Placement::Coordinator));
    planner.follow_up = Some(node("open", vec![], Placement::Worker));
    let mut bench = Bench::new(planner);
    bench.join(A, 1);
    let said = bench.finish(A, 0, 1, 0);
    assert!(said.contains(&"stop 1 here".to_owned()), "{said:?}");
    let stopped =
        Event::Failed { site: Site::Coordinator, node: NodeId(1), attempt: 1, failure: NodeFailure::Cancelled };
    assert!(bench.handle(stopped).is_empty());
}
