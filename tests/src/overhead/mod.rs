//! `lookalike-overhead`: the overhead of the runner, with real worker processes, TLS and the journal.
//!
//! ```text
//!   lookalike-overhead                      every measurement below, each in a process of its own; a table on stderr
//!   lookalike-overhead round-trip [ROUNDS]  rounds of 21 nodes that do no work
//!   lookalike-overhead throughput [NODES]   this many such nodes at once
//!   lookalike-overhead worker-killed [NODES]        how soon the nodes of a worker that gets SIGKILL run elsewhere
//!   lookalike-overhead worker-stopped [NODES]       the same with SIGSTOP
//!   lookalike-overhead coordinator-killed [NODES]   how soon a coordinator that gets SIGKILL is replaced
//! ```
//! Each measurement is one line of JSON on stdout. There are two workers with one thread each. Measure an optimised build.

mod planner;
mod recovery;
mod report;
mod run;

use std::io::Write;
use std::process::{Command, ExitCode};
use std::time::Duration;

use lookalike::graph::{Blob, NodeFailure, NodeType, Registry, RunContext};
use serde_json::Value;

/// How many workers there are.
const WORKERS: usize = 2;

/// How many nodes make one round trip: the number of searches of a fit.
const ROUND: usize = 21;

/// Measurements of what happens when a process is killed or stopped.
const FAULTS: [&str; 3] = ["worker-killed", "worker-stopped", "coordinator-killed"];

/// Errors are printed by the program, which then ends.
type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

/// The program.
#[must_use]
pub fn main() -> ExitCode {
    let arguments: Vec<_> = std::env::args_os().collect();
    if arguments.get(1).is_some_and(|command| command == "worker") {
        return lookalike_worker::main_from(arguments.into_iter().skip(1), registry());
    }
    let arguments: Vec<_> = arguments.iter().skip(1).map(|argument| argument.to_string_lossy().into_owned()).collect();
    let outcome = match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        [] => all(),
        ["round-trip"] => run::round_trip(1000).and_then(|found| print(&found)),
        ["round-trip", rounds] => number(rounds).and_then(run::round_trip).and_then(|found| print(&found)),
        ["throughput"] => run::throughput(10_000).and_then(|found| print(&found)),
        ["throughput", nodes] => number(nodes).and_then(run::throughput).and_then(|found| print(&found)),
        // The process that `coordinator-killed` kills.
        ["coordinate", folder, nodes] => number(nodes).and_then(|nodes| recovery::coordinate(folder.as_ref(), nodes)),
        [fault, ref nodes @ ..] if FAULTS.contains(&fault) => nodes
            .first()
            .map_or(Ok(recovery::NODES), |nodes| number(nodes))
            .and_then(|nodes| match fault {
                "worker-killed" => recovery::worker_is_sent("KILL", nodes),
                "worker-stopped" => recovery::worker_is_sent("STOP", nodes),
                _ => recovery::coordinator_is_killed(nodes),
            })
            .and_then(|found| print(&found)),
        _ => Err("expected no argument, or a measurement: round-trip, throughput, worker-killed, worker-stopped, \
                  coordinator-killed"
            .into()),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            // A write fails if stderr is closed.
            let _ = writeln!(std::io::stderr(), "error: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Every measurement, one after the other.
fn all() -> Result<()> {
    let mut found = Vec::new();
    for arguments in [
        &["round-trip"][..],
        &["throughput", "10000"],
        &["throughput", "100000"],
        &["worker-killed"],
        &["worker-stopped"],
        &["coordinator-killed"],
    ] {
        let output =
            Command::new(std::env::current_exe()?).args(arguments).stderr(std::process::Stdio::inherit()).output()?;
        if !output.status.success() {
            return Err(format!("{} ended with {}", arguments.join(" "), output.status).into());
        }
        let measured: Value = serde_json::from_slice(&output.stdout)?;
        print(&measured)?;
        found.push(measured);
    }
    writeln!(std::io::stderr(), "{}", report::table(&found))?;
    Ok(())
}

fn print(found: &Value) -> Result<()> {
    Ok(writeln!(std::io::stdout(), "{found}")?)
}

fn number(text: &str) -> Result<usize> {
    text.parse().map_err(|_| format!("expected a number, found {text:?}").into())
}

/// The node types of these measurements.
fn registry() -> Registry {
    Registry::default().with(Nothing).with(Pause)
}

/// Does nothing: its output is its parameters.
struct Nothing;

impl NodeType for Nothing {
    fn kind(&self) -> &'static str {
        "nothing"
    }

    fn run(&self, parameters: &[u8], _: &[Blob], _: &RunContext) -> std::result::Result<Vec<u8>, NodeFailure> {
        Ok(parameters.to_vec())
    }
}

/// Sleeps for as long as a short search takes.
struct Pause;

/// The duration of a [`Pause`].
const PAUSE: Duration = Duration::from_millis(20);

impl NodeType for Pause {
    fn kind(&self) -> &'static str {
        "pause"
    }

    fn run(&self, parameters: &[u8], _: &[Blob], _: &RunContext) -> std::result::Result<Vec<u8>, NodeFailure> {
        std::thread::sleep(PAUSE);
        Ok(parameters.to_vec())
    }
}
