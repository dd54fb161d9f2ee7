//! The options of a run.

use std::net::{Ipv4Addr, SocketAddr};
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::sync::Arc;

use tokio::sync::Notify;

use super::{Pulse, RunError};
use crate::journal::JournalOptions;
use crate::limits::Limits;
use crate::policy::Policy;
use crate::spawn::WorkerCommand;

/// The options of a run.
#[derive(Clone, Debug)]
pub struct RunnerOptions {
    /// How many local worker processes to start; 0 to 4096.
    pub workers: usize,
    /// The threads of each local worker; `None` divides the cores among them.
    pub threads_per_worker: Option<NonZeroUsize>,
    /// The command that starts a local worker; `None` starts this program as `worker`.
    pub worker_command: Option<WorkerCommand>,
    /// The log filter of local workers, as `--log` takes it; `None` uses their default.
    pub log: Option<String>,
    /// The address to listen on for other workers; `None` listens on any free port of the loopback interface, for local workers
    /// only.
    pub listen: Option<SocketAddr>,
    /// The address in the access file, as `HOST` or `HOST:PORT`; `None` uses the address listened on.
    pub advertise: Option<String>,
    /// Where to write the access file, with the coordinator's key beside it. The folder must exist.
    pub access_file: PathBuf,
    /// An access file made beforehand, with its key beside it, to use instead of writing one. Workers may have it already.
    pub access: Option<PathBuf>,
    /// The bounds on connections.
    pub limits: Limits,
    /// The rules for workers and nodes.
    pub policy: Policy,
    /// The journal, from which the run can be resumed; `None` for no journal.
    pub journal: Option<JournalOptions>,
    /// Notified when the planner should [look again](lookalike::graph::Planner::look_again); `None` for never.
    pub wake: Option<Arc<Notify>>,
    /// Updated about once a second while the loop of the run makes progress.
    pub pulse: Option<Arc<Pulse>>,
    /// Whether Ctrl-C and SIGTERM stop the run in order, with [`RunError::Interrupted`].
    pub handle_signals: bool,
}

impl RunnerOptions {
    /// Options with `workers` local workers, the access file, no journal, and otherwise the defaults of design section 8.
    #[must_use]
    pub fn new(workers: usize, access_file: PathBuf) -> Self {
        Self {
            workers,
            threads_per_worker: None,
            worker_command: None,
            log: None,
            listen: None,
            advertise: None,
            access_file,
            access: None,
            limits: Limits::default(),
            policy: Policy::default(),
            journal: None,
            wake: None,
            pulse: None,
            handle_signals: true,
        }
    }

    /// The address to listen on. An access file made beforehand tells workers to connect to `told`. Without
    /// [`listen`](Self::listen), it is always an address of the loopback interface.
    pub(crate) fn listen_address(&self, told: Option<&str>) -> Result<SocketAddr, RunError> {
        match (self.listen, told) {
            (Some(listen), Some(address)) if listen.port() == 0 => {
                Err(RunError::ListenWhere { address: address.to_owned() })
            }
            (Some(listen), _) => Ok(listen),
            (None, None) => Ok(SocketAddr::from((Ipv4Addr::LOCALHOST, 0))),
            (None, Some(address)) => {
                let local = address.replacen("localhost:", "127.0.0.1:", 1).parse::<SocketAddr>().ok();
                let local = local.filter(|local| local.ip().is_loopback() && local.port() != 0);
                local.ok_or_else(|| RunError::ListenWhere { address: address.to_owned() })
            }
        }
    }

    /// The address to listen on for a resumed run whose earlier coordinator listened at `before`: the same, so that its workers
    /// find it, unless the user names another port.
    pub(crate) fn listen_again(&self, before: Option<SocketAddr>) -> SocketAddr {
        let anywhere = SocketAddr::from((Ipv4Addr::LOCALHOST, 0));
        match (self.listen, before) {
            (Some(listen), Some(before)) if listen.port() == 0 && listen.ip() == before.ip() => before,
            (Some(listen), _) => listen,
            (None, before) => before.unwrap_or(anywhere),
        }
    }

    /// Whether workers may join that this run does not start.
    pub(crate) fn others_may_come(&self) -> bool {
        self.listen.is_some() || self.access.is_some()
    }

    /// Check that the policy is valid, and that some worker can join and knows the address.
    pub(crate) fn check(&self) -> Result<(), RunError> {
        self.policy.check()?;
        if self.workers == 0 && !self.others_may_come() {
            return Err(RunError::NoWorkersPossible);
        }
        match self.listen {
            Some(listen) if listen.ip().is_unspecified() && self.advertise.is_none() && self.access.is_none() => {
                Err(RunError::NothingToAdvertise { listen })
            }
            _ => Ok(()),
        }
    }

