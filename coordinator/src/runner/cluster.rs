//! The cluster of a run: listener, connections, local worker processes. Started together, stopped together.

use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::SystemTime;

use lookalike::graph::WorkerId;
use lookalike::protocol::{ProcessName, RunName, ToWorker};
use lookalike_worker::world::World;
use tokio::sync::mpsc::Sender;
use tokio::sync::watch;
use tokio::task::{JoinHandle, JoinSet};
use tokio_rustls::TlsAcceptor;
use tokio_util::sync::CancellationToken;

use super::{RunError, RunnerOptions};
use crate::access::{Credentials, CredentialsError};
use crate::comm::WorkerProcess;
use crate::journal::Past;
use crate::rpc::{Gate, Inbound, Mailbox, Outgoing, serve_forever};
use crate::spawn::{LocalWorkers, Worked, WorkerCommand, is_worker_alive, threads_per_worker};
use crate::tls::server_config;

/// Everything of a run that has to end with it.
#[derive(Debug)]
pub(crate) struct Cluster {
    /// What the access file tells workers to connect to.
    pub(crate) address: String,
    /// Where the coordinator listens.
    pub(crate) bound: SocketAddr,
    /// The processes and mailboxes of the members.
    members: BTreeMap<WorkerId, (WorkerProcess, Mailbox)>,
    worked: Worked,
    /// The process ids of the local members.
    present: watch::Sender<BTreeSet<u32>>,
    /// Local workers of an earlier coordinator that are not wanted any more.
    surplus: BTreeSet<u32>,
    stop: CancellationToken,
    serving: JoinHandle<()>,
    local_workers: JoinSet<()>,
}

/// What a coordinator takes over from an earlier one of its run.
#[derive(Debug)]
pub(crate) struct Takeover {
    /// Where that one listened.
    listen: Option<SocketAddr>,
    /// Its local workers that are still alive.
    orphans: Vec<u32>,
    /// Those of its workers that may come back, from wherever.
    pub(crate) survivors: Vec<ProcessName>,
    /// How many nodes have their results already.
    pub(crate) results: usize,
}

impl Takeover {
    /// What there is to be taken over.
    pub(crate) fn of(past: &Past, options: &RunnerOptions) -> Self {
        let access = access_path(options);
        let local = past.local_workers.iter().copied();
        let orphans = local.filter(|process| is_worker_alive(*process, access)).collect::<Vec<_>>();
        let may_come = |worker: &&WorkerProcess| !worker.is_local || orphans.contains(&worker.id);
        let survivors = past.workers.iter().filter(may_come).map(|worker| worker.name).collect();
        Self { listen: past.listen, survivors, orphans, results: past.results }
    }
}

impl Cluster {
    /// Listen, write the access file or take the one that is there, start the local workers that have not survived.
    pub(crate) async fn start<W: World>(
        world: W,
        options: &RunnerOptions,
        (run, epoch): (RunName, u64),
        takeover: Option<Takeover>,
        inbound: Sender<Inbound>,
    ) -> Result<Self, RunError> {
        let (listener, credentials) = listen(&world, options, takeover.as_ref()).await?;
        let (bound, Credentials { access, identity }) = credentials;
        let tls = server_config(&identity).map_err(RunError::Tls)?;
        let stop = CancellationToken::new();
        let workers = local_workers(options, RunnerOptions::local_address(bound))?;
        let worked = workers.worked.clone();
        // From here on the drop guard inside `Self` ends what was started.
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
        let mut orphans = takeover.map(|takeover| takeover.orphans).unwrap_or_default();
        let surplus = orphans.split_off(orphans.len().min(options.workers)).into_iter().collect();
        let present = watch::Sender::new(BTreeSet::new());
        let local_workers = workers.start(&inbound, &stop, &orphans, &present)?;
        let serving = tokio::spawn(serve_forever(listener, gate, stop.clone()));
        let (address, members) = (access.address, BTreeMap::new());
        Ok(Self { address, bound, members, worked, present, surplus, stop, serving, local_workers })
    }

