//! The command line (design section 10): raw arguments, a TOML file and a preset become one argument list; clap parses
//! it; the result becomes typed settings, with which a command runs.
//!
//! A TOML file and a preset are *rewritten into flags that precede the user's* (`expand`), and a later flag overrides
//! an earlier one. So each input has one grammar, one default and one error message, wherever it comes from, and
//! precedence is an order: preset, then file, then command line.

mod args;
mod config;
mod expand;
mod manifest;
mod preset;
mod report;
mod tokens;

#[cfg(fuzzing)]
pub(crate) use manifest::read as manifest;

use crate::settings::DemoSettings;
use anyhow::Context;
use args::{Cli, Command, FitArgs, MethodArgs};
use clap::{CommandFactory, Parser};
use std::{
    ffi::OsString,
    io::{self, IsTerminal},
    process::ExitCode,
};
use tracing_subscriber::EnvFilter;

/// Runs the program on its argument list, program name first.
pub(crate) fn main(argv: Vec<OsString>) -> ExitCode {
    let cli = match parse(argv) {
        Ok(cli) => cli,
        Err(error) => return report::failure(&error),
    };
    let result = start_tracing(&cli.log).and_then(|()| dispatch(cli));
    result.unwrap_or_else(|error| report::failure(&error))
}

/// The argument list with its TOML file and its preset applied, parsed.
///
/// # Errors
/// A [`clap::Error`], also for `--help` and `--version`, or the error of the TOML file.
fn parse(argv: Vec<OsString>) -> anyhow::Result<Cli> {
    let mut grammar = Cli::command();
    grammar.build();
    let argv = expand::expand_config(&grammar, argv)?;
    let mut cli = Cli::try_parse_from(&argv)?;
    if let Command::Batch(args) = &mut cli.command {
        args.typed = tokens::subcommand_first(&grammar, &argv);
        args.given = expand::given_flags::<MethodArgs>(grammar, &argv)?;
        return Ok(cli);
    }
    if let Command::Study(args) = &mut cli.command {
        args.typed = tokens::subcommand_first(&grammar, &argv);
        return Ok(cli);
    }
    let Some(preset) = cli.command.preset() else { return Ok(cli) };
    let argv = expand::insert_flags(&grammar, argv, preset::flags(preset));
    Ok(Cli::try_parse_from(argv)?)
}

fn start_tracing(filter: &str) -> anyhow::Result<()> {
    tracing_subscriber::fmt()
        .with_env_filter(EnvFilter::try_new(filter).context("--log")?)
        .with_writer(io::stderr)
        .with_ansi(io::stderr().is_terminal())
        // A worker may outlive the reader of its stderr: a write to the closed pipe must not end it.
        .log_internal_errors(false)
        .try_init()
        .map_err(anyhow::Error::from_boxed)
}

fn dispatch(Cli { log, command }: Cli) -> anyhow::Result<ExitCode> {
    use crate::commands::{access, batch, compare, demo, fit, render, status, study, worker};
    match command {
        Command::Demo(args) => demo::run(DemoSettings { log: Some(log), ..args.into_settings()? }),
        Command::Fit(args) => {
            let mut settings = FitArgs::into_settings(*args)?;
            settings.cluster.log = Some(log);
            fit::run(settings)
        }
        Command::Render(args) => render::run(args.into_settings()?),
        Command::Compare(args) => compare::run(args.into_settings()),
        Command::Access(args) => access::run(args.into_settings()),
        Command::Worker(args) => worker::run(args),
        Command::Batch(args) => {
            let fits = manifest::read(&args.manifest, &args.given)?;
            let job = args.job();
            let mut settings = args.into_settings(fits)?;
            settings.cluster.log = Some(log);
            match job {
                Some(job) => batch::submit(&settings, job),
                None => batch::run(settings),
            }
        }
        Command::Status(args) => status::run(&args.into_settings()),
        Command::Study(args) => {
            let job = args.job();
            let mut settings = args.into_settings()?;
            settings.cluster.log = Some(log);
            match job {
                Some(job) => study::submit(&settings, job),
                None => study::run(settings),
            }
        }
    }
}

#[cfg(test)]
mod tests;
