//! The worker: connects to a coordinator over TCP and TLS, runs nodes of the job graph on its rayon pool, returns results.
//!
//! Threads: the main thread communicates with the coordinator and never computes; the pool computes and never communicates; one thread
//! triggers heartbeats; with `--leash`, one more watches stdin and ends the process when stdin ends. A worker continues to compute while its
//! connection is broken, and sends unacknowledged results again.
//!
//! The [`Registry`] given to the worker determines which nodes it can run: this crate has no rendering.

mod cache;
pub mod ending;
mod error;
mod execute;
mod options;
mod session;
mod tasks;
pub mod tls;
pub mod wire;
pub mod world;

#[cfg(test)]
mod tests;

use std::ffi::OsString;
use std::io::Write;
use std::process::ExitCode;

use clap::Parser;
use lookalike::graph::Registry;
use tracing_subscriber::EnvFilter;

pub use error::{WorkerError, with_causes};
pub use options::{Arguments, Time, WorkerOptions};

use crate::ending::{Wishes, watch_for_the_end};
use crate::world::{Real, World};

/// Work for one coordinator until it ends the run, or the worker is asked to end (SIGTERM, Ctrl-C, the end of stdin with
/// [`WorkerOptions::is_leashed`]).
///
/// # Errors
/// If the access file is unusable, the coordinator refuses this worker (not retried), or it cannot be reached for
/// [`WorkerOptions::reconnect_for`].
pub fn run(options: &WorkerOptions, registry: Registry) -> Result<(), WorkerError> {
    // One thread is enough for communication; the cores are for the pool.
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().map_err(WorkerError::Runtime)?;
    runtime.block_on(async {
        let wishes = watch_for_the_end(options.is_leashed).map_err(WorkerError::Runtime)?;
        run_in(Real, options, registry, wishes).await
    })
}

/// As [`run`], in any world, on the current runtime; only `wishes` can ask it to end.
///
/// # Errors
/// Those of [`run`].
pub async fn run_in<W: World>(
    world: W,
    options: &WorkerOptions,
    registry: Registry,
    wishes: Wishes,
) -> Result<(), WorkerError> {
    session::run(world, options, registry, wishes).await
}

/// The program `lookalike-worker` with these node types and the process's own command line.
#[must_use]
pub fn main_with(registry: Registry) -> ExitCode {
    main_from(std::env::args_os(), registry)
}

/// The program `lookalike-worker` with these node types and this command line, whose first entry is the program's name:
/// parses it, runs, and prints errors to stderr.
#[must_use]
pub fn main_from(arguments: impl IntoIterator<Item = OsString>, registry: Registry) -> ExitCode {
    let program = match Program::try_parse_from(arguments) {
        Ok(program) => program,
        Err(error) => {
            let is_error = error.use_stderr();
            // If stderr is closed, the error cannot be reported.
            let _ = error.print();
            return ExitCode::from(if is_error { 2 } else { 0 });
        }
    };
    init_tracing(program.log.as_deref());
    run_and_report(&program.arguments.into_options(), registry)
}

/// Run a worker and print its error to stderr. Exit codes: 0 done, 2 bad input or refused, 3 the coordinator was lost.
#[must_use]
pub fn run_and_report(options: &WorkerOptions, registry: Registry) -> ExitCode {
    // A local worker has a coordinator that tells the user.
    if !options.is_leashed
        && let Some(address) = session::address(options)
    {
        let patience = humantime::format_duration(options.reconnect_for);
        print_line(&format!("connecting to the coordinator at {address}, for at most {patience}"));
    }
    match run(options, registry) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            print_line(&format!("error: {}", with_causes(&error)));
            ExitCode::from(error.exit_code())
        }
    }
}

/// Print a line on stderr, in one piece, because other processes write there too. A closed stderr is ignored.
pub fn print_line(text: &str) {
    let _ = std::io::stderr().write_all(format!("{text}\n").as_bytes());
}

/// `lookalike-worker` on its command line.
#[derive(Debug, Parser)]
#[command(
    name = "lookalike-worker",
    version,
    about = "Run nodes of a fit for the coordinator that wrote the access file",
    after_help = "The same as `lookalike worker`. The worker ends when the run ends. Exit codes: 0 the run ended, \
                  2 bad usage or refused, 3 the coordinator was lost."
)]
struct Program {
    #[command(flatten)]
    arguments: Arguments,

    /// What to log to stderr: error, warn, info, debug, trace, or a filter such as `lookalike_worker=debug` [default: RUST_LOG, else warn]
    #[arg(long, value_name = "LEVEL", value_parser = checked_filter)]
    log: Option<String>,
}

/// Returns the text, because clap needs values that can be cloned, and the filter cannot be.
fn checked_filter(text: &str) -> Result<String, String> {
    EnvFilter::try_new(text).map(|_| text.to_owned()).map_err(|error| error.to_string())
}

fn init_tracing(level: Option<&str>) {
    let filter = level.map_or_else(
        || EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new("warn")),
        |level| EnvFilter::try_new(level).unwrap_or_else(|_| EnvFilter::new("warn")),
    );
    // A second subscriber in one process, as in tests, is not an error. A worker must survive the loss of the reader of its stderr.
    let _ = tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(std::io::stderr)
        .log_internal_errors(false)
        .try_init();
}
