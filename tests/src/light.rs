//! Light workers: many connections that speak the whole protocol from one process. They execute nodes on the task that reads, so nodes
//! must be short.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use lookalike::graph::{Blob, BlobHash, DecodedCache, Registry, RunContext};
use lookalike::protocol::{
    Access, Assignment, FailureKind, Hello, IncomingBlob, ProcessName, ProofKey, ToCoordinator, ToWorker, Welcome,
};
use lookalike_worker::tls::{channel_binding, connect};
use lookalike_worker::wire::{Incoming, Parcel, Received, WireError, greet_coordinator, send_message};
use nix::sys::resource::{Resource, getrlimit, setrlimit};
use tokio::io::{ReadHalf, WriteHalf, split};
use tokio::net::TcpStream;
use tokio::runtime::Runtime;
use tokio::task::JoinHandle;
use tokio::time::interval;

use crate::nodes::registry;

/// File descriptors that this process needs beside the sockets.
const OTHER_FILES: u64 = 100;

/// How many bytes of decoded inputs a light worker keeps.
const DECODED_BYTES: usize = 1 << 20;

/// Raise this process's limit of file descriptors so that it can open this many sockets.
///
/// # Errors
/// When the limit cannot be raised: the message says what to do.
pub fn allow_sockets(count: u64) -> Result<(), String> {
    let wanted = count + OTHER_FILES;
    let (soft, hard) = getrlimit(Resource::RLIMIT_NOFILE).map_err(|error| error.to_string())?;
    if soft >= wanted {
        return Ok(());
    }
    let refused = |error| {
        format!("expected to be allowed {wanted} open files, found {soft} (at most {hard}): {error}; raise `ulimit -n`")
    };
    setrlimit(Resource::RLIMIT_NOFILE, wanted, hard.max(wanted)).map_err(refused)
}

/// Light workers, connected or finished.
#[derive(Debug)]
pub struct LightWorkers {
    runtime: Runtime,
    connections: Vec<JoinHandle<Result<(), WireError>>>,
}

impl LightWorkers {
    /// Connect this many workers.
    ///
    /// # Panics
    /// When the runtime cannot be started.
    #[must_use]
    pub fn join(access: &Access, count: u32) -> Self {
        let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build();
        let runtime = runtime.expect("a tokio runtime");
        // Each worker reports a process id of its own, above those of real processes, so that none can be signalled.
        let processes = (0..count).map(|index| (1 << 30) + index);
        let connections = processes.map(|process| runtime.spawn(work(access.clone(), process))).collect();
        Self { runtime, connections }
    }

    /// Wait until the coordinator has told all of them to end.
    ///
    /// # Panics
    /// When a connection ended in another way.
    pub fn finish(self) {
        for connection in self.connections {
            let ended = self.runtime.block_on(connection).expect("a task that does not panic");
            ended.expect("a connection that the coordinator ends in order");
        }
    }
}

