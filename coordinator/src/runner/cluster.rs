//! The cluster of a run: listener, connections, local worker processes. Started together, stopped together.

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::SystemTime;

use lookalike::graph::WorkerId;
use lookalike::protocol::{RunName, ToWorker};
use tokio::net::TcpListener;
use tokio::sync::mpsc::{Receiver, channel};
use tokio::task::{JoinHandle, JoinSet};
use tokio_rustls::TlsAcceptor;
use tokio_util::sync::CancellationToken;

use super::{RunError, RunnerOptions};
use crate::access::Credentials;
use crate::rpc::{Gate, Inbound, Mailbox, Outgoing, serve_forever};
use crate::spawn::{LocalWorkers, WorkerCommand, threads_per_worker};
use crate::tls::server_config;

/// How many events may wait for the reactor before the connections have to.
const INBOUND_CAPACITY: usize = 1024;

/// Everything of a run that has to end with it.
#[derive(Debug)]
pub(crate) struct Cluster {
    /// What workers and processes report.
    pub(crate) inbound: Receiver<Inbound>,
    /// What the access file tells workers to connect to.
    pub(crate) address: String,
    members: BTreeMap<WorkerId, Mailbox>,
    stop: CancellationToken,
    serving: JoinHandle<()>,
    local_workers: JoinSet<()>,
}

impl Cluster {
    /// Listen, write the access file or take the one made beforehand, start the local workers.
    pub(crate) async fn start(options: &RunnerOptions, epoch: u64) -> Result<Self, RunError> {
        options.check()?;
        let now = SystemTime::now();
        let given = options.access.as_ref().map(|path| Credentials::read(path, now)).transpose()?;
        let listen = options.listen_address(given.as_ref().map(|given| given.access.address.as_str()))?;
        let listen_error = |source| RunError::Listen { listen, source };
        let listener = TcpListener::bind(listen).await.map_err(listen_error)?;
        let bound = listener.local_addr().map_err(listen_error)?;
        let Credentials { access, identity } = match given {
            Some(given) => given,
            None => new_credentials(options, bound, now)?,
        };
        let tls = server_config(&identity).map_err(RunError::Tls)?;
        let (sender, inbound) = channel(INBOUND_CAPACITY);
        let stop = CancellationToken::new();
        let workers = local_workers(options, RunnerOptions::local_address(bound))?;
        // From here on the drop guard inside `Self` ends what was started.
        let mut run = [0; 16];
        getrandom::fill(&mut run).map_err(RunError::Randomness)?;
        let gate = Gate {
            tls: TlsAcceptor::from(Arc::new(tls)),
            secret: access.secret,
            limits: options.limits,
            run: RunName(run),
            epoch,
            policy: options.policy,
            inbound: sender.clone(),
        };
        let local_workers = workers.start(&sender, &stop)?;
        let serving = tokio::spawn(serve_forever(listener, gate, stop.clone()));
        Ok(Self { inbound, address: access.address, members: BTreeMap::new(), stop, serving, local_workers })
    }

    /// A worker can be sent to from now on.
    pub(crate) fn admit(&mut self, worker: WorkerId, mailbox: Mailbox) {
        self.members.insert(worker, mailbox);
    }

    /// Send to a worker. One that has left meanwhile gets nothing: the reactor will hear of it.
    pub(crate) fn send(&self, worker: WorkerId, outgoing: Outgoing) {
        if let Some(member) = self.members.get(&worker) {
            member.send(outgoing);
        }
    }

    /// Send nothing more to a worker and close its connection, whether or not it has read what was sent before.
    pub(crate) fn dismiss(&mut self, worker: WorkerId) {
        self.members.remove(&worker).into_iter().for_each(|member| member.close());
    }

    /// Tell all workers that the run is over, and wait until connections and local processes are gone.
    pub(crate) async fn stop(mut self, reason: &str) {
        for member in std::mem::take(&mut self.members).into_values() {
            member.send(Outgoing::Message(ToWorker::Stop { reason: reason.to_owned() }));
        }
        self.stop.cancel();
        // A connection or keeper that waits for room would wait for ever.
        self.inbound.close();
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

/// Make credentials for a listener that got this address, and write the access file.
fn new_credentials(options: &RunnerOptions, bound: SocketAddr, now: SystemTime) -> Result<Credentials, RunError> {
    let credentials = Credentials::new(options.advertised(bound), now)?;
    credentials.write(&options.access_file)?;
    Ok(credentials)
}

fn local_workers(options: &RunnerOptions, address: String) -> Result<LocalWorkers, RunError> {
    let command = options.worker_command.clone().map_or_else(WorkerCommand::this_program, Ok);
    let unknown_program = |source| RunError::Spawn { program: "this program".into(), source };
    Ok(LocalWorkers {
        count: options.workers,
        command: command.map_err(unknown_program)?,
        access: options.access.as_ref().unwrap_or(&options.access_file).clone(),
        log: options.log.clone(),
        address,
        threads: options.threads_per_worker.unwrap_or_else(|| threads_per_worker(options.workers)),
        others_may_come: options.others_may_come(),
    })
}
