//! `lookalike-test-cluster`: coordinator and worker in one program, as `lookalike` is, with the nodes of this suite.
//!
//! ```text
//!   lookalike-test-cluster worker --access FILE ...
//!   lookalike-test-cluster gates COUNT ADDRESS WORKERS ACCESS_FILE [UNAUTHENTICATED]
//!   lookalike-test-cluster resume COUNT ADDRESS WORKERS ACCESS_FILE
//!   lookalike-test-cluster false-worker KIND --access FILE ...
//! ```
//! `resume` keeps a journal beside the access file, or resumes the run in it. `false-worker` is a worker for fits whose outputs of one kind of
//! node are wrong by one bit.

use std::io::Write;
use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;

use lookalike_coordinator::journal::{JOURNAL_FILE, JournalOptions, RunIdentity};
use lookalike_coordinator::limits::Limits;
use lookalike_coordinator::runner::{RunError, RunnerOptions, run};

use crate::cluster::policy;
use crate::nodes::{false_registry, registry};
use crate::plan::{Leaves, TestPlanner};

/// The program.
#[must_use]
pub fn main() -> ExitCode {
    let arguments: Vec<_> = std::env::args_os().collect();
    if arguments.get(1).is_some_and(|command| command == "worker") {
        return lookalike_worker::main_from(arguments.into_iter().skip(1), registry());
    }
    if let [_, command, kind, rest @ ..] = &arguments[..]
        && command == "false-worker"
    {
        let arguments = arguments.iter().take(1).chain(rest).cloned();
        return lookalike_worker::main_from(arguments, false_registry(&kind.to_string_lossy()));
    }
    let arguments: Vec<_> = arguments.iter().map(|argument| argument.to_string_lossy().into_owned()).collect();
    let mut limits = Limits::default();
    let [command @ ("gates" | "resume"), count, address, workers, access_file, ref unauthenticated @ ..] =
        arguments[1..].iter().map(String::as_str).collect::<Vec<_>>()[..]
    else {
        return ExitCode::from(2);
    };
    let (Ok(count), Ok(workers)) = (count.parse(), workers.parse()) else {
        return ExitCode::from(2);
    };
    if let Some(Ok(count)) = unauthenticated.first().map(|count| count.parse()) {
        limits.unauthenticated = count;
    }
    let mut options = RunnerOptions { limits, policy: policy(), ..RunnerOptions::new(workers, access_file.into()) };
    if command == "resume" {
        let journal = JournalOptions::new(Path::new(access_file).with_file_name(JOURNAL_FILE), RunIdentity::default());
        options.journal = Some(JournalOptions { resume: true, ..journal });
    }
    match coordinate(Leaves::Gates { count, address: address.to_owned() }, options) {
        Ok(result) => {
            // A write fails if the test has ended meanwhile.
            let _ = writeln!(std::io::stdout(), "{result:?}");
            ExitCode::SUCCESS
        }
        Err(error) => {
            let _ = writeln!(std::io::stderr(), "error: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}

fn coordinate(leaves: Leaves, options: RunnerOptions) -> Result<Option<Vec<u8>>, RunError> {
    let runtime = tokio::runtime::Runtime::new().map_err(RunError::Signals)?;
    let (planner, _) = runtime.block_on(run(options, TestPlanner::new(leaves), Arc::new(registry()), |_| {}))?;
    Ok(planner.result)
}
