//! The cluster of a run: listener, connections and local worker processes. They are started and stopped together.

use std::collections::BTreeMap;
use std::io;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::SystemTime;

use lookalike::graph::WorkerId;
use lookalike::protocol::{RunName, ToWorker};
use lookalike_worker::world::World;
use tokio::sync::mpsc::Sender;
use tokio::task::{JoinHandle, JoinSet};
use tokio_rustls::TlsAcceptor;
use tokio_util::sync::CancellationToken;

use super::{RunError, RunnerOptions};
use crate::access::{Credentials, CredentialsError};
use crate::actions::WorkerProcess;
use crate::rpc::{Gate, Inbound, Mailbox, Outgoing, serve_forever};
use crate::spawn::{LocalWorkers, SpawnError, Worked, WorkerCommand, threads_per_worker};
use crate::tls::server_config;

/// Everything that must end with the run.
#[derive(Debug)]
pub(crate) struct Cluster {
    /// The address in the access file, to which workers connect.
    pub(crate) address: String,
    /// The address on which the coordinator listens.
    pub(crate) bound: SocketAddr,
    /// The processes and mailboxes of the members.
    members: BTreeMap<WorkerId, (WorkerProcess, Mailbox)>,
    worked: Worked,
    stop: CancellationToken,
    serving: JoinHandle<()>,
    local_workers: JoinSet<()>,
}

/// The records of earlier coordinators in the journal of a resumed run.
#[derive(Debug)]
pub(crate) struct Resumed {
    /// The address on which the last one listened.
    pub(crate) listen: Option<SocketAddr>,
    /// How many nodes have results.
    pub(crate) results: usize,
}

impl Cluster {
    /// Listen, write the access file or reuse the existing one, start the local workers.
    pub(crate) async fn start<W: World>(
        world: W,
        options: &RunnerOptions,
        (run, epoch): (RunName, u64),
        resumed: Option<Resumed>,
        inbound: Sender<Inbound>,
    ) -> Result<Self, RunError> {
        let (listener, credentials) = listen(&world, options, resumed.as_ref()).await?;
        let (bound, Credentials { access, identity }) = credentials;
        let tls = server_config(&identity).map_err(RunError::Tls)?;
        let stop = CancellationToken::new();
        let workers = local_workers(options, RunnerOptions::local_address(bound))?;
        let worked = workers.worked.clone();
        // From here on, dropping `Self` ends what was started.
        let gate = Gate {
            world,
            tls: TlsAcceptor::from(Arc::new(tls)),
            secret: access.secret,
            limits: options.limits,
            run,
            epoch,
            policy: options.policy,
            inbound: inbound.clone(),
        };
        let local_workers = workers.start(&inbound, &stop)?;
        let serving = tokio::spawn(serve_forever(listener, gate, stop.clone()));
        let (address, members) = (access.address, BTreeMap::new());
        Ok(Self { address, bound, members, worked, stop, serving, local_workers })
    }

    /// Register a worker, so that messages can be sent to it.
    pub(crate) fn admit(&mut self, worker: WorkerId, process: WorkerProcess, mailbox: Mailbox) {
        self.members.insert(worker, (process, mailbox));
    }

    /// Record that a worker executes a node.
    pub(crate) fn note_work(&self, worker: WorkerId) {
        if let Some((process, _)) = self.members.get(&worker).filter(|(process, _)| process.is_local) {
            self.worked.note(process.id);
        }
    }

    /// Send a message to a worker. If it has left meanwhile, the message is dropped, and the reactor will get an event.
    pub(crate) fn send(&self, worker: WorkerId, outgoing: Outgoing) {
        if let Some((_, member)) = self.members.get(&worker) {
            member.send(outgoing);
        }
    }

    /// Remove a worker and close its connection, without sending the messages that are still queued.
    pub(crate) fn dismiss(&mut self, worker: WorkerId) {
        if let Some((_, member)) = self.members.remove(&worker) {
            member.close();
        }
    }

