//! A temporary Slurm cluster of processes on this machine, with its own configuration, keys and ports, separate from the system's.

use lookalike_tests::process::Process;
use std::{
    collections::BTreeSet,
    fmt::Write as _,
    fs,
    io::{BufRead, BufReader},
    net::TcpListener,
    path::{Path, PathBuf},
    process::{Child, ChildStdout, Command, Stdio},
};
use tempfile::TempDir;

/// CPUs that each node reports.
pub(super) const CPUS: usize = 2;

/// A cluster whose nodes are called `node1`, `node2` and so on.
pub(super) struct Cluster {
    folder: TempDir,
    munged: Child,
    controller: Option<Child>,
    nodes: Vec<Option<Child>>,
}

impl Cluster {
    /// A cluster with this many nodes; `None`, with a message, where Slurm is not installed.
    pub(super) fn start(nodes: usize) -> Option<Self> {
        for program in ["munged", "slurmctld", "slurmd", "srun"] {
            if Command::new(program).arg("--version").output().is_err() {
                println!("skipped: {program} is not installed (on Debian: apt-get install slurm-wlm munge)");
                return None;
            }
        }
        let folder = tempfile::tempdir().unwrap();
        for name in ["state", "spool"] {
            fs::create_dir(folder.path().join(name)).unwrap();
        }
        fs::write(folder.path().join("slurm.conf"), configuration(folder.path(), nodes)).unwrap();
        let munged = start_munged(folder.path());
        let mut cluster = Self { folder, munged, controller: None, nodes: (0..nodes).map(|_| None).collect() };
        cluster.controller = Some(cluster.daemon("slurmctld", &["-D", "-c"]));
        for node in 0..nodes {
            cluster.start_node(node);
        }
        Some(cluster)
    }

    /// A command that uses this cluster.
    pub(super) fn command(&self, program: &str) -> Command {
        let mut command = Command::new(program);
        command.env("SLURM_CONF", self.configuration()).stdin(Stdio::null());
        command
    }

    /// Submits `deploy/slurm/lookalike.sbatch` and follows the output of the job.
    pub(super) fn submit(&self, folder: &Path, options: &[&str], line: &str) -> Job {
        let log = self.folder.path().join("job-%j.out");
        let mut command = self.command("sbatch");
        command.args(["--parsable", &format!("--output={}", log.display())]).args(options);
        command.arg(super::super::source("deploy/slurm/lookalike.sbatch")).args(line.split_whitespace());
        command.current_dir(folder).env("LOOKALIKE", env!("CARGO_BIN_EXE_lookalike-under-test"));
        command.env("LOOKALIKE_ADVERTISE", "localhost").env_remove("RUST_LOG");
        let number = number(command);
        Job::follow(number.clone(), &self.folder.path().join(format!("job-{number}.out")))
    }

    /// Submits with the program itself and follows the job's output in its folder of results.
    pub(super) fn submit_with_the_program(&self, folder: &Path, line: &str, out: &str) -> Job {
        let mut command = self.command(env!("CARGO_BIN_EXE_lookalike-under-test"));
        command.args(line.split_whitespace()).current_dir(folder);
        command.env("LOOKALIKE_ADVERTISE", "localhost").env_remove("RUST_LOG");
        let number = number(command);
        Job::follow(number.clone(), &folder.join(out).join(format!("slurm-{number}.out")))
    }

    /// Kills a node and all its processes, as a power failure would.
    pub(super) fn cut(&mut self, node: &str) {
        let index = node.strip_prefix("node").and_then(|number| number.parse::<usize>().ok()).unwrap() - 1;
        end(self.nodes[index].take().expect("a node that lives"));
        let there = self.processes(|environment| environment.contains(&format!("SLURMD_NODENAME={node}")));
        // All are stopped first, because a process that lives longer could report the deaths of others. Children are killed before their
        // parents: each srun has a child that cancels the step when srun dies, and an orphaned group of stopped processes is continued.
        there.iter().for_each(|process| send("STOP", *process));
        there.into_iter().rev().for_each(kill);
    }

