//! Strangers and liars at the coordinator's port: they get nothing, and the run goes on.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::io::{Read, Write};
use std::net::TcpStream;
use std::process::Command;
use std::time::Duration;

use lookalike::protocol::{
    Access, CHALLENGE_BYTES, Challenge, FailureKind, FrameTag, Hello, LeaseName, Secret, ToCoordinator, VERDICT_BYTES,
    Verdict, encode_message, frame_header,
};
use lookalike_coordinator::comm::{Departure, RunEvent};
use lookalike_coordinator::runner::RunnerOptions;
use lookalike_tests::cluster::{Cluster, options};
use lookalike_tests::gate::Gate;
use lookalike_tests::plan::Leaves;
use lookalike_tests::process::{Process, stderr};

const PROGRAM: &str = env!("CARGO_BIN_EXE_lookalike-test-cluster");
const WORKER: &str = env!("CARGO_BIN_EXE_lookalike-worker-under-test");

/// A run whose only node waits at the gate, on a real worker.
fn run_at_the_gate(gate: &Gate) -> Cluster {
    let leaves = Leaves::Gates { count: 1, address: gate.address().to_string() };
    Cluster::start(leaves, RunnerOptions { listen: Some(([127, 0, 0, 1], 0).into()), ..options(PROGRAM, 1) })
}

fn connect(cluster: &Cluster) -> TcpStream {
    let stream = TcpStream::connect(cluster.access().address).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(30))).unwrap();
    stream
}

/// Wait until the other side has closed; a reset is as good as an end.
fn assert_closed(mut stream: TcpStream) {
    let mut rest = Vec::new();
    match stream.read_to_end(&mut rest) {
        Ok(_) => {}
        Err(error) => assert_eq!(error.kind(), std::io::ErrorKind::ConnectionReset, "{error}"),
    }
}

fn assert_closed_without_a_word(mut stream: TcpStream) {
    let mut word = Vec::new();
    let _ = stream.read_to_end(&mut word);
    assert!(word.is_empty());
}

/// Greet as a worker that knows the secret.
fn join(cluster: &Cluster) -> TcpStream {
    let Access { secret, .. } = cluster.access();
    let mut stream = connect(cluster);
    let mut challenge = [0; CHALLENGE_BYTES];
    stream.read_exact(&mut challenge).unwrap();
    let challenge = Challenge::from_bytes(&challenge).unwrap();
    let response = challenge.answer(&secret, [9; 32]).unwrap();
    stream.write_all(&response.to_bytes()).unwrap();
    let mut verdict = [0; VERDICT_BYTES];
    stream.read_exact(&mut verdict).unwrap();
    Verdict::from_bytes(&verdict).unwrap().check(&challenge, &response, &secret).unwrap();
    say(&mut stream, &ToCoordinator::Hello(Hello { build: "liar".into(), threads: 1, process: LIAR }));
    stream
}

/// The process id that liars give.
const LIAR: u32 = 77;

fn say(stream: &mut TcpStream, message: &ToCoordinator) {
    let body = encode_message(message).unwrap();
    stream.write_all(&frame_header(FrameTag::Message, body.len()).unwrap()).unwrap();
    stream.write_all(&body).unwrap();
}

/// How the liar's membership ended.
fn end_of_liar(cluster: &Cluster) -> Departure {
    let liar = cluster.wait_for(|event| match event {
        RunEvent::WorkerJoined { worker, process: LIAR, .. } => Some(*worker),
        _ => None,
    });
    cluster.wait_for(|event| match event {
        RunEvent::WorkerLeft { worker, departure } if *worker == liar => Some(departure.clone()),
        _ => None,
    })
}

#[test]
fn worker_with_a_wrong_secret_is_refused_and_does_not_try_again() {
    let gate = Gate::new();
    let cluster = run_at_the_gate(&gate);
    cluster.address();
    let wrong = cluster.folder().join("wrong.json");
    let access = Access { secret: Secret::from_bytes([1; 32]), ..cluster.access() };
    std::fs::write(&wrong, access.to_json()).unwrap();
    let output = Process::start(Command::new(WORKER).arg("--access").arg(&wrong)).output();
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert!(stderr(&output).contains("the coordinator refuses this worker: wrong secret"), "{}", stderr(&output));
    gate.next().release();
    assert!(cluster.finish().0.is_some());
}

#[test]
fn strangers_do_not_hurt() {
    let gate = Gate::new();
    let cluster = run_at_the_gate(&gate);
    cluster.address();
    let waiting = gate.next();
    let noise: Vec<u8> = (0..200_000_u32).map(|index| index.wrapping_mul(2_654_435_761).to_le_bytes()[3]).collect();
    for bytes in [&b"GET / HTTP/1.1\r\nHost: lookalike\r\n\r\n".repeat(4), &noise, &vec![0xff; 100_000]] {
        let mut stream = connect(&cluster);
        // The other side may close before it has read all.
        let _ = stream.write_all(bytes);
        assert_closed(stream);
    }
    // Many that say nothing: the first ones use up the places for strangers, the others are closed at once.
    let mut silent: Vec<_> = (0..80).map(|_| connect(&cluster)).collect();
    silent.pop().into_iter().for_each(assert_closed_without_a_word);
    waiting.release();
    assert!(cluster.finish().0.is_some());
}

#[test]
fn liars_with_the_secret_are_thrown_out() {
    let oversized = [255, 255, 255, 127, 0].to_vec();
    let unknown_tag = [1, 0, 0, 0, 9].to_vec();
    let no_message = [3, 0, 0, 0, 0, 99, 99].to_vec();
    let part_of_nothing = [2, 0, 0, 0, 1, 0].to_vec();
    for lie in [oversized, unknown_tag, no_message, part_of_nothing] {
        let gate = Gate::new();
        let cluster = run_at_the_gate(&gate);
        cluster.address();
        let waiting = gate.next();
        let mut stream = join(&cluster);
        stream.write_all(&lie).unwrap();
        assert!(matches!(end_of_liar(&cluster), Departure::Violation(_)), "{lie:?}");
        assert_closed(stream);
        waiting.release();
        assert!(cluster.finish().0.is_some());
    }
}

#[test]
fn answers_to_nothing_and_false_hashes_are_not_believed() {
    let lease = LeaseName { node: 0, attempt: 9, epoch: 1 };
    let never_asked = ToCoordinator::Failed { lease, kind: FailureKind::Application, message: "I lie".into() };
    let false_hash = ToCoordinator::Finished { lease, hash: [1; 32], length: 0 };
    let too_long = ToCoordinator::Finished { lease, hash: [1; 32], length: u64::MAX };
    let unknown_blob = ToCoordinator::Fetch { hash: [1; 32] };
    for lie in [never_asked, false_hash, too_long, unknown_blob] {
        let gate = Gate::new();
        let cluster = run_at_the_gate(&gate);
        cluster.address();
        let waiting = gate.next();
        let mut stream = join(&cluster);
        say(&mut stream, &lie);
        assert!(matches!(end_of_liar(&cluster), Departure::Violation(_)), "{lie:?}");
        assert_closed(stream);
        waiting.release();
        assert!(cluster.finish().0.is_some());
    }
}
