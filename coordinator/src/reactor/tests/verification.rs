use super::*;

fn all() -> Policy {
    Policy { verify_fraction: 1.0, ..Policy::default() }
}

#[test]
fn output_is_accepted_when_a_second_worker_computes_the_same() {
    let mut bench = Bench::with(independent(1), all());
    bench.join(A, 1);
    bench.join(B, 1);
    bench.start(A, 0, 1);
    assert_eq!(bench.finish(A, 0, 1, 5), ["worker 1 is thanked for 0.1", "worker 2 gets 0.2"]);
    assert!(bench.planner.completed.is_empty() && !bench.core.is_finished());
    // The first worker sends its output again, which is not a second computation.
    bench.finish(A, 0, 1, 5);
    assert!(!bench.core.is_finished());
    bench.finish(B, 0, 2, 5);
    assert!(bench.core.is_finished());
    assert_eq!(bench.planner.completed, [NodeId(0)]);
    assert_eq!((bench.core.summary().verified_nodes, bench.core.summary().duplicate_results), (1, 0));
}

#[test]
fn outputs_that_differ_end_the_run_and_name_both_workers() {
    let mut bench = Bench::with(independent(1), all());
    bench.join(A, 1);
    bench.join(B, 1);
    bench.finish(A, 0, 1, 5);
    let error = bench.try_handle(finished(Site::Worker(B), 0, 2, 6)).unwrap_err();
    let text = error.to_string();
    assert!(text.contains("two results of test \"n0\" differ"), "{text}");
    assert!(text.contains("from worker 1, output") && text.contains("from worker 2)"), "{text}");
    assert_eq!(error.exit_code(), 3);
    assert!(bench.planner.completed.is_empty(), "neither is believed");
}

#[test]
fn error_after_an_output_is_a_mismatch() {
    let mut bench = Bench::with(independent(1), all());
    bench.join(A, 1);
    bench.join(B, 1);
    bench.finish(A, 0, 1, 5);
    let failure = NodeFailure::new("no memory");
    let failed = Event::Failed { site: Site::Worker(B), node: NodeId(0), attempt: 2, failure };
    let text = bench.try_handle(failed).unwrap_err().to_string();
    assert!(text.contains("the error \"no memory\" from worker 2"), "{text}");
}

#[test]
fn only_worker_verifies_its_own_output() {
    let mut bench = Bench::with(independent(2), all());
    bench.join(A, 1);
    assert_eq!(bench.finish(A, 0, 1, 5), ["worker 1 is thanked for 0.1", "worker 1 gets 0.2"]);
    bench.finish(A, 0, 2, 5);
    // If there is another worker, the output waits for it, whether or not it is busy.
    bench.join(B, 1);
    let held: Vec<u64> = bench.core.members.get(B).unwrap().leases.keys().map(|node| node.0).collect();
    let (first, second) = if held.is_empty() { (A, B) } else { (B, A) };
    let said = bench.finish(first, 1, bench.core.look(NodeId(1)).unwrap().attempts, 1);
    assert!(said[1].starts_with(&format!("{second} gets 1.")), "{said:?}");
}

#[test]
fn dead_verifier_is_replaced_and_the_output_of_a_suspect_is_not_verified() {
    let mut bench = Bench::with(independent(1), all());
    bench.join(A, 1);
    bench.finish(A, 0, 1, 5);
    bench.lose(A, Departure::Goodbye);
    for number in 11..=12 {
        let worker = WorkerId(number);
        assert_eq!(bench.join(worker, 1).len(), 1);
        bench.start(worker, 0, bench.core.look(NodeId(0)).unwrap().attempts);
        assert!(!bench.core.is_finished());
        bench.lose(worker, Departure::Lost);
    }
    assert!(bench.core.is_finished());
    assert_eq!((&bench.planner.completed[..], bench.core.summary().verified_nodes), (&[NodeId(0)][..], 0));
}

#[test]
fn verified_share_is_that_of_the_policy_and_the_same_in_every_run() {
    let chosen = |fraction: f64, verify_seed: u64| {
        let nodes = (0..2000_u32)
            .map(|index| NodeSpec { parameters: index.to_le_bytes().to_vec(), ..node("n", vec![], Placement::Worker) });
        let policy = Policy { verify_fraction: fraction, verify_seed, ..Policy::default() };
        let bench = Bench::with(Script { nodes: nodes.collect(), ..Script::default() }, policy);
        bench.core.records.iter().map(|record| record.is_verified).collect::<Vec<_>>()
    };
    let count = |chosen: &[bool]| chosen.iter().filter(|is_chosen| **is_chosen).count();
    assert_eq!((count(&chosen(0.0, 0)), count(&chosen(1.0, 0))), (0, 2000));
    let tenth = chosen(0.1, 0);
    // Five standard deviations of a binomial with 2000 draws at 0.1 are 67.
    assert!((133..267).contains(&count(&tenth)), "{}", count(&tenth));
    assert_eq!(tenth, chosen(0.1, 0));
    assert_ne!(tenth, chosen(0.1, 1));
}

#[test]
fn outputs_that_the_planner_checks_are_not_verified() {
    let mut bench = Bench::with(Script { checks_itself: true, ..independent(1) }, all());
    bench.join(A, 1);
    bench.finish(A, 0, 1, 5);
    assert!(bench.core.is_finished());
}

#[test]
fn one_computation_returned_under_two_leases_does_not_verify_itself() {
    let mut bench = Bench::with(independent(1), all());
    bench.join_as(A, 1, process(7));
    bench.start(A, 0, 1);
    // It has finished when its connection becomes silent, and reconnects with the answer.
    bench.lose(A, Departure::Silent);
    assert_eq!(bench.join_as(B, 1, process(7)), ["worker 2 gets 0.2"]);
    bench.finish(B, 0, 1, 5);
    bench.finish(B, 0, 2, 5);
    assert!(!bench.core.is_finished());
    assert_eq!(bench.core.summary().verified_nodes, 0);
    // Computed again, which begins with a report.
    let attempt = bench.core.look(NodeId(0)).unwrap().attempts;
    bench.start(B, 0, attempt);
    bench.finish(B, 0, attempt, 5);
    assert!(bench.core.is_finished());
    assert_eq!(bench.core.summary().verified_nodes, 1);
}

#[test]
fn reconnected_process_does_not_verify_its_own_output() {
    let mut bench = Bench::with(independent(1), all());
    bench.join_as(A, 1, process(7));
    bench.start(A, 0, 1);
    bench.finish(A, 0, 1, 5);
    bench.lose(A, Departure::Silent);
    bench.join_as(B, 1, process(8));
    bench.lose(B, Departure::Goodbye);
    bench.join_as(C, 1, process(7));
    bench.join_as(WorkerId(4), 1, process(9));
    let origin_holds = bench.core.members.get(C).unwrap().leases.len();
    let other_holds = bench.core.members.get(WorkerId(4)).unwrap().leases.len();
    assert_eq!((origin_holds, other_holds), (1, 0), "the only one there began");
    bench.lose(C, Departure::Silent);
    bench.join_as(WorkerId(5), 1, process(7));
    assert_eq!(bench.core.members.get(WorkerId(4)).unwrap().leases.len(), 1);
}