    /// Starts a killed node again.
    pub(super) fn start_node(&mut self, index: usize) {
        let name = format!("node{}", index + 1);
        fs::create_dir_all(self.folder.path().join("spool").join(&name)).unwrap();
        self.nodes[index] = Some(self.daemon("slurmd", &["-D", "-N", &name]));
    }

    /// The lines of the controller's log, as they are written.
    pub(super) fn controller_log(&self) -> Lines {
        Lines::follow(&self.folder.path().join("slurmctld.log"))
    }

    fn configuration(&self) -> PathBuf {
        self.folder.path().join("slurm.conf")
    }

    fn daemon(&self, program: &str, arguments: &[&str]) -> Child {
        let log = fs::File::create(self.folder.path().join(format!("{program}.said"))).unwrap();
        let mut command = self.command(program);
        command.args(arguments).stdout(Stdio::null()).stderr(log).spawn().unwrap()
    }

    /// The processes of this cluster's jobs whose environment passes `wanted`, and the step daemons that Slurm runs for them.
    fn processes(&self, wanted: impl Fn(&BTreeSet<String>) -> bool) -> BTreeSet<u32> {
        let ours = format!("SLURM_CONF={}", self.configuration().display());
        let mut found = BTreeSet::new();
        for entry in fs::read_dir("/proc").unwrap().flatten() {
            let Some(process) = entry.file_name().to_str().and_then(|name| name.parse::<u32>().ok()) else { continue };
            // The process has ended or belongs to another user.
            let Ok(bytes) = fs::read(entry.path().join("environ")) else { continue };
            let variables = bytes.split(|byte| *byte == 0).map(|bytes| String::from_utf8_lossy(bytes).into_owned());
            let environment: BTreeSet<String> = variables.collect();
            if environment.contains(&ours)
                && environment.iter().any(|v| v.starts_with("SLURMD_NODENAME="))
                && wanted(&environment)
            {
                found.insert(process);
                found.extend(keeper(process));
            }
        }
        found
    }
}

impl Drop for Cluster {
    fn drop(&mut self) {
        // Daemons first, because they would report missing processes.
        for node in self.nodes.iter_mut().filter_map(Option::take) {
            end(node);
        }
        if let Some(controller) = self.controller.take() {
            end(controller);
        }
        for process in self.processes(|_| true) {
            kill(process);
        }
        let _ = self.munged.kill();
        let _ = self.munged.wait();
    }
}

/// A job and the lines of its output.
pub(super) struct Job {
    pub(super) number: String,
    pub(super) log: Lines,
}

impl Job {
    fn follow(number: String, log: &Path) -> Self {
        Self { number, log: Lines::follow(log) }
    }
}

/// The lines of a growing file, which may not exist yet.
pub(super) struct Lines {
    follower: Child,
    lines: BufReader<ChildStdout>,
    seen: Vec<String>,
}

impl Lines {
    fn follow(path: &Path) -> Self {
        // The time limit keeps a test from hanging for ever.
        let mut command = Command::new("timeout");
        command.args(["400", "tail", "-n", "+1", "-F"]).arg(path).stdout(Stdio::piped()).stderr(Stdio::null());
        let mut follower = command.stdin(Stdio::null()).spawn().expect("timeout and tail of the system");
        let lines = BufReader::new(follower.stdout.take().unwrap());
        Self { follower, lines, seen: Vec::new() }
    }

    /// Waits for a line that contains all of these.
    #[track_caller]
    pub(super) fn wait_for(&mut self, words: &[&str]) -> String {
        loop {
            let mut line = String::new();
            let length = self.lines.read_line(&mut line).unwrap();
            assert!(length > 0, "never said {words:?}:\n{}", self.seen.concat());
            self.seen.push(line.clone());
            if words.iter().all(|word| line.contains(word)) {
                return line;
            }
        }
    }

    /// How many lines so far contain these words.
    pub(super) fn count(&self, words: &str) -> usize {
        self.seen.iter().filter(|line| line.contains(words)).count()
    }
}

impl Drop for Lines {
    fn drop(&mut self) {
        // `timeout` passes SIGTERM on to its `tail`.
        let _ = Command::new("kill").arg(self.follower.id().to_string()).status();
        let _ = self.follower.wait();
    }
}

/// The job number printed by this submission.
fn number(mut command: Command) -> String {
    let output = Process::start(&mut command).output();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap().trim().to_owned()
}

