//! All problems of an input, reported together.

use std::fmt;

/// Problems, one line each, as one error.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Problems {
    what: String,
    lines: Vec<String>,
}

/// How many are shown; the rest is counted.
const MOST_SHOWN: usize = 50;

impl Problems {
    /// Succeeds if there are no problems with `what`.
    ///
    /// # Errors
    /// All problems, each once.
    pub(crate) fn check(problems: Vec<String>, what: &str) -> anyhow::Result<()> {
        let mut lines: Vec<String> = Vec::new();
        for problem in problems {
            if !lines.contains(&problem) {
                lines.push(problem);
            }
        }
        if lines.is_empty() { Ok(()) } else { Err(Self { what: what.to_owned(), lines }.into()) }
    }
}

impl fmt::Display for Problems {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let [only] = &self.lines[..] {
            return f.write_str(only);
        }
        write!(f, "{}: {} problems", self.what, self.lines.len())?;
        for line in self.lines.iter().take(MOST_SHOWN) {
            write!(f, "\n  {line}")?;
        }
        match self.lines.len().checked_sub(MOST_SHOWN) {
            None | Some(0) => Ok(()),
            Some(more) => write!(f, "\n  and {more} more"),
        }
    }
}

impl std::error::Error for Problems {}