    /// Tell all workers that the run is over, and wait until connections and local processes have ended.
    pub(crate) async fn stop(mut self, reason: &str) {
        for (_, member) in std::mem::take(&mut self.members).into_values() {
            member.send(Outgoing::Message(ToWorker::Stop { reason: reason.to_owned() }));
        }
        self.stop.cancel();
        let _ = (&mut self.serving).await;
        while self.local_workers.join_next().await.is_some() {}
    }
}

/// Dropping without [`Cluster::stop`], when the run's future is dropped, ends everything without waiting for it. Dropping the
/// keepers kills their processes.
impl Drop for Cluster {
    fn drop(&mut self) {
        self.stop.cancel();
        self.serving.abort();
    }
}

/// Listen with credentials: those made beforehand, those of an earlier coordinator of this run, or new ones.
async fn listen<W: World>(
    world: &W,
    options: &RunnerOptions,
    resumed: Option<&Resumed>,
) -> Result<(W::Listener, (SocketAddr, Credentials)), RunError> {
    let now = SystemTime::now();
    let given = options.access.as_ref().map(|path| Credentials::read(path, now)).transpose()?;
    let earlier = match (&given, resumed) {
        (None, Some(_)) => earlier_credentials(options, now)?,
        _ => None,
    };
    let listen = match (&given, resumed) {
        (None, Some(resumed)) => options.listen_again(resumed.listen),
        _ => options.listen_address(given.as_ref().map(|given| given.access.address.as_str()))?,
    };
    let is_again = resumed.is_some_and(|resumed| resumed.listen == Some(listen));
    let listen_error = |source| match is_again {
        true => RunError::PortTaken { listen, source },
        false => RunError::Listen { listen, source },
    };
    let (listener, bound) = world.listen(listen).await.map_err(listen_error)?;
    let credentials = match (given, earlier) {
        (Some(given), _) => given,
        (None, Some(earlier)) => at_address(earlier, options, bound)?,
        (None, None) => new_credentials(options, bound, now)?,
    };
    Ok((listener, (bound, credentials)))
}

/// The credentials that an earlier coordinator of this run made; `None` if their files were removed.
fn earlier_credentials(options: &RunnerOptions, now: SystemTime) -> Result<Option<Credentials>, RunError> {
    match Credentials::read(&options.access_file, now) {
        Err(CredentialsError::ReadAccess { source, .. } | CredentialsError::ReadKey { source, .. })
            if source.kind() == io::ErrorKind::NotFound =>
        {
            Ok(None)
        }
        read => Ok(Some(read?)),
    }
}

/// Update credentials to the present address. If it is unchanged, the file is not rewritten.
fn at_address(mut earlier: Credentials, options: &RunnerOptions, bound: SocketAddr) -> Result<Credentials, RunError> {
    let address = options.advertised(bound);
    if earlier.access.address != address {
        earlier.access.address = address;
        earlier.write(&options.access_file)?;
    }
    Ok(earlier)
}

/// Make credentials for the address that the listener got, and write the access file.
fn new_credentials(options: &RunnerOptions, bound: SocketAddr, now: SystemTime) -> Result<Credentials, RunError> {
    let credentials = Credentials::new(options.advertised(bound), now)?;
    credentials.write(&options.access_file)?;
    Ok(credentials)
}

/// The access file that local workers read.
fn access_path(options: &RunnerOptions) -> &PathBuf {
    options.access.as_ref().unwrap_or(&options.access_file)
}

fn local_workers(options: &RunnerOptions, address: String) -> Result<LocalWorkers, RunError> {
    let command = options.worker_command.clone().map_or_else(WorkerCommand::this_program, Ok);
    let unknown_program = |source| SpawnError { program: "this program".into(), source };
    Ok(LocalWorkers {
        count: options.workers,
        command: command.map_err(unknown_program)?,
        access: access_path(options).clone(),
        log: options.log.clone(),
        address,
        threads: options.threads_per_worker.unwrap_or_else(|| threads_per_worker(options.workers)),
        others_may_come: options.others_may_come(),
        worked: Worked::default(),
    })
}