    /// A worker can be sent to from now on. Whether it is wanted: one that an earlier coordinator had started, and that is one too
    /// many now, is told to end.
    pub(crate) fn admit(&mut self, worker: WorkerId, process: WorkerProcess, mailbox: Mailbox) -> bool {
        if process.is_local && self.surplus.contains(&process.id) {
            mailbox.send(Outgoing::Message(ToWorker::Stop { reason: "fewer workers are wanted now".into() }));
            return false;
        }
        self.members.insert(worker, (process, mailbox));
        if process.is_local {
            self.present.send_modify(|present| _ = present.insert(process.id));
        }
        true
    }

    /// A worker executes a node.
    pub(crate) fn note_work(&self, worker: WorkerId) {
        if let Some((process, _)) = self.members.get(&worker).filter(|(process, _)| process.is_local) {
            self.worked.note(process.id);
        }
    }

    /// Send to a worker. One that has left meanwhile gets nothing: the reactor will hear of it.
    pub(crate) fn send(&self, worker: WorkerId, outgoing: Outgoing) {
        if let Some((_, member)) = self.members.get(&worker) {
            member.send(outgoing);
        }
    }

    /// Send nothing more to a worker and close its connection, whether or not it has read what was sent before.
    pub(crate) fn dismiss(&mut self, worker: WorkerId) {
        if let Some((process, member)) = self.members.remove(&worker) {
            member.close();
            let is_back = self.members.values().any(|(other, _)| other.name == process.name);
            if process.is_local && !is_back {
                self.present.send_modify(|present| _ = present.remove(&process.id));
            }
        }
    }

    /// Tell all workers that the run is over, and wait until connections and local processes are gone.
    pub(crate) async fn stop(mut self, reason: &str) {
        for (_, member) in std::mem::take(&mut self.members).into_values() {
            member.send(Outgoing::Message(ToWorker::Stop { reason: reason.to_owned() }));
        }
        self.stop.cancel();
        let _ = (&mut self.serving).await;
        while self.local_workers.join_next().await.is_some() {}
    }
}

/// Dropped without [`Cluster::stop`], when the run's future is dropped: nothing can be waited for, but everything ends.
/// Dropping the keepers kills their processes.
impl Drop for Cluster {
    fn drop(&mut self) {
        self.stop.cancel();
        self.serving.abort();
    }
}

/// Listen, and have the credentials for it: those made beforehand, those of the earlier coordinator of this run, or new ones.
async fn listen<W: World>(
    world: &W,
    options: &RunnerOptions,
    takeover: Option<&Takeover>,
) -> Result<(W::Listener, (SocketAddr, Credentials)), RunError> {
    let now = SystemTime::now();
    let given = options.access.as_ref().map(|path| Credentials::read(path, now)).transpose()?;
    let earlier = match (&given, takeover) {
        (None, Some(_)) => earlier_credentials(options, now)?,
        _ => None,
    };
    let listen = match (&given, takeover) {
        (None, Some(takeover)) => options.listen_again(takeover.listen),
        _ => options.listen_address(given.as_ref().map(|given| given.access.address.as_str()))?,
    };
    let is_again = takeover.is_some_and(|takeover| takeover.listen == Some(listen));
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

/// The credentials that the earlier coordinator of this run made; `None` if they were removed.
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

/// Credentials that tell workers the present address. As long as it is the same, so is the file, to the byte.
fn at_address(mut earlier: Credentials, options: &RunnerOptions, bound: SocketAddr) -> Result<Credentials, RunError> {
    let address = options.advertised(bound);
    if earlier.access.address != address {
        earlier.access.address = address;
        earlier.write(&options.access_file)?;
    }
    Ok(earlier)
}

/// Make credentials for a listener that got this address, and write the access file.
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
    let unknown_program = |source| RunError::Spawn { program: "this program".into(), source };
    Ok(LocalWorkers {
        count: options.workers,
        command: command.map_err(unknown_program)?,
        access: access_path(options).clone(),
        log: options.log.clone(),
        address,
        threads: options.threads_per_worker.unwrap_or_else(|| threads_per_worker(options.workers)),
        others_may_come: options.others_may_come(),
        worked: Worked::default(),
        may_survive: options.journal.as_ref().is_some_and(|journal| journal.survivors),
    })
}
