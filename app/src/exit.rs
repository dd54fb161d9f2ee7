//! Exit codes, a contract that scripts rely on (design section 10).

use std::{fmt, process::ExitCode};

/// How the program ended. Attached to an error with `.context(Exit::RunFailed)`, it is also that error's heading;
/// an error without one is bad input.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Exit {
    /// Done.
    Done = 0,
    /// Done, but the score of `--max-cssim` was missed.
    MissedMaxCssim = 1,
    /// Bad input or usage.
    BadInput = 2,
    /// The run failed: no workers, a faulty worker or node, a full disk.
    RunFailed = 3,
    /// Some fits of a batch failed, the others are complete.
    SomeFitsFailed = 4,
    /// Interrupted by the user.
    Interrupted = 130,
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit as u8)
    }
}

impl fmt::Display for Exit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Done => "done",
            Self::MissedMaxCssim => "the score of --max-cssim was missed",
            Self::BadInput => "bad input",
            Self::RunFailed => "the run failed",
            Self::SomeFitsFailed => "some fits failed",
            Self::Interrupted => "interrupted",
        })
    }
}

impl std::error::Error for Exit {}