/// One worker, from its connection to the coordinator's message that the run is over.
async fn work(access: Access, process: u32) -> Result<(), WireError> {
    let mut stream = connect(TcpStream::connect(&access.address).await?, access.certificate).await?;
    let channel = channel_binding(stream.get_ref().1).map_err(std::io::Error::other)?;
    let nonce = BlobHash::of(&process.to_le_bytes()).0;
    greet_coordinator(&mut stream, &ProofKey::new(&access.secret, &channel), nonce).await?;
    let (reader, mut writer) = split(stream);
    let [a, b, c, d] = process.to_le_bytes();
    let name = ProcessName([a, b, c, d, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
    let hello = Hello { build: "light".into(), threads: 1, process, name, is_local: false };
    send_message(&mut writer, &ToCoordinator::Hello(hello)).await?;
    let mut incoming = Incoming::new(reader);
    match incoming.message().await? {
        ToWorker::Welcome(welcome) => Worker::new(incoming, writer).serve(&welcome).await,
        other => Err(WireError::Unexpected { expected: "a welcome", found: format!("{other:?}") }),
    }
}

struct Worker<S> {
    incoming: Incoming<ReadHalf<S>>,
    writer: WriteHalf<S>,
    registry: Registry,
    decoded: Arc<DecodedCache>,
    blobs: BTreeMap<BlobHash, Blob>,
    transfer: Option<IncomingBlob>,
    /// Assigned nodes, by number; nodes without all their inputs wait.
    assigned: BTreeMap<u64, Assignment>,
}

impl<S: tokio::io::AsyncRead + tokio::io::AsyncWrite + Unpin> Worker<S> {
    fn new(incoming: Incoming<ReadHalf<S>>, writer: WriteHalf<S>) -> Self {
        let (registry, blobs, assigned) = (registry(), BTreeMap::new(), BTreeMap::new());
        let decoded = Arc::new(DecodedCache::new(DECODED_BYTES));
        Self { incoming, writer, registry, decoded, blobs, transfer: None, assigned }
    }

    async fn serve(mut self, welcome: &Welcome) -> Result<(), WireError> {
        let mut heart = interval(Duration::from_millis(welcome.heartbeat_ms.into()));
        loop {
            let received = tokio::select! {
                received = self.incoming.next() => received?.ok_or(WireError::Ended)?,
                _ = heart.tick() => {
                    let beat = ToCoordinator::Heartbeat { executing: Vec::new() };
                    send_message(&mut self.writer, &beat).await?;
                    continue;
                }
            };
            match received {
                Received::Message(ToWorker::Stop { .. }) => return Ok(()),
                Received::Message(ToWorker::Assign(assignment)) => {
                    for hash in assignment.inputs.iter().filter(|hash| !self.blobs.contains_key(&BlobHash(**hash))) {
                        send_message(&mut self.writer, &ToCoordinator::Fetch { hash: *hash }).await?;
                    }
                    self.assigned.insert(assignment.lease.node, assignment);
                }
                Received::Message(ToWorker::Cancel(lease)) => {
                    self.assigned.retain(|_, assignment| assignment.lease != lease);
                }
                Received::Message(ToWorker::Blob { hash, length }) => {
                    self.transfer = Some(IncomingBlob::begin(BlobHash(hash), length)?);
                }
                Received::Part(part) => self.transfer.iter_mut().try_for_each(|blob| blob.push(&part))?,
                Received::Message(ToWorker::Acknowledge(_) | ToWorker::Heartbeat | ToWorker::Welcome(_)) => {}
            }
            if let Some(blob) = self.transfer.take_if(|blob| blob.is_complete()) {
                let blob = blob.finish()?;
                self.blobs.insert(blob.hash(), blob);
            }
            self.execute().await?;
        }
    }

    /// Execute the nodes whose inputs are complete.
    async fn execute(&mut self) -> Result<(), WireError> {
        let inputs_of = |assignment: &Assignment| -> Option<Vec<Blob>> {
            assignment.inputs.iter().map(|hash| self.blobs.get(&BlobHash(*hash)).cloned()).collect()
        };
        let ready =
            self.assigned.values().filter_map(|assignment| Some((assignment.lease.node, inputs_of(assignment)?)));
        for (node, inputs) in ready.collect::<Vec<_>>() {
            let Some(Assignment { lease, kind, parameters, .. }) = self.assigned.remove(&node) else { continue };
            send_message(&mut self.writer, &ToCoordinator::Started(lease)).await?;
            let mut parcel = Parcel::default();
            let context = RunContext::new(Arc::clone(&self.decoded));
            match self.registry.run(&kind, &parameters, &inputs, &context) {
                Ok(output) => {
                    let (hash, length) = (output.hash().0, output.len() as u64);
                    parcel.add(&ToCoordinator::Finished { lease, hash, length })?;
                    parcel.add_blob(&output, &mut self.writer).await?;
                }
                Err(failure) => {
                    let (kind, message) = (FailureKind::Application, failure.to_string());
                    parcel.add(&ToCoordinator::Failed { lease, kind, message })?;
                }
            }
            parcel.send(&mut self.writer).await?;
        }
        Ok(())
    }
}
