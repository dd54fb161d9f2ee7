//! A worker that is refused, or refuses its coordinator, ends at once without retrying and prints the reason and the remedy.

use super::{PROGRAM, WORKER, run_at_the_gate, worker};
use lookalike::protocol::{
    Access, CHALLENGE_BYTES, Challenge, PROTOCOL_VERSION, ProofKey, RESPONSE_BYTES, Response, RunName, Secret,
    ToCoordinator, ToWorker, VERDICT_BYTES, Verdict, Welcome,
};
use lookalike_coordinator::access::{Credentials, Identity};
use lookalike_coordinator::runner::RunnerOptions;
use lookalike_tests::cluster::{Cluster, options};
use lookalike_tests::gate::Gate;
use lookalike_tests::plan::Leaves;
use lookalike_tests::process::{Process, stderr};
use lookalike_tests::raw_peer::{
    FalseCoordinator, TlsServer, challenge, connect_tls, greet, identity, read_message, read_to_the_end, tell, tls_of,
};
use lookalike_worker::tls::{channel_binding, provider};
use rustls::server::{ClientHello, ResolvesServerCert};
use rustls::sign::CertifiedKey;
use std::io::{Read, Write};
use std::net::TcpListener;
use std::process::{Command, Output};
use std::sync::Arc;
use std::time::{Duration, SystemTime};
use tempfile::TempDir;

const YEAR: Duration = Duration::from_hours(365 * 24);

/// A worker with this access file that would retry for a minute.
fn start(folder: &TempDir, access: &Access) -> Process {
    let file = folder.path().join("access.json");
    std::fs::write(&file, access.to_json()).unwrap();
    Process::start(Command::new(WORKER).args(["--reconnect-for", "60s", "--access"]).arg(file))
}

#[track_caller]
fn assert_refused(output: &Output, phrases: &[&str]) {
    let stderr = stderr(output);
    assert_eq!(output.status.code(), Some(2), "{stderr}");
    for phrase in phrases {
        assert!(stderr.contains(phrase), "expected {phrase:?} in: {stderr}");
    }
    // At most the line with the address to which it connects, then one line of error.
    let errors = stderr.lines().filter(|line| !line.starts_with("connecting to the coordinator at ")).count();
    assert!(errors == 1 && stderr.lines().count() <= 2, "{stderr}");
}

/// Asserts that a worker whose access file pins `pinned` ends at once when the coordinator behaves like this.
#[track_caller]
fn assert_ends(pinned: &Identity, behave: impl FnOnce(&FalseCoordinator, &Secret), phrases: &[&str]) {
    let (folder, coordinator) = (tempfile::tempdir().unwrap(), FalseCoordinator::new());
    let address = coordinator.address().to_string();
    let access = Access { address, certificate: pinned.pin(), secret: Secret::from_bytes([7; 32]) };
    let worker = start(&folder, &access);
    behave(&coordinator, &access.secret);
    assert_refused(&worker.output(), phrases);
    assert!(!coordinator.is_called_again());
}

#[test]
fn worker_with_a_wrong_secret_is_refused() {
    let gate = Gate::new();
    let cluster = run_at_the_gate(&gate);
    let folder = tempfile::tempdir().unwrap();
    let access = Access { secret: Secret::from_bytes([1; 32]), ..cluster.access() };
    let output = start(&folder, &access).output();
    assert_refused(&output, &["the coordinator refuses this worker: wrong secret", "copy the access file again"]);
    gate.next().release();
    assert!(cluster.finish().0.is_some());
}

#[test]
fn worker_refuses_a_foreign_certificate() {
    let now = SystemTime::now();
    let behave = |coordinator: &FalseCoordinator, _: &Secret| {
        let alert = coordinator.next_tls(&tls_of(&identity(now))).unwrap_err();
        assert!(alert.to_string().contains("received fatal alert"), "{alert}");
    };
    assert_ends(&identity(now), behave, &["wrong certificate", "copy the access file again"]);
}

