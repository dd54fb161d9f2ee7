//! Local workers that have outlived the coordinator that started them, and work for the next one of the run.

use std::collections::BTreeSet;
use std::time::Duration;

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use tokio::sync::watch;
use tokio::time::{Instant, sleep, timeout};
use tracing::warn;

use super::FAREWELL_TIME;

/// How long a worker may take to come (back): its longest pause between two attempts to connect, and a little more.
const RETURN_TIME: Duration = Duration::from_secs(6);
/// How often to look whether its process is still there: it is no child of ours, so nobody tells.
const GLANCE: Duration = Duration::from_millis(50);

/// A worker process of an earlier coordinator.
pub(super) struct Orphan {
    pub(super) process: u32,
    /// The processes that are connected.
    pub(super) present: watch::Receiver<BTreeSet<u32>>,
}

impl Orphan {
    /// Wait until another worker has to take its place. Whether it ever worked for us.
    pub(super) async fn replaced(&mut self) -> bool {
        let process = self.process;
        let mut was_here = false;
        loop {
            let until = Instant::now() + RETURN_TIME;
            loop {
                if timeout(GLANCE, self.present.wait_for(|present| present.contains(&process))).await.is_ok() {
                    break;
                }
                if Instant::now() >= until || !is_worker_alive(process) {
                    return was_here;
                }
            }
            was_here = true;
            // An error means that the run is over, and somebody will stop us.
            if self.present.wait_for(|present| !present.contains(&process)).await.is_err() {
                return std::future::pending().await;
            }
        }
    }

    /// Wait for its end; it has been told. When this returns there is no process.
    pub(super) async fn end(self) {
        let until = Instant::now() + FAREWELL_TIME;
        while is_worker_alive(self.process) {
            if Instant::now() >= until {
                warn!(
                    process = self.process,
                    "a local worker of an earlier coordinator does not end by itself: killing it"
                );
                // An error means that it has ended meanwhile.
                let _ = pid(self.process).map(|pid| kill(pid, Signal::SIGKILL));
                return;
            }
            sleep(GLANCE).await;
        }
    }
}

/// Whether a process lives and is a local worker: numbers of processes are used again.
pub(crate) fn is_worker_alive(process: u32) -> bool {
    if pid(process).is_none_or(|pid| kill(pid, None).is_err()) {
        return false;
    }
    // Where there is no such file nobody can tell. A process that has ended and was not waited for has an empty one.
    let line = std::fs::read(format!("/proc/{process}/cmdline"));
    line.map_or(cfg!(not(target_os = "linux")), |line| line.split(|byte| *byte == 0).any(|word| word == b"--leash"))
}

fn pid(process: u32) -> Option<Pid> {
    i32::try_from(process).ok().filter(|process| *process > 1).map(Pid::from_raw)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_living_worker_is_taken_for_one() {
        assert!(!is_worker_alive(0) && !is_worker_alive(1) && !is_worker_alive(u32::MAX));
        // Alive, but no worker.
        assert_eq!(is_worker_alive(std::process::id()), cfg!(not(target_os = "linux")));
    }
}
