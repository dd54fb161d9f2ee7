//! Finds the positional arguments of a command line before clap parses it, from the grammar.

use clap::{Arg, Command};
use std::ffi::OsString;

/// The place of the subcommand's name among the tokens (program name first), with its grammar.
pub(crate) fn subcommand<'g>(grammar: &'g Command, tokens: &[OsString]) -> Option<(usize, &'g Command)> {
    let first = *positionals(grammar, tokens, 1).first()?;
    Some((first, grammar.find_subcommand(&tokens[first])?))
}

/// The tokens without the program's name, and with the subcommand's name before flags that may precede it, such as `--log`.
pub(crate) fn subcommand_first(grammar: &Command, tokens: &[OsString]) -> Vec<OsString> {
    let Some((place, _)) = subcommand(grammar, tokens) else { return tokens.iter().skip(1).cloned().collect() };
    [&tokens[place..=place], &tokens[1..place], &tokens[place + 1..]].concat()
}

/// The indices, from `start`, of tokens that are neither flags nor values of flags.
pub(crate) fn positionals(grammar: &Command, tokens: &[OsString], start: usize) -> Vec<usize> {
    let (mut found, mut value_follows, mut flags_are_over) = (Vec::new(), false, false);
    for (i, token) in tokens.iter().enumerate().skip(start) {
        let text = token.to_string_lossy();
        if flags_are_over {
            found.push(i);
        } else if value_follows {
            value_follows = false;
        } else if text == "--" {
            flags_are_over = true;
        } else if text.len() > 1 && text.starts_with('-') {
            value_follows = wants_next_token(grammar, &text);
        } else {
            found.push(i);
        }
    }
    found
}

/// Whether the flag takes a value that is not in the same token, as in `--seed 3` and `-o FILE`.
fn wants_next_token(grammar: &Command, flag: &str) -> bool {
    let is_this = |arg: &&Arg| match flag.strip_prefix("--") {
        Some(long) => arg.get_long() == Some(long),
        None => flag.len() == 2 && arg.get_short() == flag.chars().nth(1),
    };
    grammar.get_arguments().find(is_this).is_some_and(|arg| arg.get_action().takes_values())
}
