//! Both ends of a connection, controlled by a test: a client that can send anything to a coordinator, and a coordinator that can send
//! anything to a worker.

use std::io::{self, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};
use std::time::SystemTime;

use lookalike::protocol::{
    Access, CHALLENGE_BYTES, Challenge, CodecError, FrameReader, FrameTag, Hello, ProcessName, ProofKey,
    RESPONSE_BYTES, Response, Secret, ToCoordinator, ToWorker, VERDICT_BYTES, Verdict, decode_message, encode_message,
    frame_header,
};
use lookalike_coordinator::access::Identity;
use lookalike_coordinator::tls::server_config;
use lookalike_worker::tls::{SERVER_NAME, channel_binding, client_config};
use rustls::pki_types::ServerName;
use rustls::{ClientConnection, ServerConfig, ServerConnection, StreamOwned};

use crate::PATIENCE;
use crate::gate::is_end;

/// The process id that false workers report.
pub const FALSE_WORKER: u32 = 77;

/// A TLS connection to a coordinator.
pub type TlsClient = StreamOwned<ClientConnection, TcpStream>;

/// A TLS connection from a worker.
pub type TlsServer = StreamOwned<ServerConnection, TcpStream>;

/// Connect and send nothing.
///
/// # Errors
/// When no process listens there.
pub fn connect(address: &str) -> io::Result<TcpStream> {
    let stream = TcpStream::connect(address)?;
    stream.set_read_timeout(Some(PATIENCE))?;
    Ok(stream)
}

/// Read until the other side closes or resets the connection, and return the bytes.
///
/// # Panics
/// When it does not close in time.
#[must_use]
pub fn read_to_the_end(mut stream: impl Read) -> Vec<u8> {
    let mut said = Vec::new();
    match stream.read_to_end(&mut said) {
        Ok(_) => {}
        Err(error) => assert!(is_end(&error), "{error}"),
    }
    said
}

/// Connect and speak TLS as the holder of this access file.
///
/// # Errors
/// When the handshake fails.
///
/// # Panics
/// When rustls does not work.
pub fn connect_tls(access: &Access) -> io::Result<TlsClient> {
    let config = client_config(access.certificate).expect("rustls fits its provider");
    let name = ServerName::try_from(SERVER_NAME).expect("a name");
    let mut connection = ClientConnection::new(Arc::new(config), name).expect("a client");
    let mut stream = connect(&access.address)?;
    connection.complete_io(&mut stream)?;
    Ok(StreamOwned::new(connection, stream))
}

/// The key of proofs on this connection.
///
/// # Panics
/// When the handshake is not over.
#[must_use]
pub fn proof_key(stream: &TlsClient, secret: &Secret) -> ProofKey {
    ProofKey::new(secret, &channel_binding(&stream.conn).expect("a connection after its handshake"))
}

/// Read the challenge, send the answer after `change` was applied to it, and return the verdict with the answer.
///
/// # Errors
/// When the connection ends.
///
/// # Panics
/// When the coordinator does not keep to the protocol.
pub fn greet(
    stream: &mut TlsClient,
    secret: &Secret,
    change: impl FnOnce(&mut Response),
) -> io::Result<(Challenge, Response, Verdict)> {
    let key = proof_key(stream, secret);
    let mut challenge = [0; CHALLENGE_BYTES];
    stream.read_exact(&mut challenge)?;
    let challenge = Challenge::from_bytes(&challenge).expect("a challenge");
    let mut response = challenge.answer(&key, [9; 32]).expect("the same version");
    change(&mut response);
    stream.write_all(&response.to_bytes())?;
    let mut verdict = [0; VERDICT_BYTES];
    stream.read_exact(&mut verdict)?;
    Ok((challenge, response, Verdict::from_bytes(&verdict).expect("a verdict")))
}

/// Join as a false worker with this many threads.
///
/// # Panics
/// When the coordinator refuses it.
#[must_use]
pub fn join(access: &Access, threads: u32) -> TlsClient {
    let mut stream = connect_tls(access).expect("a TLS connection");
    let (challenge, response, verdict) = greet(&mut stream, &access.secret, |_| {}).expect("a greeting");
    let key = proof_key(&stream, &access.secret);
    assert_eq!(verdict.check(&challenge, &response, &key), Ok(()));
    say(&mut stream, &ToCoordinator::Hello(hello(threads)));
    stream
}

/// The hello of a false worker that joins for the first time.
#[must_use]
pub fn hello(threads: u32) -> Hello {
    static COUNT: AtomicU8 = AtomicU8::new(0);
    let name = ProcessName([COUNT.fetch_add(1, Ordering::Relaxed); 16]);
    Hello { build: "false-worker".into(), threads, process: FALSE_WORKER, name, is_local: false }
}

/// Send a message.
///
/// # Panics
/// When the connection is closed.
pub fn say(stream: &mut impl Write, message: &ToCoordinator) {
    let body = encode_message(message).expect("a message");
    say_frame(stream, FrameTag::Message, &body);
}

