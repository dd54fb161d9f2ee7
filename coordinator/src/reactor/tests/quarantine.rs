use super::*;

/// Worker `number` joins, executes node 0 and dies of it.
fn die(bench: &mut Bench, number: u64) -> Vec<String> {
    let worker = WorkerId(number);
    bench.join(worker, 2);
    let attempt = bench.core.look(NodeId(0)).unwrap().attempts;
    bench.start(worker, 0, attempt);
    bench.lose(worker, Departure::Lost)
}

/// A node that has killed two workers.
fn suspected(planner: Script) -> Bench {
    let mut bench = Bench::new(planner);
    assert_eq!(die(&mut bench, 11)[0], "n0 requeued, 1");
    let second = die(&mut bench, 12);
    assert_eq!(second[..2], ["n0 suspected, 2", "n0 requeued, 2"]);
    bench
}

#[test]
fn node_that_kills_its_workers_runs_alone_and_fails_by_name_after_three_more_deaths() {
    let mut bench = suspected(independent(3));
    for crash in 1..=2 {
        let worker = WorkerId(20 + crash);
        let attempt = u32::try_from(crash).unwrap() + 2;
        assert_eq!(bench.join(worker, 4), [format!("{worker} gets 0.{attempt}")], "and nothing else");
        bench.start(worker, 0, attempt);
        assert_eq!(bench.lose(worker, Departure::Lost)[0], format!("n0 requeued, {}", crash + 2));
    }
    bench.join(A, 2);
    bench.start(A, 0, 5);
    let error = bench.try_handle(Event::WorkerLeft { worker: A, departure: Departure::Lost }).unwrap_err();
    let message = error.to_string();
    assert!(message.starts_with("test \"n0\" failed: 3 worker processes died while they executed it"), "{message}");
    assert_eq!(error.exit_code(), 3);
    assert_eq!(bench.planner.failed, [(NodeId(0), FailureReason::Crashed { crashes: 3 })]);
}

#[test]
fn failed_suspect_fails_alone_and_the_others_complete() {
    let mut bench = suspected(Script { tolerates_failures: true, ..independent(2) });
    for number in 20..23 {
        die(&mut bench, number);
    }
    bench.join(A, 1);
    bench.finish(A, 1, bench.core.look(NodeId(1)).unwrap().attempts, 1);
    assert!(bench.core.is_finished());
    assert_eq!((bench.core.summary().completed_nodes, bench.core.summary().failed_nodes), (1, 1));
}

#[test]
fn harmless_suspect_completes_alone_and_its_worker_continues() {
    let mut bench = suspected(independent(2));
    assert_eq!(bench.join(A, 1), ["worker 1 gets 0.3"]);
    bench.start(A, 0, 3);
    let attempt = bench.core.look(NodeId(1)).unwrap().attempts + 1;
    assert_eq!(
        bench.finish(A, 0, 3, 0),
        ["worker 1 is thanked for 0.3".to_owned(), format!("worker 1 gets 1.{attempt}")]
    );
}

#[test]
fn only_deaths_alone_and_while_executing_count_against_a_suspect() {
    let mut bench = suspected(independent(1));
    bench.join(A, 1);
    // While it received the node: the death is not counted.
    assert_eq!(bench.lose(A, Departure::Lost), ["n0 requeued, 2"]);
    for departure in [Departure::Silent, Departure::Goodbye, Departure::TooSlow] {
        bench.join(A, 1);
        bench.start(A, 0, bench.core.look(NodeId(0)).unwrap().attempts);
        assert_eq!(bench.lose(A, departure), ["n0 requeued, 2"]);
    }
    assert_eq!(bench.core.look(NodeId(0)).unwrap().deaths.alone, 0);
}

#[test]
fn nodes_that_shared_a_worker_with_a_killer_do_not_fail() {
    let mut bench = Bench::new(Script { tolerates_failures: true, ..independent(2) });
    for number in 11..=12 {
        let worker = WorkerId(number);
        bench.join(worker, 2);
        for node in 0..2 {
            bench.start(worker, node, u32::try_from(number).unwrap() - 10);
        }
        bench.lose(worker, Departure::Lost);
    }
    // Each gets a worker without other nodes, however many threads that has.
    assert_eq!(bench.join(A, 2), ["worker 1 gets 0.3"]);
    assert_eq!(bench.join(B, 2), ["worker 2 gets 1.3"]);
    bench.start(A, 0, 3);
    bench.start(B, 1, 3);
    bench.finish(B, 1, 3, 1);
    bench.lose(A, Departure::Lost);
    for number in 21..=22 {
        die(&mut bench, number);
    }
    assert!(bench.core.is_finished());
    assert_eq!((&bench.planner.completed[..], bench.planner.failed.len()), (&[NodeId(1)][..], 1));
}

