//! Errors as the user sees them: on stderr, the cause chain one line each; wrapped and coloured only on terminals.

use crate::{exit::Exit, wrap::wrap};
use std::{
    env,
    io::{self, IsTerminal, Write},
    process::ExitCode,
};

/// Reports the error and returns the exit code. Help and version, which clap returns as errors, go to stdout with code 0.
pub(crate) fn failure(error: &anyhow::Error) -> ExitCode {
    if let Some(error) = error.downcast_ref::<clap::Error>() {
        // A closed pipe behind `lookalike --help | head` is not worth an error.
        let _ = error.print();
        return if error.exit_code() == 0 { Exit::Done.into() } else { Exit::BadInput.into() };
    }
    let is_terminal = io::stderr().is_terminal();
    let colour = is_terminal && env::var_os("NO_COLOR").is_none_or(|value| value.is_empty());
    let text = render(error, colour);
    // In a log, each cause stays on one line, so that a search finds it.
    let text = if is_terminal { wrap(&text) } else { text };
    // A closed stderr cannot be reported anywhere.
    let _ = io::stderr().write_all(text.as_bytes());
    error.downcast_ref::<Exit>().copied().unwrap_or(Exit::BadInput).into()
}

/// `error: ...`, then a line `caused by: ...` for each cause.
fn render(error: &anyhow::Error, colour: bool) -> String {
    let (mark, reset) = if colour { ("\x1b[1;31m", "\x1b[0m") } else { ("", "") };
    let mut text = format!("{mark}error:{reset} {error}\n");
    for cause in error.chain().skip(1) {
        text.push_str(&format!("  {mark}caused by:{reset} {cause}\n"));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::anyhow;

    #[test]
    fn each_cause_has_its_line_and_no_backtrace() {
        let error = anyhow!("no such file").context("cannot read the photo").context(Exit::RunFailed);
        let expected = "error: the run failed\n  caused by: cannot read the photo\n  caused by: no such file\n";
        assert_eq!(render(&error, false), expected);
        assert!(render(&error, true).starts_with("\x1b[1;31merror:\x1b[0m "));
    }

    #[test]
    fn exit_code_is_that_of_the_context_or_bad_input() {
        let marked = anyhow!("no worker").context(Exit::RunFailed).context("the fit of a.exr");
        assert_eq!(failure(&marked), ExitCode::from(3));
        assert_eq!(failure(&anyhow!("anything")), ExitCode::from(2));
    }
}
