//! Warnings as the user sees them: on stderr, one line each; wrapped and coloured only on terminals.

use crate::wrap::wrap;
use std::{
    env,
    io::{self, IsTerminal, Write},
};

/// Shows each warning once, in order, as `warning: ...`.
pub fn show_warnings(warnings: &[String]) {
    let is_terminal = io::stderr().is_terminal();
    let colour = is_terminal && env::var_os("NO_COLOR").is_none_or(|value| value.is_empty());
    let text = render(warnings, colour);
    let text = if is_terminal { wrap(&text) } else { text };
    // A closed stderr cannot be reported anywhere.
    let _ = io::stderr().write_all(text.as_bytes());
}

fn render(warnings: &[String], colour: bool) -> String {
    let (mark, reset) = if colour { ("\x1b[1;33m", "\x1b[0m") } else { ("", "") };
    let is_first = |(i, text): &(usize, &String)| !warnings[..*i].contains(text);
    warnings.iter().enumerate().filter(is_first).map(|(_, text)| format!("{mark}warning:{reset} {text}\n")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_warning_has_its_line_and_repeats_are_dropped() {
        let warnings = ["dark", "noisy", "dark"].map(str::to_owned);
        assert_eq!(render(&warnings, false), "warning: dark\nwarning: noisy\n");
        assert!(render(&warnings, true).starts_with("\x1b[1;33mwarning:\x1b[0m dark"));
    }
}