    /// The address for the access file, for a listener that got `bound`.
    pub(crate) fn advertised(&self, bound: SocketAddr) -> String {
        match &self.advertise {
            None => bound.to_string(),
            Some(advertise) if has_port(advertise) => advertise.clone(),
            Some(host) => format!("{host}:{}", bound.port()),
        }
    }

    /// The address for local workers, for a listener that got `bound`.
    pub(crate) fn local_address(bound: SocketAddr) -> String {
        let mut local = bound;
        if bound.ip().is_unspecified() {
            local.set_ip(if bound.is_ipv4() {
                Ipv4Addr::LOCALHOST.into()
            } else {
                std::net::Ipv6Addr::LOCALHOST.into()
            });
        }
        local.to_string()
    }
}

/// `host:4000` and `[::1]:4000` have a port; `host`, `[::1]` and `::1` have none.
fn has_port(address: &str) -> bool {
    let is_bare_ipv6 = address.parse::<std::net::Ipv6Addr>().is_ok();
    !is_bare_ipv6 && address.rsplit_once(':').is_some_and(|(_, port)| port.parse::<u16>().is_ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn options(workers: usize, listen: Option<&str>, advertise: Option<&str>) -> RunnerOptions {
        let listen = listen.map(|address| address.parse().unwrap());
        let advertise = advertise.map(str::to_owned);
        RunnerOptions { listen, advertise, ..RunnerOptions::new(workers, "access.json".into()) }
    }

    #[test]
    fn run_that_workers_cannot_join_is_refused() {
        let error = options(0, None, None).check().unwrap_err();
        assert!(error.to_string().contains("use --workers N or --listen ADDR"), "{error}");
        assert_eq!(error.exit_code(), 2);
        assert!(options(1, None, None).check().is_ok());
        assert!(options(0, Some("127.0.0.1:0"), None).check().is_ok());
        let error = options(1, Some("0.0.0.0:4000"), None).check().unwrap_err();
        assert!(error.to_string().contains("add --advertise"), "{error}");
        assert!(options(1, Some("[::]:4000"), Some("host")).check().is_ok());
    }

    #[test]
    fn default_address_is_loopback_only() {
        let nowhere = options(1, None, None);
        assert_eq!(nowhere.listen_address(None).unwrap().to_string(), "127.0.0.1:0");
        assert_eq!(nowhere.listen_address(Some("127.0.0.1:4100")).unwrap().to_string(), "127.0.0.1:4100");
        assert_eq!(nowhere.listen_address(Some("localhost:4100")).unwrap().to_string(), "127.0.0.1:4100");
        assert_eq!(nowhere.listen_address(Some("[::1]:4100")).unwrap().to_string(), "[::1]:4100");
        for elsewhere in ["node7:4100", "10.0.0.1:4100", "0.0.0.0:4100", "127.0.0.1:0"] {
            let error = nowhere.listen_address(Some(elsewhere)).unwrap_err();
            assert!(error.to_string().contains("--listen IP:PORT"), "{error}");
        }
        let somewhere = options(0, Some("0.0.0.0:4100"), None);
        assert_eq!(somewhere.listen_address(Some("node7:30100")).unwrap().to_string(), "0.0.0.0:4100");
        assert!(options(0, Some("10.0.0.1:0"), None).listen_address(Some("node7:4100")).is_err());
        let beforehand = RunnerOptions { access: Some("a.json".into()), ..options(0, Some("0.0.0.0:4100"), None) };
        assert!(beforehand.check().is_ok());
    }

    #[test]
    fn resumed_run_listens_on_the_same_port_unless_another_is_given() {
        let before: SocketAddr = "127.0.0.1:4100".parse().unwrap();
        let again = |listen| options(1, listen, None).listen_again(Some(before)).to_string();
        assert_eq!(again(None), "127.0.0.1:4100");
        assert_eq!(again(Some("127.0.0.1:0")), "127.0.0.1:4100");
        assert_eq!(again(Some("127.0.0.1:4200")), "127.0.0.1:4200");
        assert_eq!(again(Some("10.0.0.1:0")), "10.0.0.1:0");
        assert_eq!(options(1, None, None).listen_again(None).to_string(), "127.0.0.1:0");
    }

    #[test]
    fn advertised_address_without_a_port_gets_the_port_of_the_listener() {
        let bound = "0.0.0.0:4000".parse().unwrap();
        let advertised = |advertise| options(0, None, advertise).advertised(bound);
        assert_eq!(advertised(Some("node7")), "node7:4000");
        assert_eq!(advertised(Some("node7:5")), "node7:5");
        assert_eq!(advertised(Some("[::1]")), "[::1]:4000");
        assert_eq!(advertised(None), "0.0.0.0:4000");
        assert_eq!(RunnerOptions::local_address(bound), "127.0.0.1:4000");
        assert_eq!(RunnerOptions::local_address("[::]:4000".parse().unwrap()), "[::1]:4000");
    }
}
