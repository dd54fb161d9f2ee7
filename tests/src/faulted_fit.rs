//! A real fit under a seeded mix of faults: workers killed, stopped and drained; a worker whose proxy is cut or silent; a coordinator
//! killed and replaced by another, its journal truncated or damaged in between.
//!
//! Faults are a function of the seed and of how many events the coordinator has reported. A seed does not replay exactly, but the same
//! kinds of faults come at about the same events.

use std::collections::BTreeMap;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::mpsc::Receiver;

use lookalike::math::sampling::{key, uniform};
use serde_json::Value;

use crate::PATIENCE;
use crate::journal::{JournalView, damage_an_output, tear};
use crate::process::{Process, signal_if_there};
use crate::proxy::Proxy;

/// How many faults there are in a run, at least and at most.
const FAULTS: (u64, u64) = (4, 9);

/// The most workers that are killed: the coordinator stops replacing one that keeps dying.
const MOST_KILLS: u32 = 5;

/// The most coordinators that are killed.
const MOST_COORDINATORS: u32 = 3;

/// A fit and the seed of its faults.
#[derive(Clone, Debug)]
pub struct FaultedFit<'a> {
    /// The program `lookalike`.
    pub program: &'a str,
    /// A folder with the inputs.
    pub folder: &'a Path,
    /// The part of the command line that determines the result, such as `fit photo.exr --env map.exr`.
    pub arguments: &'a str,
    /// The folder of results, below `folder`.
    pub out: &'a str,
    /// The seed of the faults.
    pub seed: u64,
}

/// What happened in a completed fit.
#[derive(Clone, Debug, Default)]
pub struct Ending {
    /// The faults, and how often each happened.
    pub faults: BTreeMap<&'static str, u32>,
    /// How many coordinators the fit had.
    pub coordinators: u32,
    /// How many outputs were damaged; as many may be computed again.
    pub damaged: u64,
    /// How many nodes were assigned although an earlier coordinator had acknowledged their outputs.
    pub run_twice: u64,
}

/// A kind of fault.
#[derive(Clone, Copy, Debug)]
enum Fault {
    KillWorker,
    StopWorker,
    DrainWorker,
    CutWire,
    SilenceWire,
    KillCoordinator,
}

impl Fault {
    const ALL: [Self; 6] = [
        Self::KillWorker,
        Self::StopWorker,
        Self::DrainWorker,
        Self::CutWire,
        Self::SilenceWire,
        Self::KillCoordinator,
    ];

    fn name(self) -> &'static str {
        match self {
            Self::KillWorker => "worker killed",
            Self::StopWorker => "worker stopped",
            Self::DrainWorker => "worker drained",
            Self::CutWire => "wire cut",
            Self::SilenceWire => "wire silent",
            Self::KillCoordinator => "coordinator killed",
        }
    }
}

impl FaultedFit<'_> {
    /// Run the fit to its end, with two local workers and one behind a proxy.
    ///
    /// # Panics
    /// When it fails, or reports no event for too long.
    #[must_use]
    pub fn run(&self) -> Ending {
        let mut run = Run {
            fit: self,
            ending: Ending::default(),
            chance: 0,
            told: 0,
            next_fault: 0,
            faults_left: 0,
            has_begun: false,
            members: BTreeMap::new(),
            stopped: Vec::new(),
            silent_until: None,
            wire: None,
            remote: None,
            seen: Processes::default(),
        };
        run.faults_left = run.between(FAULTS.0, FAULTS.1);
        run.plan_next();
        while !run.coordinate() {}
        run.ending.run_twice = JournalView::of(&self.out()).run_twice();
        run.ending
    }

    fn out(&self) -> PathBuf {
        self.folder.join(self.out)
    }

    fn command(&self) -> Command {
        let mut command = Command::new(self.program);
        command.args(self.arguments.split_whitespace()).args(["--out", self.out, "--workers", "2", "--resume"]);
        command.args(["--listen", "127.0.0.1:0", "--progress", "json", "--heartbeat", "100ms", "--lost-after", "1s"]);
        command.args(["--drain-time", "2s", "--speculate-after", "500ms"]);
        command.current_dir(self.folder).env_remove("RUST_LOG");
        command
    }
}

