//! False workers that have the access file: they are disconnected, and their nodes run elsewhere.

use super::{PROGRAM, run_at_the_gate, run_within, worker};
use lookalike::graph::BlobHash;
use lookalike::protocol::{
    FailureKind, FrameTag, LeaseName, PART_BYTES, ToCoordinator, ToWorker, encode_message, frame_header,
};
use lookalike_coordinator::events::{Departure, RunEvent};
use lookalike_coordinator::limits::Limits;
use lookalike_coordinator::policy::Policy;
use lookalike_coordinator::reactor::Stop;
use lookalike_coordinator::runner::{RunError, RunnerOptions};
use lookalike_tests::cluster::{Cluster, options, policy};
use lookalike_tests::gate::Gate;
use lookalike_tests::plan::{Leaves, TestPlanner};
use lookalike_tests::raw_peer::{FALSE_WORKER, TlsClient, hear, join, read_to_the_end, say, say_frame};
use std::io::Write;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

/// How the membership of the false worker ended.
fn departure_of_false_worker(cluster: &Cluster) -> Departure {
    let false_worker = cluster.wait_for(|event| match event {
        RunEvent::WorkerJoined { worker, process: FALSE_WORKER, .. } => Some(*worker),
        _ => None,
    });
    cluster.wait_for(|event| match event {
        RunEvent::WorkerLeft { worker, departure } if *worker == false_worker => Some(departure.clone()),
        _ => None,
    })
}

/// Asserts that a worker that does this is disconnected and that the run continues.
#[track_caller]
fn assert_disconnected(limits: Limits, act: impl FnOnce(&mut TlsClient)) {
    let gate = Gate::new();
    let cluster = run_within(&gate, 1, limits);
    let waiting = gate.next();
    let mut stream = join(&cluster.access(), 1);
    act(&mut stream);
    let departure = departure_of_false_worker(&cluster);
    assert!(matches!(departure, Departure::Violation(_)), "{departure:?}");
    let _ = read_to_the_end(stream);
    waiting.release();
    assert!(cluster.finish().0.is_some());
}

#[test]
fn malformed_frames_end_the_membership() {
    let oversized = [255, 255, 255, 127, 0].to_vec();
    let unknown_tag = [1, 0, 0, 0, 9].to_vec();
    let no_message = [3, 0, 0, 0, 0, 99, 99].to_vec();
    let part_of_nothing = [2, 0, 0, 0, 1, 0].to_vec();
    for frame in [oversized, unknown_tag, no_message, part_of_nothing] {
        assert_disconnected(Limits::default(), |stream| stream.write_all(&frame).unwrap());
    }
}

#[test]
fn frame_beyond_the_coordinators_limit_is_refused_by_its_header() {
    // A frame of 5000 bytes, of which only the header is sent.
    let limits = Limits { frame_bytes: 4096, ..Limits::default() };
    assert_disconnected(limits, |stream| stream.write_all(&[0x88, 0x13, 0, 0, 0]).unwrap());
}

#[test]
fn unrequested_answers_and_false_hashes_end_the_membership() {
    let lease = LeaseName { node: 0, attempt: 9, epoch: 1 };
    let never_asked = ToCoordinator::Failed { lease, kind: FailureKind::Application, message: "failed".into() };
    let false_hash = ToCoordinator::Finished { lease, hash: [1; 32], length: 0 };
    let too_long = ToCoordinator::Finished { lease, hash: [1; 32], length: u64::MAX };
    // Refused before its first byte has arrived.
    let large_and_never_asked = ToCoordinator::Finished { lease, hash: [1; 32], length: 100 << 20 };
    for message in [never_asked, false_hash, too_long, large_and_never_asked] {
        assert_disconnected(Limits::default(), |stream| say(stream, &message));
    }
}

/// A late request of an honest worker looks the same, so the worker stays a member.
#[test]
fn blobs_that_no_lease_of_the_worker_reads_are_not_sent() {
    let gate = Gate::new();
    let cluster = run_at_the_gate(&gate);
    let waiting = gate.next();
    let mut false_worker = join(&cluster.access(), 1);
    // The second is the input of the node at the gate: it exists, but this worker was not assigned the node.
    for hash in [[1; 32], BlobHash::of(&[]).0] {
        say(&mut false_worker, &ToCoordinator::Fetch { hash });
    }
    let mut heartbeats = 0;
    hear(&mut false_worker, |message| {
        assert!(!matches!(message, ToWorker::Blob { .. }), "{message:?}");
        heartbeats += usize::from(matches!(message, ToWorker::Heartbeat));
        (heartbeats == 3).then_some(())
    });
    waiting.release();
    assert!(cluster.finish().0.is_some());
    let _ = read_to_the_end(false_worker);
}

#[test]
fn truncated_frame_ends_only_its_connection() {
    for says_farewell in [true, false] {
        let gate = Gate::new();
        let cluster = run_at_the_gate(&gate);
        let waiting = gate.next();
        let mut stream = join(&cluster.access(), 1);
        stream.write_all(&[200, 0, 0, 0, 0, 1, 2, 3]).unwrap();
        if says_farewell {
            stream.conn.send_close_notify();
        }
        stream.flush().unwrap();
        stream.sock.shutdown(std::net::Shutdown::Write).unwrap();
        assert_eq!(departure_of_false_worker(&cluster), Departure::Lost);
        waiting.release();
        assert!(cluster.finish().0.is_some());
    }
}

#[test]
fn undecryptable_record_ends_only_its_connection() {
    let gate = Gate::new();
    let cluster = run_at_the_gate(&gate);
    let waiting = gate.next();
    let mut stream = join(&cluster.access(), 1);
    stream.flush().unwrap();
    // A well-formed record that was not encrypted with the keys of the connection.
    stream.sock.write_all(&[&[0x17, 3, 3, 0, 32][..], &[5; 32]].concat()).unwrap();
    assert_eq!(departure_of_false_worker(&cluster), Departure::Lost);
    waiting.release();
    assert!(cluster.finish().0.is_some());
}