fn start_munged(folder: &Path) -> Child {
    let key = folder.join("munge.key");
    let bytes: Vec<u8> = (0_u8..=127).collect();
    fs::write(&key, bytes).unwrap();
    fs::set_permissions(&key, std::os::unix::fs::PermissionsExt::from_mode(0o400)).unwrap();
    let at = |option: &str, name: &str| format!("{option}={}", folder.join(name).display());
    // Forced, because munged refuses a folder below a shared one for temporary files.
    let arguments = [
        "--foreground".to_owned(),
        "--force".to_owned(),
        at("--key-file", "munge.key"),
        at("--socket", "munge.sock"),
        at("--pid-file", "munged.pid"),
        at("--log-file", "munged.log"),
        at("--seed-file", "munge.seed"),
    ];
    Command::new("munged")
        .args(arguments)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap()
}

/// The configuration of a cluster without cgroups and accounting, whose nodes are down after five seconds of silence.
fn configuration(folder: &Path, nodes: usize) -> String {
    let said = |program: &str, flag: &str| {
        let output = Command::new(program).arg(flag).output().unwrap();
        String::from_utf8(output.stdout).unwrap().trim().to_owned()
    };
    let (host, user) = (said("hostname", "-s"), said("id", "-un"));
    let listeners: Vec<TcpListener> = (0..=nodes).map(|_| TcpListener::bind("127.0.0.1:0").unwrap()).collect();
    let ports: Vec<u16> = listeners.iter().map(|listener| listener.local_addr().unwrap().port()).collect();
    let folder = folder.display();
    let mut text = format!(
        "ClusterName=throwaway\nSlurmctldHost={host}(127.0.0.1)\nSlurmctldPort={controller}\nSlurmUser={user}\nSlurmdUser={user}\n\
         AuthType=auth/munge\nCredType=cred/munge\nAuthInfo=socket={folder}/munge.sock\nProctrackType=proctrack/linuxproc\n\
         TaskPlugin=task/none\nJobAcctGatherType=jobacct_gather/none\nAccountingStorageType=accounting_storage/none\n\
         MpiDefault=none\nSwitchType=switch/none\nSelectType=select/cons_tres\nSelectTypeParameters=CR_Core\n\
         SlurmdParameters=config_overrides\nSchedulerParameters=batch_sched_delay=0,sched_min_interval=0,bf_interval=2\n\
         ReturnToService=2\nSlurmdTimeout=5\nSlurmctldTimeout=5\nMessageTimeout=5\nKillWait=2\n\
         StateSaveLocation={folder}/state\nSlurmdSpoolDir={folder}/spool/%n\nSlurmctldPidFile={folder}/slurmctld.pid\n\
         SlurmdPidFile={folder}/slurmd.%n.pid\nSlurmctldLogFile={folder}/slurmctld.log\nSlurmdLogFile={folder}/slurmd.%n.log\n",
        controller = ports[0],
    );
    for (index, port) in ports[1..].iter().enumerate() {
        let name = index + 1;
        writeln!(
            text,
            "NodeName=node{name} NodeHostname={host} NodeAddr=127.0.0.1 Port={port} CPUs={CPUS} RealMemory=2000"
        )
        .unwrap();
    }
    text + "PartitionName=main Nodes=ALL Default=YES MaxTime=INFINITE State=UP\n"
}

/// The step daemon of a process: its parent of that name.
fn keeper(process: u32) -> Option<u32> {
    let status = fs::read_to_string(format!("/proc/{process}/stat")).ok()?;
    let parent: u32 = status.rsplit_once(')')?.1.split_whitespace().nth(1)?.parse().ok()?;
    let name = fs::read_to_string(format!("/proc/{parent}/comm")).ok()?;
    (name.trim() == "slurmstepd").then_some(parent)
}

fn kill(process: u32) {
    send("KILL", process);
}

fn send(signal: &str, process: u32) {
    // The process may have ended by itself.
    let _ = Command::new("kill").args([&format!("-{signal}"), &process.to_string()]).stderr(Stdio::null()).status();
}

fn end(mut child: Child) {
    let _ = child.kill();
    let _ = child.wait();
}
