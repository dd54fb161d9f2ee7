//! Rewrites an argument list: a TOML file is replaced by the flags that it contains.

use super::{config, tokens};
use anyhow::bail;
use clap::{Args, Command, parser::ValueSource};
use std::{ffi::OsString, path::Path};

/// Replaces `command FILE.toml` by the flags and positional arguments in that file. The user's flags follow the
/// file's and so override them; the user's positional arguments replace the file's, from the first. Lists
/// without a TOML file, and commands whose own argument is a TOML file, are returned unchanged.
///
/// # Errors
/// If there are two TOML files, or the file cannot be read or understood.
pub(crate) fn expand_config(grammar: &Command, mut argv: Vec<OsString>) -> anyhow::Result<Vec<OsString>> {
    let Some((place, command)) = tokens::subcommand(grammar, &argv) else { return Ok(argv) };
    if takes_manifest(command) {
        return Ok(argv);
    }
    let is_toml = |&i: &usize| Path::new(&argv[i]).extension().is_some_and(|extension| extension == "toml");
    let positionals = tokens::positionals(command, &argv, place + 1);
    let files: Vec<usize> = positionals.iter().copied().filter(is_toml).collect();
    let file = match files[..] {
        [] => return Ok(argv),
        [file] => argv.remove(file),
        _ => bail!("two settings files, {:?} and {:?}; give at most one", argv[files[0]], argv[files[1]]),
    };
    let config = config::read(command, Path::new(&file))?;
    let given = positionals.len() - 1;
    if !argv.iter().any(|token| token == "--") {
        argv.push("--".into());
    }
    for (expected, (place, value)) in (given + 1..).zip(config.positionals.range(given + 1..)) {
        if *place != expected {
            bail!(
                "{}: the positional argument before {value:?} is missing; give it here or on the command line",
                file.display()
            );
        }
        argv.push(value.clone());
    }
    argv.splice(place + 1..place + 1, config.flags);
    Ok(argv)
}

/// Inserts flags right after the subcommand's name, before all others.
pub(crate) fn insert_flags(grammar: &Command, mut argv: Vec<OsString>, flags: Vec<OsString>) -> Vec<OsString> {
    if let Some((place, _)) = tokens::subcommand(grammar, &argv) {
        argv.splice(place + 1..place + 1, flags);
    }
    argv
}

/// The flags of `A` in an argument list for a subcommand, each as one token, without defaults.
///
/// # Errors
/// If the list does not parse.
pub(crate) fn given_flags<A: Args>(grammar: Command, argv: &[OsString]) -> Result<Vec<OsString>, clap::Error> {
    let matches = grammar.try_get_matches_from(argv)?;
    let Some((_, matches)) = matches.subcommand() else { return Ok(Vec::new()) };
    let flags = A::augment_args(Command::new("flags"));
    let mut tokens = Vec::new();
    for arg in flags.get_arguments() {
        let (id, Some(long)) = (arg.get_id().as_str(), arg.get_long()) else { continue };
        if matches.value_source(id) != Some(ValueSource::CommandLine) {
            continue;
        }
        for value in matches.get_raw(id).into_iter().flatten() {
            let mut token = OsString::from(format!("--{long}="));
            token.push(value);
            tokens.push(token);
        }
    }
    Ok(tokens)
}

/// Whether the command's own positional argument is a TOML file.
fn takes_manifest(command: &Command) -> bool {
    matches!(command.get_name(), "batch" | "study")
}
