//! Unauthenticated clients at the coordinator's port: clients without the access file.

use super::{PROGRAM, run_at_the_gate, run_within, worker};
use lookalike::protocol::{Access, CHALLENGE_BYTES, CertificatePin, Refusal, Secret};
use lookalike_coordinator::limits::Limits;
use lookalike_tests::cluster::read_access;
use lookalike_tests::gate::Gate;
use lookalike_tests::process::Process;
use lookalike_tests::raw_peer::{connect, connect_tls, greet, read_to_the_end};
use std::io::{Read, Write};
use std::net::TcpStream;
use std::process::Command;
use std::time::Duration;

/// A TLS record that starts a ClientHello of 65535 bytes, truncated.
const LONG_HELLO: [u8; 9] = [0x16, 3, 1, 0x40, 0, 1, 0, 0xff, 0xff];

#[test]
fn connection_with_bytes_that_are_not_tls_is_closed() {
    let gate = Gate::new();
    let cluster = run_at_the_gate(&gate);
    let waiting = gate.next();
    let noise: Vec<u8> = (0..200_000_u32).map(|index| index.wrapping_mul(2_654_435_761).to_le_bytes()[3]).collect();
    let greeting = b"LOOKLIKE\x02\0\0\0".repeat(10);
    let http = b"GET / HTTP/1.1\r\nHost: lookalike\r\n\r\n".repeat(4);
    for bytes in [&http, &greeting, &noise, &vec![0xff; 100_000], &vec![0; 100_000]] {
        let mut stream = connect(&cluster.access().address).unwrap();
        // The coordinator may close the connection before it has read all.
        let _ = stream.write_all(bytes);
        // At most a TLS alert.
        let answer = read_to_the_end(stream);
        assert!(answer.len() <= 7, "{answer:?}");
    }
    waiting.release();
    assert!(cluster.finish().0.is_some());
}

/// A ClientHello of TLS 1.2 as a client of 2015 would send it: ECDHE with AES-GCM, P-256 and X25519, no `supported_versions`.
fn hello_of_tls_1_2() -> Vec<u8> {
    let suites = [0xc0, 0x2b, 0xc0, 0x2f, 0xc0, 0x2c, 0xc0, 0x30];
    let groups = [0, 10, 0, 6, 0, 4, 0, 29, 0, 23];
    let formats = [0, 11, 0, 2, 1, 0];
    let signatures = [0, 13, 0, 8, 0, 6, 8, 7, 4, 3, 8, 4];
    let extensions = [&groups[..], &formats, &signatures].concat();
    let tail = [&[0, 8], &suites[..], &[1, 0, 0, u8::try_from(extensions.len()).unwrap()], &extensions].concat();
    let body = [&[3, 3], &[7; 32][..], &[0], &tail].concat();
    let length = u8::try_from(body.len()).unwrap();
    [&[0x16, 3, 1, 0, length + 4, 1, 0, 0, length][..], &body].concat()
}

#[test]
fn client_of_tls_1_2_gets_a_protocol_version_alert() {
    let gate = Gate::new();
    let cluster = run_at_the_gate(&gate);
    let mut stream = connect(&cluster.access().address).unwrap();
    stream.write_all(&hello_of_tls_1_2()).unwrap();
    // Record of type alert, version 1.2 for compatibility, 2 bytes: fatal, protocol_version.
    assert_eq!(read_to_the_end(stream), [0x15, 3, 3, 0, 2, 2, 70]);
    gate.next().release();
    assert!(cluster.finish().0.is_some());
}

#[test]
fn wrong_secret_or_version_inside_tls_is_refused_without_a_proof() {
    let gate = Gate::new();
    let cluster = run_at_the_gate(&gate);
    let access = cluster.access();
    let mut stream = connect_tls(&access).unwrap();
    let (.., verdict) = greet(&mut stream, &Secret::from_bytes([1; 32]), |_| {}).unwrap();
    assert_eq!((verdict.refusal, verdict.proof), (Some(Refusal::WrongSecret), [0; 32]));
    assert!(read_to_the_end(stream).is_empty());
    let mut stream = connect_tls(&access).unwrap();
    let (.., verdict) = greet(&mut stream, &access.secret, |response| response.version = 9).unwrap();
    assert_eq!((verdict.refusal, verdict.proof), (Some(Refusal::WrongVersion), [0; 32]));
    assert!(read_to_the_end(stream).is_empty());
    gate.next().release();
    assert!(cluster.finish().0.is_some());
}

#[test]
fn tls_session_resumption_is_not_offered() {
    let gate = Gate::new();
    let cluster = run_at_the_gate(&gate);
    let access = cluster.access();
    let mut stream = connect_tls(&access).unwrap();
    greet(&mut stream, &access.secret, |_| {}).unwrap();
    assert_eq!(stream.conn.tls13_tickets_received(), 0);
    assert_eq!(stream.conn.handshake_kind(), Some(rustls::HandshakeKind::Full));
    gate.next().release();
    assert!(cluster.finish().0.is_some());
}