struct Run<'a> {
    fit: &'a FaultedFit<'a>,
    ending: Ending,
    /// How many random numbers were drawn.
    chance: u64,
    /// How many events were reported.
    told: u64,
    next_fault: u64,
    faults_left: u64,
    /// Whether this coordinator has assigned a node.
    has_begun: bool,
    /// The processes of the workers, by number.
    members: BTreeMap<u64, u32>,
    /// Processes that were stopped, and the event count at which each continues.
    stopped: Vec<(u32, u64)>,
    silent_until: Option<u64>,
    wire: Option<Proxy>,
    remote: Option<Process>,
    seen: Processes,
}

/// Whether a coordinator continues or was killed.
enum Next {
    Continues,
    Killed,
}

impl Run<'_> {
    /// Run a coordinator until it has ended the run (`true`) or is killed.
    fn coordinate(&mut self) -> bool {
        self.ending.coordinators += 1;
        self.has_begun = false;
        self.members.clear();
        let mut coordinator = Process::start(&mut self.fit.command());
        self.seen.0.push(coordinator.id());
        let log = self.fit.folder.join(format!("{}.{}.log", self.fit.out, self.ending.coordinators));
        let events = coordinator.follow_stderr(File::create(log).expect("a log"));
        while let Some(event) = next(&events) {
            self.heed(&event);
            if event["event"] == "finished" {
                let output = coordinator.output();
                assert_eq!(output.status.code(), Some(0), "the coordinator has said that it has finished");
                return true;
            }
            assert!(event["event"] != "failed", "{event}");
            if let Next::Killed = self.inject_fault_when_due() {
                coordinator.kill();
                self.damage_journal();
                return false;
            }
        }
        panic!("the coordinator has ended without a word: {:?}", coordinator.output());
    }

    /// Record a reported event.
    fn heed(&mut self, event: &Value) {
        self.told += 1;
        let (worker, process) = (event["worker"].as_u64(), event["process"].as_u64());
        let process = process.and_then(|process| u32::try_from(process).ok());
        match (event["event"].as_str(), worker, process) {
            (Some("listening"), ..) => self.lay_wire(event["address"].as_str().expect("an address")),
            (Some("local-worker-started"), _, Some(process)) => self.seen.0.push(process),
            (Some("worker-joined"), Some(worker), Some(process)) => _ = self.members.insert(worker, process),
            (Some("worker-left"), Some(worker), _) => {
                if let Some(process) = self.members.remove(&worker) {
                    // The worker was stopped, or cut off, for longer than its lease.
                    self.stopped
                        .iter_mut()
                        .filter(|(stopped, _)| *stopped == process)
                        .for_each(|(_, until)| *until = 0);
                    if self.remote.as_ref().is_some_and(|remote| remote.id() == process) {
                        self.silent_until = self.silent_until.map(|_| 0);
                    }
                }
            }
            (Some("node-started"), ..) => self.has_begun = true,
            _ => {}
        }
        self.mend();
    }

    /// Connect the proxy to the coordinator's address, now and after each resumption.
    fn lay_wire(&mut self, coordinator: &str) {
        self.wire.get_or_insert_with(|| Proxy::to(coordinator));
    }

    /// Continue the processes that were stopped for long enough, and start another remote worker when one has ended.
    fn mend(&mut self) {
        let told = self.told;
        for (process, _) in self.stopped.extract_if(.., |(_, until)| *until <= told) {
            self.seen.signal(process, "CONT");
        }
        if let (Some(wire), Some(_)) = (&self.wire, self.silent_until.take_if(|until| *until <= told)) {
            wire.heal();
        }
        let is_missing = self.remote.as_mut().is_none_or(Process::has_ended);
        if let Some(wire) = self.wire.as_ref().filter(|_| is_missing) {
            let mut command = Command::new(self.fit.program);
            command.args(["worker", "--threads", "1", "--address", &wire.address(), "--access"]);
            let remote = Process::start(command.arg(self.fit.out().join("access.json")));
            self.seen.0.push(remote.id());
            self.remote = Some(remote);
        }
    }

    /// Cause the next fault when its time has come.
    fn inject_fault_when_due(&mut self) -> Next {
        if !self.has_begun || self.faults_left == 0 || self.told < self.next_fault {
            return Next::Continues;
        }
        self.faults_left -= 1;
        self.plan_next();
        let fault = Fault::ALL[self.index(Fault::ALL.len())];
        if self.is_enough(fault) {
            return Next::Continues;
        }
        let victim = self.victim();
        match (fault, victim) {
            (Fault::KillWorker, Some(process)) => self.seen.signal(process, "KILL"),
            (Fault::DrainWorker, Some(process)) => self.seen.signal(process, "TERM"),
            (Fault::StopWorker, Some(process)) => {
                self.seen.signal(process, "STOP");
                let until = self.told + self.between(2, 30);
                self.stopped.push((process, until));
            }
            (Fault::CutWire, _) => self.wire.iter().for_each(Proxy::cut),
            (Fault::SilenceWire, _) => {
                self.wire.iter().for_each(Proxy::silence);
                self.silent_until = Some(self.told + self.between(2, 30));
            }
            (Fault::KillCoordinator, _) => {
                self.count(fault.name());
                return Next::Killed;
            }
            (_, None) => return Next::Continues,
        }
        self.count(fault.name());
        Next::Continues
    }

    /// A random worker that is not stopped.
    fn victim(&mut self) -> Option<u32> {
        let is_stopped = |process: &u32| self.stopped.iter().any(|(stopped, _)| stopped == process);
        let running: Vec<u32> = self.members.values().copied().filter(|process| !is_stopped(process)).collect();
        let index = self.index(running.len().max(1));
        running.get(index).copied()
    }

    fn is_enough(&self, fault: Fault) -> bool {
        let most = match fault {
            Fault::KillWorker | Fault::DrainWorker => MOST_KILLS,
            Fault::KillCoordinator => MOST_COORDINATORS,
            _ => u32::MAX,
        };
        self.ending.faults.get(fault.name()).is_some_and(|count| *count >= most)
    }

    /// Damage the journal as a power failure or a bad disk may.
    fn damage_journal(&mut self) {
        let (out, lot) = (self.fit.out(), self.random());
        if lot < 0.4 {
            let share = self.random();
            let _ = tear(&out, share);
            self.count("journal torn");
        } else if lot < 0.6 {
            let choice = self.between(0, u64::from(u32::MAX));
            if damage_an_output(&out, choice) {
                self.ending.damaged += 1;
                self.count("output damaged");
            }
        }
    }

    fn count(&mut self, what: &'static str) {
        *self.ending.faults.entry(what).or_default() += 1;
    }

    fn plan_next(&mut self) {
        self.next_fault = self.told + self.between(1, 12);
    }

    fn random(&mut self) -> f64 {
        self.chance += 1;
        uniform(key(&[self.fit.seed, self.chance]))
    }

    /// A whole number from `least` to `most`.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small number, 0 or more")]
    fn between(&mut self, least: u64, most: u64) -> u64 {
        least + (self.random() * (most - least + 1) as f64) as u64
    }

    fn index(&mut self, length: usize) -> usize {
        usize::try_from(self.between(0, length as u64 - 1)).unwrap_or(0)
    }
}

/// The next event; `None` when the process has ended.
fn next(events: &Receiver<Value>) -> Option<Value> {
    match events.recv_timeout(PATIENCE) {
        Ok(event) => Some(event),
        Err(std::sync::mpsc::RecvTimeoutError::Disconnected) => None,
        Err(std::sync::mpsc::RecvTimeoutError::Timeout) => panic!("lost: nothing was heard for {PATIENCE:?}"),
    }
}

/// All processes ever started; dropping this kills those that remain.
#[derive(Debug, Default)]
struct Processes(Vec<u32>);

impl Processes {
    /// Signal a process, which may have ended meanwhile.
    fn signal(&self, process: u32, name: &str) {
        // It may end between the question and the signal.
        let _ = is_worker(process) && signal_if_there(process, name);
    }
}

impl Drop for Processes {
    fn drop(&mut self) {
        for process in self.0.iter().filter(|process| is_worker(**process)) {
            signal_if_there(*process, "KILL");
        }
    }
}

/// Whether a process exists and is a worker; process ids are reused.
fn is_worker(process: u32) -> bool {
    let line = std::fs::read(format!("/proc/{process}/cmdline")).unwrap_or_default();
    line.split(|byte| *byte == 0).any(|word| word == b"--access")
}
