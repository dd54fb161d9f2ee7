use super::*;

/// Of four nodes, three have taken two seconds each. The first one is still running on worker 1, and worker 2 is idle.
fn one_slow() -> Bench {
    let mut bench = Bench::new(independent(4));
    bench.join(A, 1);
    bench.join(B, 1);
    bench.start(A, 0, 1);
    while bench.planner.completed.len() < 3 {
        let (node, held) = bench.core.members.get(B).unwrap().leases.iter().next().map(|(n, h)| (*n, *h)).unwrap();
        bench.start(B, node.0, held.attempt);
        bench.live(2000, &[A, B]);
        bench.finish(B, node.0, held.attempt, 1);
    }
    bench
}

#[test]
fn slow_node_is_also_assigned_to_an_idle_worker() {
    let mut bench = one_slow();
    // Twice the median is four seconds, but no node is slow before five. Six have passed.
    assert_eq!(bench.core.summary().speculated_nodes, 1);
    assert_eq!(bench.core.look(NodeId(0)).unwrap().holders, [A, B]);
    bench.start(B, 0, 2);
    let first = bench.finish(B, 0, 2, 7);
    assert_eq!(first, ["worker 2 is thanked for 0.2", "worker 1 drops 0.1"]);
    assert!(bench.core.is_finished());
    // The slow worker answers too.
    assert_eq!(bench.finish(A, 0, 1, 7), ["worker 1 is thanked for 0.1"]);
    assert_eq!(bench.core.summary().duplicate_results, 1);
    let error = bench.try_handle(finished(Site::Worker(A), 0, 1, 8)).unwrap_err();
    assert!(matches!(error, Stop::ResultsDiffer { .. }), "{error}");
}

#[test]
fn reactor_is_woken_when_a_node_becomes_slow() {
    let mut bench = Bench::new(independent(2));
    bench.join(A, 1);
    bench.join(B, 1);
    bench.start(A, 0, 1);
    bench.start(B, 1, 2);
    bench.live(3000, &[A, B]);
    bench.finish(B, 1, 2, 1);
    // Heartbeats arrive. After six seconds the node has taken twice as long as the other one.
    bench.live(2500, &[A, B]);
    assert_eq!(bench.core.next_deadline(), Some(Duration::from_secs(6)));
    assert_eq!(bench.live(500, &[A, B]), ["worker 2 gets 0.2", "n0 is slow, worker 2 helps"]);
    assert!(bench.live(4000, &[A, B]).is_empty(), "two are enough");
}

#[test]
fn speculation_follows_the_policy_and_starts_late_without_known_durations() {
    let never = Policy { speculation: Speculation { factor: None, ..Speculation::default() }, ..Policy::default() };
    for (policy, done) in [(Policy::default(), 0), (never, 1)] {
        let mut bench = Bench::with(independent(1 + done), policy);
        bench.join(A, 1);
        bench.join(B, 1);
        bench.start(A, 0, 1);
        if done > 0 {
            bench.start(B, 1, 2);
            bench.live(1000, &[A, B]);
            bench.finish(B, 1, 2, 1);
        }
        for _ in 0..14 {
            assert!(bench.live(4000, &[A, B]).is_empty());
        }
        let after_a_minute = bench.live(4000, &[A, B]);
        assert_eq!(after_a_minute.is_empty(), done > 0, "{after_a_minute:?}");
    }
}

#[test]
fn speculative_worker_that_leaves_is_replaced_and_the_first_keeps_its_lease() {
    let mut bench = one_slow();
    assert!(bench.lose(B, Departure::Lost).is_empty(), "worker 1 still has the node");
    assert_eq!(bench.join(C, 1), ["worker 3 gets 0.3", "n0 is slow, worker 3 helps"]);
    // Worker 1 leaves; worker 3 continues.
    assert!(bench.lose(A, Departure::Silent).is_empty());
    bench.start(C, 0, 3);
    bench.finish(C, 0, 3, 1);
    assert!(bench.core.is_finished());
}

#[test]
fn node_that_its_worker_does_not_start_is_speculated() {
    let mut bench = Bench::new(independent(1));
    bench.join(A, 1);
    bench.join(B, 1);
    assert!(bench.live(4000, &[A, B]).is_empty());
    assert_eq!(bench.core.next_deadline(), Some(Duration::from_secs(5)));
    assert_eq!(bench.live(1000, &[A, B]), ["worker 2 gets 0.2", "n0 is slow, worker 2 helps"]);
    assert!(bench.live(4000, &[A, B]).is_empty());
}

#[test]
fn suspect_is_never_run_twice_at_a_time() {
    let mut bench = one_slow();
    bench.start(B, 0, 2);
    // Two deaths, while others may still run it.
    assert_eq!(bench.lose(B, Departure::Lost).len(), 0);
    assert_eq!(bench.join(C, 1)[0], "worker 3 gets 0.3");
    bench.start(C, 0, 3);
    assert_eq!(bench.lose(C, Departure::Lost), ["n0 suspected, 2"]);
    assert!(bench.join(B, 1).is_empty());
    assert!(bench.live(4000, &[A, B]).is_empty());
    bench.finish(A, 0, 1, 0);
    assert!(bench.core.is_finished());
}
