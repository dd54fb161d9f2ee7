//! Local workers that have outlived the coordinator that started them, and work for the next one of the run.

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};
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
    /// The access file that it was started with.
    pub(super) access: PathBuf,
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
                if Instant::now() >= until || !is_worker_alive(process, &self.access) {
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
        while is_worker_alive(self.process, &self.access) {
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

/// Whether a process lives and is a local worker of the run with this access file: numbers of processes are used again, perhaps for a
/// worker of somebody else.
pub(crate) fn is_worker_alive(process: u32, access: &Path) -> bool {
    if pid(process).is_none_or(|pid| kill(pid, None).is_err()) {
        return false;
    }
    // Where there is no such file nobody can tell. A process that has ended and was not waited for has an empty one.
    let line = std::fs::read(format!("/proc/{process}/cmdline"));
    let folder = format!("/proc/{process}/cwd");
    line.map_or(cfg!(not(target_os = "linux")), |line| is_worker(&line, folder.as_ref(), access))
}

/// Whether this is the command line of a local worker with this access file, started in this folder.
fn is_worker(line: &[u8], folder: &Path, access: &Path) -> bool {
    let words: Vec<&[u8]> = line.split(|byte| *byte == 0).collect();
    let argument = words.windows(2).find(|pair| pair[0] == b"--access").map(|pair| OsStr::from_bytes(pair[1]));
    let is_same = |argument: &OsStr| {
        // Each coordinator may have said it as seen from its own folder.
        let place = std::fs::canonicalize(folder.join(argument)).ok();
        argument == access.as_os_str() || (place.is_some() && place == std::fs::canonicalize(access).ok())
    };
    words.contains(&b"--leash".as_slice()) && argument.is_some_and(is_same)
}

fn pid(process: u32) -> Option<Pid> {
    i32::try_from(process).ok().filter(|process| *process > 1).map(Pid::from_raw)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_living_worker_is_taken_for_one() {
        let access = Path::new("out/access.json");
        assert!([0, 1, u32::MAX].into_iter().all(|process| !is_worker_alive(process, access)));
        // Alive, but no worker.
        assert_eq!(is_worker_alive(std::process::id(), access), cfg!(not(target_os = "linux")));
    }

    #[test]
    fn worker_of_another_run_is_not_ours() {
        let folder = tempfile::tempdir().unwrap();
        let ours = folder.path().join("access.json");
        std::fs::write(&ours, "{}").unwrap();
        let is_ours = |access: &str, rest: &str| {
            let line = format!("/bin/lookalike\0worker\0--access\0{access}\0--threads\02\0{rest}\0");
            is_worker(line.as_bytes(), folder.path(), &ours)
        };
        assert!(is_ours(ours.to_str().unwrap(), "--leash") && is_ours("./access.json", "--leash"));
        assert!(!is_ours("other/access.json", "--leash"));
        assert!(!is_ours("access.json", "--survive"), "somebody else has started it");
        assert!(!is_worker(b"", folder.path(), &ours));
    }
}