/// Worker 1 has executed something, and worker 2 has died of a node that had killed another worker before. Returns that node.
fn suspected_beside_a_worker(nodes: usize) -> (Bench, NodeId) {
    let mut bench = Bench::new(independent(nodes));
    bench.join(B, 1);
    bench.join(A, 1);
    let first = |bench: &Bench, worker| {
        let leases = &bench.core.members.get(worker).unwrap().leases;
        leases.iter().next().map(|(node, held)| (*node, held.attempt)).unwrap()
    };
    let (node, attempt) = first(&bench, A);
    bench.start(A, node.0, attempt);
    bench.finish(A, node.0, attempt, 1);
    let (suspect, attempt) = first(&bench, B);
    bench.core.record(suspect).unwrap().deaths.in_company = 1;
    bench.start(B, suspect.0, attempt);
    assert!(bench.lose(B, Departure::Lost).contains(&format!("n{} suspected, 2", suspect.0)));
    (bench, suspect)
}

#[test]
fn suspect_gets_a_fresh_worker_at_once_and_an_idle_one_after_a_delay() {
    let (mut bench, suspect) = suspected_beside_a_worker(2);
    assert!(bench.core.members.get(A).unwrap().leases.is_empty());
    assert!(bench.live(1999, &[A]).is_empty());
    assert_eq!(bench.core.next_deadline(), Some(bench.now + Duration::from_millis(1)));
    assert_eq!(bench.live(1, &[A]), [format!("worker 1 gets {}.2", suspect.0)]);
    let (mut bench, suspect) = suspected_beside_a_worker(2);
    assert!(bench.live(1000, &[A]).is_empty());
    assert_eq!(bench.join(C, 1), [format!("worker 3 gets {}.2", suspect.0)]);
}

#[test]
fn without_a_fresh_or_idle_worker_one_is_cleared_for_the_suspect() {
    let (mut bench, suspect) = suspected_beside_a_worker(6);
    let leases = &bench.core.members.get(A).unwrap().leases;
    assert_eq!(leases.len(), 3);
    let (busy_with, attempt) = leases.iter().next().map(|(node, held)| (*node, held.attempt)).unwrap();
    bench.start(A, busy_with.0, attempt);
    assert!(bench.live(1999, &[A]).is_empty(), "it waits for a fresh one");
    let cleared = bench.live(1, &[A]);
    assert!(cleared.iter().all(|said| said.starts_with("worker 1 drops")) && cleared.len() == 2, "{cleared:?}");
    let alone = bench.finish(A, busy_with.0, attempt, 1);
    assert_eq!(alone[1..], [format!("worker 1 gets {}.2", suspect.0)]);
    bench.start(A, suspect.0, 2);
    let after = bench.finish(A, suspect.0, 2, 0);
    assert_eq!(after.len(), 4, "thanks, and three others: {after:?}");
}

#[test]
fn worker_being_cleared_continues_when_a_fresh_one_joins() {
    let (mut bench, suspect) = suspected_beside_a_worker(6);
    let (busy_with, held) = bench.core.members.get(A).unwrap().leases.iter().next().map(|(n, h)| (*n, *h)).unwrap();
    bench.start(A, busy_with.0, held.attempt);
    assert_eq!(bench.live(2000, &[A]).len(), 2);
    let fresh = bench.join(C, 1);
    assert_eq!(fresh[0], format!("worker 3 gets {}.2", suspect.0));
    assert_eq!(fresh[1..].iter().filter(|said| said.starts_with("worker 1 gets")).count(), 2, "{fresh:?}");
}

#[test]
fn deaths_of_a_suspects_workers_count_less_while_idle_workers_die_too() {
    let mut bench = suspected(independent(1));
    let mut deaths = 0;
    while bench.planner.failed.is_empty() {
        bench.join(A, 1);
        bench.join(B, 1);
        bench.start(A, 0, bench.core.look(NodeId(0)).unwrap().attempts);
        bench.lose(B, Departure::Lost);
        let _ = bench.try_handle(Event::WorkerLeft { worker: A, departure: Departure::Lost });
        deaths += 1;
        assert!(deaths < 99, "it fails in the end");
    }
    // Three are counted, and ten times as many were not.
    assert_eq!(deaths, 33);
}

#[test]
fn node_whose_workers_are_lost_repeatedly_backs_off() {
    let mut bench = Bench::new(independent(1));
    let mut delays = Vec::new();
    for _ in 0..9 {
        bench.join(A, 1);
        let before = bench.now;
        while bench.core.members.get(A).unwrap().leases.is_empty() {
            bench.now = bench.core.next_deadline().unwrap();
            bench.handle(Event::Heartbeat { worker: A, executing: vec![] });
        }
        delays.push((bench.now - before).as_millis());
        bench.start(A, 0, bench.core.look(NodeId(0)).unwrap().attempts);
        bench.lose(A, Departure::Silent);
    }
    assert_eq!(delays, [0, 0, 100, 200, 400, 800, 1600, 3200, 5000]);
}

#[test]
fn orderly_end_of_a_worker_does_not_delay_its_nodes() {
    let mut bench = Bench::new(independent(1));
    for _ in 0..9 {
        assert_eq!(bench.join(A, 1).len(), 1);
        bench.lose(A, Departure::Goodbye);
    }
}
