use super::*;

/// Worker 1 with one thread, which has done the first five nodes, each in so long.
fn practised(nodes: usize, took: Duration) -> Bench {
    let mut bench = Bench::new(independent(nodes));
    bench.join(A, 1);
    for node in 0..5 {
        bench.start(A, node, 1);
        bench.now += took;
        bench.finish(A, node, 1, 0);
    }
    bench
}

fn held(bench: &Bench, worker: WorkerId) -> usize {
    bench.core.members.get(worker).unwrap().leases.len()
}

#[test]
fn short_nodes_are_given_out_many_at_a_time_and_long_ones_few() {
    let bench = practised(1000, Duration::from_micros(50));
    assert_eq!(held(&bench, A), 200, "10 ms of work");
    let bench = practised(1000, Duration::from_micros(1));
    assert_eq!(held(&bench, A), 500, "and no more, however short they are");
    assert_eq!(held(&practised(1000, Duration::from_millis(5)), A), 3);
}

#[test]
fn short_nodes_are_moved_only_from_a_worker_that_does_not_get_on() {
    let mut bench = practised(50, Duration::from_micros(50));
    bench.start(A, 5, 1);
    assert_eq!(held(&bench, A), 45);
    assert!(bench.join(B, 1).is_empty());
    let due = bench.now + Duration::from_millis(50);
    assert_eq!(bench.core.next_deadline(), Some(due));
    bench.now = due;
    assert_eq!(bench.handle(Event::DeadlinePassed), ["worker 1 drops 49.1", "worker 2 gets 49.2"]);
}