/// A run of two leaves over one blob, without workers yet.
fn run_without_workers(limits: Limits) -> (Leaves, Cluster) {
    run_by(policy(), limits)
}

fn run_by(policy: Policy, limits: Limits) -> (Leaves, Cluster) {
    let leaves = Leaves::Large { bytes: 20_000_001 };
    let listen = Some(([127, 0, 0, 1], 0).into());
    let cluster = Cluster::start(leaves.clone(), RunnerOptions { listen, limits, policy, ..options(PROGRAM, 0) });
    cluster.address();
    (leaves, cluster)
}

#[test]
fn worker_that_sends_other_bytes_than_announced_is_disconnected() {
    let (leaves, cluster) = run_without_workers(Limits::default());
    let mut false_worker = join(&cluster.access(), 1);
    let lease = hear(&mut false_worker, |message| match message {
        ToWorker::Assign(assignment) => Some(assignment.lease),
        _ => None,
    });
    say(&mut false_worker, &ToCoordinator::Started(lease));
    say(&mut false_worker, &ToCoordinator::Finished { lease, hash: BlobHash::of(b"right").0, length: 5 });
    say_frame(&mut false_worker, FrameTag::Part, b"wrong");
    assert!(matches!(departure_of_false_worker(&cluster), Departure::Violation(_)));
    let honest = worker(&cluster.access_file());
    assert_eq!(cluster.finish().0, TestPlanner::reference(leaves));
    assert_eq!(honest.output().status.code(), Some(0));
}

#[test]
fn worker_that_requests_blobs_without_reading_is_disconnected() {
    let (leaves, cluster) = run_without_workers(Limits { pending_blobs: 4, ..Limits::default() });
    let mut false_worker = join(&cluster.access(), 1);
    let hash = hear(&mut false_worker, |message| match message {
        ToWorker::Assign(assignment) => Some(assignment.inputs[0]),
        _ => None,
    });
    // Twenty megabytes exceed the buffers of the sockets, so the first transfer never ends.
    for _ in 0..5 {
        say(&mut false_worker, &ToCoordinator::Fetch { hash });
    }
    assert!(matches!(departure_of_false_worker(&cluster), Departure::Violation(_)));
    let honest = worker(&cluster.access_file());
    assert_eq!(cluster.finish().0, TestPlanner::reference(leaves));
    assert_eq!(honest.output().status.code(), Some(0));
}

#[test]
fn worker_that_sends_heartbeats_but_reads_nothing_is_too_slow() {
    let policy = Policy { heartbeat: Duration::from_millis(100), lost_after: Duration::from_secs(2), ..policy() };
    let (leaves, cluster) = run_by(policy, Limits::default());
    let mut false_worker = join(&cluster.access(), 1);
    let hash = hear(&mut false_worker, |message| match message {
        ToWorker::Assign(assignment) => Some(assignment.inputs[0]),
        _ => None,
    });
    say(&mut false_worker, &ToCoordinator::Fetch { hash });
    // It sends heartbeats until the connection is closed.
    let (keep, dropped) = channel::<()>();
    let living = std::thread::spawn(move || {
        let body = encode_message(&ToCoordinator::Heartbeat { executing: Vec::new() }).unwrap();
        let beat = [&frame_header(FrameTag::Message, body.len()).unwrap()[..], &body].concat();
        while dropped.recv_timeout(Duration::from_millis(50)) == Err(RecvTimeoutError::Timeout) {
            if false_worker.write_all(&beat).and_then(|()| false_worker.flush()).is_err() {
                break;
            }
        }
        false_worker
    });
    assert_eq!(departure_of_false_worker(&cluster), Departure::TooSlow);
    drop(keep);
    // Only the contents of the sockets' buffers were received; then the coordinator closed the connection, although bytes were left to
    // read.
    let false_worker = living.join().unwrap();
    assert!(read_to_the_end(false_worker).len() < 20_000_001);
    let honest = worker(&cluster.access_file());
    assert_eq!(cluster.finish().0, TestPlanner::reference(leaves));
    assert_eq!(honest.output().status.code(), Some(0));
}

#[test]
fn wrong_output_is_detected_if_outputs_are_verified() {
    let policy = Policy { verify_fraction: 1.0, ..policy() };
    let (_, cluster) = run_by(policy, Limits::default());
    let mut false_worker = join(&cluster.access(), 1);
    let lease = hear(&mut false_worker, |message| match message {
        ToWorker::Assign(assignment) => Some(assignment.lease),
        _ => None,
    });
    // Well formed, and so long that the coordinator has to request it.
    let wrong = vec![7; PART_BYTES + 1];
    say(&mut false_worker, &ToCoordinator::Started(lease));
    let (hash, length) = (BlobHash::of(&wrong).0, wrong.len() as u64);
    say(&mut false_worker, &ToCoordinator::Finished { lease, hash, length });
    wrong.chunks(PART_BYTES).for_each(|part| say_frame(&mut false_worker, FrameTag::Part, part));
    hear(&mut false_worker, |message| matches!(message, ToWorker::Acknowledge(_)).then_some(()));
    let honest = worker(&cluster.access_file());
    let error = cluster.error();
    assert!(matches!(error, RunError::Stop(Stop::ResultsDiffer { .. })), "{error}");
    let text = error.to_string();
    assert!(text.contains("from worker 1") && text.contains("from worker 2"), "{text}");
    assert_eq!(honest.output().status.code(), Some(0));
    drop(false_worker);
}
