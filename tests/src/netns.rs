//! A network namespace for a worker with two cables to this machine; a test can cut one of them.
//!
//! ```text
//!   this machine ---- line ----- worker's namespace     between worker and coordinator; tests cut it
//!                ---- control --                        between nodes and test; never cut
//! ```
//! Needs root and iproute2. One direction is silenced by a wrong hardware address for the other end: packets leave and are not received.
//! This needs no packet filter.

use std::net::IpAddr;
use std::path::Path;
use std::process::Command;
use std::sync::atomic::{AtomicU32, Ordering};

/// A namespace; dropping it ends all its processes and removes it.
#[derive(Debug)]
pub struct Namespace {
    name: String,
    line: Cable,
    control: Cable,
}

/// A pair of interfaces. The addresses are those of RFC 2544, which no network uses.
#[derive(Debug)]
struct Cable {
    /// The interface at this machine's end.
    here: String,
    /// The interface at the namespace's end.
    there: String,
    near: String,
    far: String,
}

/// A hardware address that no interface has.
const NOBODY: &str = "02:00:00:00:00:01";

impl Namespace {
    /// Create a namespace; where that is impossible, `None`, with the reason on stderr.
    #[must_use]
    pub fn new() -> Option<Self> {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        // Other test processes have other ids; the lowest 12 bits are used.
        let (number, serial) = (std::process::id() & 0xfff, COUNT.fetch_add(1, Ordering::Relaxed));
        let name = format!("lk{number}-{serial}");
        if let Err(why) = try_ip(&format!("netns add {name}")) {
            skip(&why);
            return None;
        }
        // Sixteen cables for each process: more than its tests use at a time.
        let cable = |kind: &str, index: u32| Cable::new(&name, kind, number_of(number, serial * 2 + index));
        let namespace = Self { line: cable("l", 0), control: cable("c", 1), name };
        let laid = namespace.line.lay(&namespace.name).and_then(|()| namespace.control.lay(&namespace.name));
        match laid {
            Ok(()) => Some(namespace),
            Err(why) => {
                skip(&why);
                None
            }
        }
    }

    /// This machine's address on the line, where the coordinator must listen.
    ///
    /// # Panics
    /// Never.
    #[must_use]
    pub fn line(&self) -> IpAddr {
        self.line.near.parse().expect("an address")
    }

    /// This machine's address on the control cable, where a gate must listen.
    ///
    /// # Panics
    /// Never.
    #[must_use]
    pub fn control(&self) -> IpAddr {
        self.control.near.parse().expect("an address")
    }

    /// A command that runs in the namespace. The process is that of the program itself.
    #[must_use]
    pub fn command(&self, program: impl AsRef<Path>) -> Command {
        let mut command = Command::new("ip");
        command.args(["netns", "exec", &self.name]).arg(program.as_ref());
        command
    }

    /// Cut the line: silence in both directions, and no end of the connection.
    ///
    /// # Panics
    /// When the command fails.
    pub fn cut(&self) {
        ip(&format!("link set {} down", self.line.here));
    }

    /// Restore the line.
    ///
    /// # Panics
    /// When the command fails.
    pub fn heal(&self) {
        ip(&format!("link set {} up", self.line.here));
    }

    /// Drop what the namespace sends on the line; the other direction works.
    ///
    /// # Panics
    /// When the command fails.
    pub fn mute(&self) {
        let Cable { near, there, .. } = &self.line;
        ip(&format!("-n {} neigh replace {near} lladdr {NOBODY} dev {there} nud permanent", self.name));
    }

    /// Drop what this machine sends on the line; the other direction works.
    ///
    /// # Panics
    /// When the command fails.
    pub fn deafen(&self) {
        let Cable { far, here, .. } = &self.line;
        ip(&format!("neigh replace {far} lladdr {NOBODY} dev {here} nud permanent"));
    }

    /// Undo [`mute`](Self::mute) and [`deafen`](Self::deafen).
    ///
    /// # Panics
    /// When neither was done.
    pub fn hear(&self) {
        let Cable { here, there, near, far } = &self.line;
        let ends = [format!("neigh del {far} dev {here}"), format!("-n {} neigh del {near} dev {there}", self.name)];
        let undone = ends.map(|end| try_ip(&end).is_ok());
        assert!(undone.contains(&true), "the line was well");
    }
}

impl Drop for Namespace {
    fn drop(&mut self) {
        // Its processes keep a namespace alive.
        let pids = Command::new("ip").args(["netns", "pids", &self.name]).output();
        let pids = pids.map(|output| String::from_utf8_lossy(&output.stdout).into_owned()).unwrap_or_default();
        for process in pids.split_whitespace() {
            let _ = Command::new("kill").args(["-KILL", process]).status();
        }
        // Cables in the namespace are removed with it; cables that were never moved into it have to be deleted.
        for cable in [&self.line, &self.control] {
            let _ = try_ip(&format!("link del {}", cable.here));
        }
        let _ = try_ip(&format!("netns del {}", self.name));
    }
}

/// The number of a cable among all; there are addresses for 32768 cables.
fn number_of(process: u32, serial: u32) -> u32 {
    (process & 0x7ff) * 16 + serial % 16
}

impl Cable {
    /// The cable of this number; each has four addresses of 198.18.0.0/15.
    fn new(namespace: &str, kind: &str, number: u32) -> Self {
        let address = |host: u32| {
            let [_, b, c, d] = (0xc612_0000 + number * 4 + host).to_be_bytes();
            format!("198.{b}.{c}.{d}")
        };
        let here = format!("{namespace}{kind}");
        Self { here, there: format!("{kind}0"), near: address(1), far: address(2) }
    }

    fn lay(&self, namespace: &str) -> Result<(), String> {
        let Self { here, there, near, far } = self;
        try_ip(&format!("link add {here} type veth peer name {there} netns {namespace}"))?;
        try_ip(&format!("addr add {near}/30 dev {here}"))?;
        try_ip(&format!("link set {here} up"))?;
        try_ip(&format!("-n {namespace} addr add {far}/30 dev {there}"))?;
        try_ip(&format!("-n {namespace} link set {there} up"))
    }
}

#[expect(clippy::print_stdout, reason = "a test says what it skips")]
fn skip(why: &str) {
    println!("skipped: cannot make a network namespace here (needs root and iproute2): {}", why.trim());
}

fn ip(arguments: &str) {
    if let Err(why) = try_ip(arguments) {
        panic!("ip {arguments}: {why}");
    }
}

fn try_ip(arguments: &str) -> Result<(), String> {
    let output = Command::new("ip").args(arguments.split_whitespace()).output().map_err(|error| error.to_string())?;
    match output.status.success() {
        true => Ok(()),
        false => Err(String::from_utf8_lossy(&output.stderr).into_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn cables_of_neighbouring_processes_have_different_addresses() {
        let cables = (0..3).flat_map(|process| (0..16).map(move |serial| number_of(process, serial)));
        assert_eq!(cables.map(|number| Cable::new("n", "l", number).near).collect::<BTreeSet<_>>().len(), 48);
        let last = Cable::new("n", "l", number_of(u32::MAX, 15));
        assert_eq!((last.near.as_str(), last.far.as_str()), ("198.19.255.253", "198.19.255.254"));
    }
}