#[test]
fn worker_refuses_an_expired_or_future_certificate() {
    let now = SystemTime::now();
    for (made, phrases) in [
        (now - 3 * YEAR, ["has expired", "lookalike access new"]),
        (now + YEAR, ["not valid yet", "set this machine's clock"]),
    ] {
        let pinned = identity(made);
        assert_ends(&pinned, |coordinator, _| _ = coordinator.next_tls(&tls_of(&pinned)).unwrap_err(), &phrases);
    }
}

/// Shows one certificate and signs with the key of another.
#[derive(Debug)]
struct Thief(Arc<CertifiedKey>);

impl ResolvesServerCert for Thief {
    fn resolve(&self, _: ClientHello<'_>) -> Option<Arc<CertifiedKey>> {
        Some(Arc::clone(&self.0))
    }
}

#[test]
fn worker_refuses_a_certificate_without_its_key() {
    let now = SystemTime::now();
    let pinned = identity(now);
    let own = identity(now);
    let key = rustls::pki_types::pem::PemObject::from_pem_slice(own.to_pem().as_bytes()).unwrap();
    let key = provider().key_provider.load_private_key(key).unwrap();
    let shown = CertifiedKey::new(vec![pinned.certificate().clone()], key);
    let config = rustls::ServerConfig::builder_with_provider(provider())
        .with_protocol_versions(&[&rustls::version::TLS13])
        .unwrap()
        .with_no_client_auth()
        .with_cert_resolver(Arc::new(Thief(Arc::new(shown))));
    let config = Arc::new(config);
    assert_ends(&pinned, |coordinator, _| _ = coordinator.next_tls(&config).unwrap_err(), &["it is an impostor"]);
}

#[test]
fn worker_refuses_a_server_that_is_not_a_coordinator() {
    let pinned = identity(SystemTime::now());
    let http = b"HTTP/1.1 400 Bad Request\r\n\r\n".to_vec();
    let greeting = Challenge::new([1; 32]).to_bytes().to_vec();
    // The alert handshake_failure, fatal, as a server without TLS 1.3 sends it.
    let old_tls = vec![0x15, 3, 3, 0, 2, 2, 40];
    for answer in [http, greeting, old_tls] {
        let behave = |coordinator: &FalseCoordinator, _: &Secret| {
            let mut stream = coordinator.next();
            stream.read_exact(&mut [0; 5]).unwrap();
            stream.write_all(&answer).unwrap();
            let _ = read_to_the_end(stream);
        };
        assert_ends(&pinned, behave, &["expected TLS 1.3, but the handshake failed", "check the address"]);
    }
}

#[test]
fn worker_refuses_another_protocol_version() {
    let pinned = identity(SystemTime::now());
    let behave = |coordinator: &FalseCoordinator, _: &Secret| {
        let mut stream = coordinator.next_tls(&tls_of(&pinned)).unwrap();
        let other = Challenge { version: 9, nonce: [1; 32] };
        assert!(challenge(&mut stream, &other, |_, _| panic!("an answer to another version")).is_err());
    };
    let versions = format!("expected protocol version {PROTOCOL_VERSION}, found 9");
    assert_ends(&pinned, behave, &[&versions, "use the same build"]);
}

#[test]
fn worker_refuses_a_coordinator_without_the_secret() {
    let pinned = identity(SystemTime::now());
    let behave = |coordinator: &FalseCoordinator, _: &Secret| {
        let mut stream = coordinator.next_tls(&tls_of(&pinned)).unwrap();
        let own = Challenge::new([1; 32]);
        // It has the key of the certificate and admits every worker, but sends a false proof.
        let welcome = |_: &_, _: &_| Verdict { version: PROTOCOL_VERSION, refusal: None, proof: [5; 32] };
        challenge(&mut stream, &own, welcome).unwrap();
    };
    assert_ends(&pinned, behave, &["the coordinator does not know the secret", "copy the file again"]);
}

