use super::*;

/// Worker 1 with one thread has finished the first ten nodes, each in this time: eight establish the duration of the kind, and
/// two were given out before.
fn practised(nodes: usize, took: Duration) -> Bench {
    let mut bench = Bench::new(independent(nodes));
    bench.join(A, 1);
    for node in 0..10 {
        bench.start(A, node, 1);
        bench.now += took;
        bench.finish(A, node, 1, 0);
    }
    bench
}

#[test]
fn one_short_node_does_not_make_its_kind_short() {
    let mut bench = Bench::new(independent(1000));
    bench.join(A, 1);
    for node in 0..7 {
        bench.start(A, node, 1);
        bench.now += Duration::from_micros(50);
        bench.finish(A, node, 1, 0);
        assert_eq!(held(&bench, A), 3);
    }
}

#[test]
fn late_report_of_a_node_counts_with_its_full_duration() {
    let mut bench = Bench::new(independent(1000));
    bench.join(A, 1);
    for node in 0..20 {
        // The reactor was busy, so it processes begin and end one after the other.
        let (began, ended) = (bench.now, bench.now + Duration::from_secs(2));
        bench.now += Duration::from_secs(3);
        let start = Event::Started { worker: A, node: NodeId(node), attempt: 1 };
        for (arrived, event) in [(began, start), (ended, finished(Site::Worker(A), node, 1, 0))] {
            let times = (arrived, bench.now);
            handle_arrived(&mut bench.core, &mut bench.planner, event, times, &mut bench.outbox).unwrap();
        }
        let took = bench.outbox.take().into_iter().find_map(|action| match action {
            Action::Tell(RunEvent::NodeFinished { elapsed, .. }) => Some(elapsed),
            _ => None,
        });
        assert_eq!(took, Some(Duration::from_secs(2)));
        assert_eq!(held(&bench, A), 3);
    }
}

fn held(bench: &Bench, worker: WorkerId) -> usize {
    bench.core.members.get(worker).unwrap().leases.len()
}

#[test]
fn short_nodes_are_assigned_in_large_groups_and_long_ones_in_small() {
    let bench = practised(1000, Duration::from_micros(50));
    assert_eq!(held(&bench, A), 200, "10 ms of work");
    let bench = practised(1000, Duration::from_micros(1));
    assert_eq!(held(&bench, A), 500, "and no more, however short they are");
    assert_eq!(held(&practised(1000, Duration::from_millis(5)), A), 3);
}

#[test]
fn short_nodes_are_moved_only_from_a_stalled_worker() {
    let mut bench = practised(50, Duration::from_micros(50));
    bench.start(A, 10, 1);
    assert_eq!(held(&bench, A), 40);
    assert!(bench.join(B, 1).is_empty());
    let due = bench.now + Duration::from_millis(50);
    assert_eq!(bench.core.next_deadline(), Some(due));
    bench.now = due;
    assert_eq!(bench.handle(Event::DeadlinePassed), ["worker 1 drops 49.1", "worker 2 gets 49.2"]);
}
