//! A settings file in TOML: its keys are the names of flags, with `-` or `_`, and of positional arguments in lower
//! case; its relative paths are relative to the file.

use crate::settings::DisplayExposure;
use anyhow::{Context, bail};
use clap::{Arg, ArgAction, Command, ValueHint, error::ErrorKind};
use serde::de::DeserializeOwned;
use std::{collections::BTreeMap, ffi::OsString, fs, ops::Range, path::Path};
use toml::{Spanned, Value};

/// The content of a settings file as arguments.
#[derive(Debug, Default)]
pub(crate) struct Config {
    /// `--name=value` or `--name`, in the order of the file.
    pub(crate) flags: Vec<OsString>,
    /// Positional arguments by their place in the grammar, from 1.
    pub(crate) positionals: BTreeMap<usize, OsString>,
}

/// Reads the settings file of a command.
///
/// # Errors
/// If the file cannot be read, is not TOML, or has a key or a value that the command does not accept; the message
/// names the file, the line and the key.
pub(crate) fn read(command: &Command, path: &Path) -> anyhow::Result<Config> {
    let text = fs::read_to_string(path).with_context(|| format!("cannot read the settings file {}", path.display()))?;
    parse(command, path, &text)
}

fn parse(command: &Command, path: &Path, text: &str) -> anyhow::Result<Config> {
    let file = TomlFile { path, text };
    let (config, problems) = of_table(command, &file, file.parse()?);
    problems.into_iter().next().map_or(Ok(config), Err)
}

/// A table of settings with the place of each key and value in the file.
pub(crate) type Table = BTreeMap<Spanned<String>, Spanned<Value>>;

/// A TOML file, with its text to find the lines of errors.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TomlFile<'a> {
    pub(crate) path: &'a Path,
    pub(crate) text: &'a str,
}

impl TomlFile<'_> {
    /// The content of the file.
    ///
    /// # Errors
    /// If it is not TOML or not a `T`; the message names the file and the line.
    pub(crate) fn parse<T: DeserializeOwned>(&self) -> anyhow::Result<T> {
        toml::from_str(self.text).map_err(|error| {
            self.at(error.span().unwrap_or_default(), &anyhow::anyhow!("{}", error.message().replace('\n', ", ")))
        })
    }

    /// The error, preceded by the file and the line on which a span begins.
    pub(crate) fn at(&self, span: Range<usize>, error: &anyhow::Error) -> anyhow::Error {
        anyhow::anyhow!("{}:{}: {error:#}", self.path.display(), self.line(span))
    }

    /// The line, from 1, on which a span begins.
    pub(crate) fn line(&self, span: Range<usize>) -> usize {
        self.text.bytes().take(span.start).filter(|&byte| byte == b'\n').count() + 1
    }
}

/// The content of a table as arguments of a command, and all its errors, in the order of the file.
pub(crate) fn of_table(command: &Command, file: &TomlFile<'_>, table: Table) -> (Config, Vec<anyhow::Error>) {
    let mut entries: Vec<_> = table.into_iter().collect();
    entries.sort_by_key(|(key, _)| key.span().start);
    let (mut config, mut seen, mut problems) = (Config::default(), Vec::new(), Vec::new());
    for (key, value) in entries {
        let value = (key.get_ref().as_str(), value.into_inner());
        if let Err(error) = entry(command, file.path, value, &mut seen, &mut config) {
            problems.push(file.at(key.span(), &error));
        }
    }
    (config, problems)
}

/// Adds one key and its value to the arguments.
fn entry<'c>(
    command: &'c Command,
    path: &Path,
    (key, value): (&str, Value),
    seen: &mut Vec<&'c str>,
    config: &mut Config,
) -> anyhow::Result<()> {
    let arg = find(command, key)?;
    if seen.contains(&name(arg)) {
        bail!("{:?} is given twice", name(arg));
    }
    seen.push(name(arg));
    let Some(token) = token(arg, value, path)? else { return Ok(()) };
    check(command, arg, &token)?;
    match arg.get_index() {
        Some(index) => _ = config.positionals.insert(index, token),
        None => config.flags.push(token),
    }
    Ok(())
}

