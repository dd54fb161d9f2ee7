use super::*;

#[test]
fn draining_worker_returns_nodes_it_has_not_started_and_gets_no_more() {
    let mut bench = Bench::new(independent(4));
    bench.join(A, 1);
    bench.start(A, 0, 1);
    bench.handle(Event::WorkerDrains { worker: A });
    assert_eq!(bench.core.members.get(A).unwrap().leases.len(), 1);
    assert!(bench.handle(Event::WorkerDrains { worker: A }).is_empty(), "said twice");
    assert_eq!(bench.join(B, 1), ["worker 2 gets 1.2", "worker 2 gets 2.2", "worker 2 gets 3.1"]);
    assert_eq!(bench.finish(A, 0, 1, 0), ["worker 1 is thanked for 0.1"]);
    assert!(bench.lose(A, Departure::Goodbye).is_empty());
}

#[test]
fn death_of_a_draining_worker_counts_against_no_node() {
    let mut bench = Bench::new(independent(1));
    for number in 11..20 {
        let worker = WorkerId(number);
        bench.join(worker, 1);
        bench.start(worker, 0, bench.core.look(NodeId(0)).unwrap().attempts);
        bench.handle(Event::WorkerDrains { worker });
        // Its time limit ends before its node does.
        assert_eq!(bench.lose(worker, Departure::Lost), ["n0 requeued, 0"]);
    }
}

#[test]
fn nodes_wait_for_a_new_worker_while_all_others_drain() {
    let mut bench = Bench::new(independent(2));
    bench.join(A, 1);
    bench.start(A, 0, 1);
    bench.handle(Event::WorkerDrains { worker: A });
    bench.live(4000, &[A]);
    bench.finish(A, 0, 1, 0);
    bench.lose(A, Departure::Goodbye);
    assert_eq!(bench.core.next_deadline(), Some(Duration::from_secs(4 + 30)), "somebody is waited for");
    assert_eq!(bench.join(B, 1), ["worker 2 gets 1.2"]);
}

#[test]
fn late_start_of_a_returned_node_is_ignored_and_its_result_accepted() {
    let mut bench = Bench::new(independent(1));
    bench.join(A, 1);
    bench.handle(Event::WorkerDrains { worker: A });
    assert!(bench.start(A, 0, 1).is_empty());
    bench.join(B, 1);
    assert_eq!(bench.finish(A, 0, 1, 0), ["worker 1 is thanked for 0.1", "worker 2 drops 0.2"]);
    assert!(bench.core.is_finished());
}
