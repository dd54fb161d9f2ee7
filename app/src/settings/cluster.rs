//! Where workers come from: local processes, other machines, or both (design section 8).

use anyhow::{Context, bail};
use lookalike_coordinator::policy::Policy;
use std::{fmt, net::SocketAddr, num::NonZeroUsize, path::PathBuf, str::FromStr, thread};

/// Where workers come from and how long a coordinator waits for them.
#[derive(Debug, Clone, PartialEq)]
pub struct ClusterSettings {
    /// Local worker processes to spawn.
    pub workers: Workers,
    /// The log filter of the local workers. `None`: their own default.
    pub log: Option<String>,
    /// Address to listen on. Port 0 lets the system choose. `None`: the loopback interface.
    pub listen: Option<SocketAddr>,
    /// Host and port that the access file gives to workers. `None`: the address listened on.
    pub advertise: Option<Advertise>,
    /// An access file that was created before the run. `None`: the run creates one.
    pub access: Option<PathBuf>,
    /// How workers and nodes are treated.
    pub policy: Policy,
}

/// How many local worker processes to spawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Workers {
    /// One per core that this process may use.
    #[default]
    PerCore,
    /// This many. With 0, only workers on other machines compute.
    Count(usize),
}

impl Default for ClusterSettings {
    /// One local worker per core, reachable from this machine alone.
    fn default() -> Self {
        Self {
            workers: Workers::PerCore,
            log: None,
            listen: None,
            advertise: None,
            access: None,
            policy: Policy::default(),
        }
    }
}

impl ClusterSettings {
    /// The address to listen on for workers that the run does not start. `None` if no address is given and only local workers are
    /// expected, or if the access file has the address.
    #[must_use]
    pub fn listen_for_others(&self) -> Option<SocketAddr> {
        let waits = self.workers.count() == 0 && self.access.is_none();
        self.listen.or_else(|| waits.then(|| SocketAddr::from(([127, 0, 0, 1], 0))))
    }
}

impl Workers {
    /// The number of processes; asks the system how many cores there are.
    #[must_use]
    pub fn count(self) -> usize {
        match self {
            Self::PerCore => thread::available_parallelism().map_or(1, NonZeroUsize::get),
            Self::Count(count) => count,
        }
    }
}

impl FromStr for Workers {
    type Err = anyhow::Error;

    /// A whole number up to 4096, or `auto`.
    fn from_str(text: &str) -> anyhow::Result<Self> {
        match text.parse() {
            Ok(count) if count <= MOST_LOCAL => Ok(Self::Count(count)),
            Ok(_) => bail!("at most {MOST_LOCAL} local workers"),
            Err(_) if text == "auto" => Ok(Self::PerCore),
            Err(_) => bail!("expected a whole number, or auto for one per core"),
        }
    }
}

impl fmt::Display for Workers {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::PerCore => write!(f, "auto"),
            Self::Count(count) => write!(f, "{count}"),
        }
    }
}

/// The host, and perhaps the port, under which workers reach the coordinator.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Advertise {
    /// A name, an IPv4 address, or an IPv6 address without its brackets.
    pub host: String,
    /// The port. `None`: the port of the address listened on.
    pub port: Option<u16>,
}

impl FromStr for Advertise {
    type Err = anyhow::Error;

    /// `HOST`, `HOST:PORT`, `[IPV6]` or `[IPV6]:PORT`.
    fn from_str(text: &str) -> anyhow::Result<Self> {
        let (host, port) = if let Some(rest) = text.strip_prefix('[') {
            let (host, rest) = rest.split_once(']').context("the bracket of the IPv6 address is not closed")?;
            match rest.strip_prefix(':') {
                Some(port) => (host, Some(port)),
                None if rest.is_empty() => (host, None),
                None => bail!("expected [IPV6]:PORT"),
            }
        } else {
            match text.split_once(':') {
                Some((_, port)) if port.contains(':') => bail!("an IPv6 address needs brackets: [{text}]"),
                Some((host, port)) => (host, Some(port)),
                None => (text, None),
            }
        };
        if host.is_empty() || host.contains(char::is_whitespace) {
            bail!("expected HOST or HOST:PORT");
        }
        let port =
            port.map(|port| port.parse().ok().context("the port must be a number from 0 to 65535")).transpose()?;
        Ok(Self { host: host.into(), port })
    }
}

impl fmt::Display for Advertise {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.host.contains(':') {
            write!(f, "[{}]", self.host)?;
        } else {
            f.write_str(&self.host)?;
        }
        self.port.map_or(Ok(()), |port| write!(f, ":{port}"))
    }
}

/// More processes than any machine has cores, most likely a typing error.
const MOST_LOCAL: usize = 4096;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn workers_are_a_count_or_one_per_core() {
        assert_eq!("0".parse::<Workers>().unwrap().count(), 0);
        assert_eq!("3".parse::<Workers>().unwrap(), Workers::Count(3));
        assert!("auto".parse::<Workers>().unwrap().count() >= 1);
        for text in ["-1", "1.5", "many", "5000", ""] {
            assert!(text.parse::<Workers>().is_err(), "{text}");
        }
    }

    #[test]
    fn without_local_workers_the_run_listens_for_others() {
        let with = |workers, access: Option<&str>| {
            let access = access.map(PathBuf::from);
            ClusterSettings { workers: Workers::Count(workers), access, ..ClusterSettings::default() }
        };
        assert_eq!(with(1, None).listen_for_others(), None);
        assert_eq!(with(0, None).listen_for_others(), Some(([127, 0, 0, 1], 0).into()));
        // The access file has the address.
        assert_eq!(with(0, Some("a.json")).listen_for_others(), None);
    }

    #[test]
    fn advertised_addresses_survive_a_round_trip() {
        for text in ["node7", "node7:4100", "10.0.0.1:80", "[fe80::1]", "[fe80::1]:4100"] {
            assert_eq!(text.parse::<Advertise>().unwrap().to_string(), text);
        }
        for text in ["", ":80", "node:port", "node:70000", "fe80::1", "[fe80::1", "[fe80::1]x", "two words"] {
            assert!(text.parse::<Advertise>().is_err(), "{text}");
        }
    }
}