#[test]
fn unauthenticated_connection_is_closed_after_its_time_even_while_it_sends() {
    let gate = Gate::new();
    // Long enough for a handshake on a machine whose processors are busy.
    let limits = Limits { handshake_time: Duration::from_secs(2), ..Limits::default() };
    let cluster = run_within(&gate, 1, limits);
    let waiting = gate.next();
    let access = cluster.access();
    let silent = connect(&access.address).unwrap();
    let silent_inside = connect_tls(&access).unwrap();
    let mut dripping = connect(&access.address).unwrap();
    dripping.write_all(&LONG_HELLO).unwrap();
    dripping.set_read_timeout(Some(Duration::from_millis(20))).unwrap();
    // It sends single bytes until the coordinator closes the connection.
    let drops = (0..1500).take_while(|_| {
        let silence = dripping.read(&mut [0; 8]).is_err_and(|error| error.kind() == std::io::ErrorKind::WouldBlock);
        silence && dripping.write_all(&[0]).is_ok()
    });
    // At least 20 ms each: 100 take the permitted 2 s, 500 the default of 10 s.
    assert!(drops.count() < 250);
    assert!(read_to_the_end(silent).is_empty());
    // The challenge and nothing more.
    assert_eq!(read_to_the_end(silent_inside).len(), CHALLENGE_BYTES);
    waiting.release();
    assert!(cluster.finish().0.is_some());
}

#[test]
fn unauthenticated_connections_in_all_places_do_not_block_a_worker() {
    let gate = Gate::new();
    let limits = Limits { unauthenticated: 8, handshake_time: Duration::from_secs(3600), ..Limits::default() };
    let cluster = run_within(&gate, 0, limits);
    let address = cluster.access().address;
    let begin = |bytes: &[u8]| {
        let mut stream = connect(&address).unwrap();
        stream.write_all(bytes).unwrap();
        stream
    };
    let mut slow: Vec<TcpStream> = (0..20).map(|count| begin(if count % 2 == 0 { &LONG_HELLO } else { b"" })).collect();
    // The first ones were closed long before their time was over, to make room for the others.
    slow.drain(..12).for_each(|stream| assert!(read_to_the_end(stream).is_empty()));
    let worker = worker(&cluster.access_file());
    gate.next().release();
    assert!(cluster.finish().0.is_some());
    assert_eq!(worker.output().status.code(), Some(0));
}

#[test]
fn connections_beyond_the_limit_are_closed_at_once() {
    let gate = Gate::new();
    let cluster = run_within(&gate, 1, Limits { connections: 3, ..Limits::default() });
    // The worker has one of the three.
    let waiting = gate.next();
    let address = cluster.access().address;
    let first = [0, 1].map(|_| connect(&address).unwrap());
    assert!(read_to_the_end(connect(&address).unwrap()).is_empty());
    drop(first);
    waiting.release();
    assert!(cluster.finish().0.is_some());
}

#[test]
fn client_refuses_another_certificate_than_the_pinned_one() {
    let gate = Gate::new();
    let cluster = run_at_the_gate(&gate);
    let access = Access { certificate: CertificatePin::of(b"another"), ..cluster.access() };
    let error = connect_tls(&access).unwrap_err();
    assert!(error.to_string().contains("invalid peer certificate"), "{error}");
    gate.next().release();
    assert!(cluster.finish().0.is_some());
}

/// The most memory that a process ever had, in bytes.
#[cfg(target_os = "linux")]
fn peak_memory(process: u32) -> usize {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).unwrap();
    let line = status.lines().find(|line| line.starts_with("VmHWM:")).unwrap();
    line.split_whitespace().nth(1).unwrap().parse::<usize>().unwrap() << 10
}

/// The memory for the 16 places of this test, and 10 MB for what an allocator does not return (4 MB were observed). Without the limit the
/// 400 connections used 29 to 38 MB.
#[cfg(target_os = "linux")]
const MEMORY_FOR_UNAUTHENTICATED: usize = 16 * 150_000 + (10 << 20);

#[cfg(target_os = "linux")]
#[test]
fn unauthenticated_connections_cost_a_bounded_amount_of_memory() {
    let (gate, folder) = (Gate::new(), tempfile::tempdir().unwrap());
    let file = folder.path().join("access.json");
    let arguments = ["gates", "1", &gate.address().to_string(), "1"].map(str::to_owned);
    let coordinator = Process::start(Command::new(PROGRAM).args(arguments).arg(&file).arg("16"));
    let waiting = gate.next();
    let before = peak_memory(coordinator.id());
    let address = read_access(&file).address;
    // Handshakes that never end: most of the largest message, in records of 16 KiB.
    let record = [&[0x16, 3, 3, 0x40, 0][..], &[0; 0x4000]].concat();
    let hello = [&LONG_HELLO[..], &[0; 0x4000 - 4], &record, &record, &record[..0x3800]].concat();
    let begin = |_| {
        let mut stream = connect(&address).unwrap();
        // The connection may be closed before all is sent.
        let _ = stream.write_all(&hello);
        stream
    };
    let mut held: Vec<TcpStream> = (0..400).map(begin).collect();
    held.drain(..384).for_each(|stream| _ = read_to_the_end(stream));
    let grown = peak_memory(coordinator.id()) - before;
    assert!(grown < MEMORY_FOR_UNAUTHENTICATED, "{grown} bytes");
    drop(held);
    waiting.release();
    assert_eq!(coordinator.output().status.code(), Some(0));
}