/// The argument that a key names.
fn find<'c>(command: &'c Command, key: &str) -> anyhow::Result<&'c Arg> {
    let wanted = key.replace('_', "-");
    let known = || command.get_arguments().filter(|arg| !matches!(name(arg), "help" | "version"));
    if let Some(arg) = known().find(|arg| name(arg) == wanted) {
        return Ok(arg);
    }
    match known().min_by_key(|arg| strsim::damerau_levenshtein(name(arg), &wanted)) {
        Some(nearest) => bail!("unknown key {key:?}; the nearest one is {:?}", name(nearest)),
        None => bail!("unknown key {key:?}; this command takes no keys"),
    }
}

/// The key of an argument: the name of a flag, or of a positional argument.
fn name(arg: &Arg) -> &str {
    arg.get_long().unwrap_or(arg.get_id().as_str())
}

/// The argument as one token; `None` for a switch that is off.
fn token(arg: &Arg, value: Value, file: &Path) -> anyhow::Result<Option<OsString>> {
    let switch = matches!(arg.get_action(), ArgAction::SetTrue);
    let text = match value {
        Value::Boolean(on) if switch => return Ok(on.then(|| format!("--{}", name(arg)).into())),
        _ if switch => bail!("{:?} must be true or false", name(arg)),
        value => flat(value).with_context(|| format!("{:?}", name(arg)))?,
    };
    let text = rebase(arg, text, file);
    if arg.is_positional() {
        return Ok(Some(text));
    }
    let mut token = OsString::from(format!("--{}=", name(arg)));
    token.push(text);
    Ok(Some(token))
}

/// A value as it is typed on the command line: a list is joined by commas, a table is `key=value` joined by commas.
fn flat(value: Value) -> anyhow::Result<String> {
    Ok(match value {
        Value::String(text) => text,
        Value::Integer(number) => number.to_string(),
        Value::Float(number) => number.to_string(),
        Value::Boolean(on) => if on { "on" } else { "off" }.into(),
        Value::Datetime(_) => bail!("expected text, a number, a list or a table, found a date"),
        Value::Array(items) => items.into_iter().map(flat).collect::<anyhow::Result<Vec<_>>>()?.join(","),
        Value::Table(table) => {
            let pair = |(key, value)| anyhow::Ok(format!("{key}={}", flat(value)?));
            table.into_iter().map(pair).collect::<anyhow::Result<Vec<_>>>()?.join(",")
        }
    })
}

/// Makes a relative path relative to the folder of the settings file.
fn rebase(arg: &Arg, text: String, file: &Path) -> OsString {
    let folder = file.parent().unwrap_or(Path::new(""));
    match (arg.get_value_hint(), text.strip_prefix(DisplayExposure::FROM)) {
        (ValueHint::AnyPath | ValueHint::FilePath | ValueHint::DirPath, _) => folder.join(text).into(),
        (_, Some(path)) if name(arg) == "display-exposure" => {
            let mut value = OsString::from(DisplayExposure::FROM);
            value.push(folder.join(path));
            value
        }
        _ => text.into(),
    }
}

/// Parses one argument alone, so that an error can be reported with its line.
fn check(command: &Command, arg: &Arg, token: &OsString) -> anyhow::Result<()> {
    let lone = command.clone().mut_args(|arg| arg.required(false)).no_binary_name(true);
    let separator = arg.is_positional().then(|| OsString::from("--"));
    match lone.try_get_matches_from(separator.iter().chain([token])) {
        Err(error) if !matches!(error.kind(), ErrorKind::DisplayHelp | ErrorKind::DisplayVersion) => {
            bail!("{}", first_paragraph(&error))
        }
        _ => Ok(()),
    }
}

/// The first paragraph of clap's message, on one line.
pub(crate) fn first_paragraph(error: &clap::Error) -> String {
    let text = error.render().to_string();
    let message = text.split("\n\n").next().unwrap_or_default();
    let lines: Vec<&str> = message.lines().map(str::trim).collect();
    lines.join(" ").trim_start_matches("error: ").to_owned()
}