/// An attacker that has the coordinator's key, but not the secret, relays the preamble unchanged between a worker and its coordinator.
/// Without channel bindings both would accept.
#[test]
fn relayed_proofs_are_refused() {
    let gate = Gate::new();
    let cluster = run_at_the_gate(&gate);
    let stolen = std::fs::read_to_string(cluster.folder().join("access.key.pem")).unwrap();
    let stolen = Identity::from_pem(&stolen).unwrap();
    let real = cluster.access();
    let behave = |between: &FalseCoordinator, _: &Secret| {
        let mut to_worker = between.next_tls(&tls_of(&stolen)).unwrap();
        let mut to_coordinator = connect_tls(&real).unwrap();
        let mut pass = |bytes: &mut [u8], down: bool| {
            if down {
                to_coordinator.read_exact(bytes).unwrap();
                to_worker.write_all(bytes).unwrap();
                to_worker.flush().unwrap();
            } else {
                to_worker.read_exact(bytes).unwrap();
                to_coordinator.write_all(bytes).unwrap();
                to_coordinator.flush().unwrap();
            }
        };
        pass(&mut [0; CHALLENGE_BYTES], true);
        pass(&mut [0; RESPONSE_BYTES], false);
        pass(&mut [0; VERDICT_BYTES], true);
    };
    // This worker has the true secret.
    let (folder, between) = (tempfile::tempdir().unwrap(), FalseCoordinator::new());
    let worker = start(&folder, &Access { address: between.address().to_string(), ..real.clone() });
    behave(&between, &real.secret);
    assert_refused(&worker.output(), &["wrong secret"]);
    // The same worker is admitted on a direct connection.
    let mut direct = connect_tls(&real).unwrap();
    assert_eq!(greet(&mut direct, &real.secret, |_| {}).unwrap().2.refusal, None);
    gate.next().release();
    assert!(cluster.finish().0.is_some());
}

#[test]
fn worker_retries_until_it_reaches_its_coordinator() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("beforehand.json");
    // A port that was free a moment ago.
    let address = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    Credentials::new(address.to_string(), SystemTime::now()).unwrap().create(&file).unwrap();
    let worker = worker(&file);
    // Closing every connection at once does not count as a refusal.
    let rude = TcpListener::bind(address).unwrap();
    drop(rude.accept().unwrap());
    drop(rude.accept().unwrap());
    drop(rude);
    let gate = Gate::new();
    let leaves = Leaves::Gates { count: 1, address: gate.address().to_string() };
    let cluster = Cluster::start(leaves, RunnerOptions { access: Some(file), ..options(PROGRAM, 0) });
    assert_eq!(cluster.address(), address.to_string());
    gate.next().release();
    assert!(!cluster.access_file().exists());
    assert!(cluster.finish().0.is_some());
    let output = worker.output();
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
}

#[test]
fn worker_leaves_a_silent_coordinator_and_reconnects() {
    let (folder, coordinator) = (tempfile::tempdir().unwrap(), FalseCoordinator::new());
    let known = identity(SystemTime::now());
    let address = coordinator.address().to_string();
    let access = Access { address, certificate: known.pin(), secret: Secret::from_bytes([7; 32]) };
    let _worker = start(&folder, &access);
    let (mut names, mut silent) = (Vec::new(), Vec::new());
    for _ in 0..2 {
        let mut stream = coordinator.next_tls(&tls_of(&known)).unwrap();
        let asked = Challenge::new([1; 32]);
        let judge = |response: &Response, stream: &TlsServer| {
            response.judge(&asked, &ProofKey::new(&access.secret, &channel_binding(&stream.conn).unwrap()))
        };
        challenge(&mut stream, &asked, judge).unwrap();
        let hello = read_message(&mut stream);
        let ToCoordinator::Hello(hello) = hello else { panic!("expected a hello, found {hello:?}") };
        names.push(hello.name);
        let run = RunName([1; 16]);
        let welcome = Welcome { worker: 1, run, epoch: 1, heartbeat_ms: 50, silence_ms: 1000, drain_ms: 0 };
        tell(&mut stream, &ToWorker::Welcome(welcome));
        // Heartbeats continue for longer than the silence that the worker tolerates. Then they stop, without an end of the connection, as
        // of a machine without power.
        for _ in 0..30 {
            tell(&mut stream, &ToWorker::Heartbeat);
            while !matches!(read_message(&mut stream), ToCoordinator::Heartbeat { .. }) {}
        }
        silent.push(stream);
    }
    assert_eq!(names[0], names[1], "it is the same process");
}