/// Send a frame.
///
/// # Panics
/// When the connection is closed.
pub fn say_frame(stream: &mut impl Write, tag: FrameTag, body: &[u8]) {
    let header = frame_header(tag, body.len()).expect("a frame");
    stream.write_all(&[&header, body].concat()).expect("somebody who listens");
}

/// Read messages until `pick` returns a value for one.
///
/// # Panics
/// When no such message comes.
pub fn hear<T>(stream: &mut impl Read, mut pick: impl FnMut(ToWorker) -> Option<T>) -> T {
    let mut frames = FrameReader::default();
    let mut chunk = [0; 1024];
    loop {
        while let Some(frame) = frames.next_frame().expect("frames") {
            let message: Result<ToWorker, CodecError> = decode_message(&frame.body);
            if let Some(picked) = message.ok().and_then(&mut pick) {
                return picked;
            }
        }
        let count = stream.read(&mut chunk).expect("a message in time");
        assert!(count > 0, "the coordinator has closed the connection");
        frames.push(&chunk[..count]);
    }
}

/// A listener that poses as a coordinator.
#[derive(Debug)]
pub struct FalseCoordinator {
    listener: TcpListener,
}

impl FalseCoordinator {
    /// Listen on a free port.
    ///
    /// # Panics
    /// When the system has no free port.
    #[must_use]
    pub fn new() -> Self {
        Self { listener: TcpListener::bind("127.0.0.1:0").expect("a free port") }
    }

    /// The address on which it listens.
    ///
    /// # Panics
    /// When the system does not know its own socket.
    #[must_use]
    pub fn address(&self) -> SocketAddr {
        self.listener.local_addr().expect("the address of a bound socket")
    }

    /// The next worker that connects.
    ///
    /// # Panics
    /// When none connects in time.
    #[must_use]
    pub fn next(&self) -> TcpStream {
        let (stream, _) = self.listener.accept().expect("a worker");
        stream.set_read_timeout(Some(PATIENCE)).expect("a socket");
        stream
    }

    /// The next worker that connects, after a TLS handshake with this configuration.
    ///
    /// # Errors
    /// When the worker refuses the handshake.
    ///
    /// # Panics
    /// When no worker comes.
    pub fn next_tls(&self, config: &Arc<ServerConfig>) -> io::Result<TlsServer> {
        let mut connection = ServerConnection::new(Arc::clone(config)).expect("a server");
        let mut stream = self.next();
        while connection.is_handshaking() {
            connection.complete_io(&mut stream)?;
        }
        Ok(StreamOwned::new(connection, stream))
    }

    /// Whether another connection waits to be accepted.
    ///
    /// # Panics
    /// When the socket fails.
    #[must_use]
    pub fn is_called_again(&self) -> bool {
        self.listener.set_nonblocking(true).expect("a socket");
        let called = self.listener.accept().is_ok();
        self.listener.set_nonblocking(false).expect("a socket");
        called
    }
}

impl Default for FalseCoordinator {
    fn default() -> Self {
        Self::new()
    }
}

/// A new identity, as if created at `now`.
///
/// # Panics
/// When the system gives no random bytes.
#[must_use]
pub fn identity(now: SystemTime) -> Identity {
    Identity::new(now).expect("an identity")
}

/// The TLS configuration of a coordinator with this identity.
///
/// # Panics
/// When rustls does not work.
#[must_use]
pub fn tls_of(identity: &Identity) -> Arc<ServerConfig> {
    Arc::new(server_config(identity).expect("a usable identity"))
}

/// Send a message to a worker.
///
/// # Panics
/// When the connection is closed.
pub fn tell(stream: &mut impl Write, message: &ToWorker) {
    let body = encode_message(message).expect("a message");
    say_frame(stream, FrameTag::Message, &body);
}

/// The next message of a worker that sends no blobs.
///
/// # Panics
/// When none comes.
pub fn read_message(stream: &mut impl Read) -> ToCoordinator {
    let (mut frames, mut byte) = (FrameReader::default(), [0]);
    loop {
        stream.read_exact(&mut byte).expect("a message in time");
        frames.push(&byte);
        if let Some(frame) = frames.next_frame().expect("a frame") {
            return decode_message(&frame.body).expect("a message");
        }
    }
}

/// Send a worker this challenge, read its answer, and send the verdict that `judge` returns.
///
/// # Errors
/// When the worker ends the connection before.
///
/// # Panics
/// When the worker does not keep to the protocol.
pub fn challenge(
    stream: &mut TlsServer,
    challenge: &Challenge,
    judge: impl FnOnce(&Response, &TlsServer) -> Verdict,
) -> io::Result<()> {
    stream.write_all(&challenge.to_bytes())?;
    stream.flush()?;
    let mut response = [0; RESPONSE_BYTES];
    stream.read_exact(&mut response)?;
    let response = Response::from_bytes(&response).expect("a response");
    let verdict = judge(&response, stream);
    stream.write_all(&verdict.to_bytes())?;
    stream.flush()
}
