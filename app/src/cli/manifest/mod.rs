//! The manifest of a batch: a TOML file that lists fits, each in the grammar of `lookalike fit`.
//!
//! ```toml
//! photos = "balls/*.exr"                 # a product: every photo under every light with every model
//! environments = ["garden.hdr"]
//! models = ["ggx", "cook-torrance"]
//! [defaults]                             # settings of all fits
//! samples = 512
//! [[set]]                                # another product, with settings of its own
//! photos = ["attic/*.exr"]
//! environments = "attic.hdr"
//! [[fit]]                                # one fit
//! photo = "gold.exr"
//! env = "garden.hdr"
//! ```
//! Every table is rewritten into flags, as a settings file is, in this order: defaults, set or fit, command line. The last one
//! wins. All problems are reported together, each with its line.

mod names;
mod patterns;

use super::{
    args::{BatchArgs, EntryArgs},
    config::{self, Config, Table, TomlFile, first_paragraph},
    preset,
};
use crate::{problems::Problems, settings::BatchFit};
use anyhow::{Context, anyhow};
use clap::{Args as _, Command, CommandFactory, Parser};
use patterns::Patterns;
use serde::Deserialize;
use std::{ffi::OsString, fs, ops::Range, path::Path};
use toml::{Spanned, Value};

/// More fits than any batch has, most likely a mistake in a pattern.
const MOST_FITS: usize = 100_000;

/// The fits of a manifest in their order, at least one. The flags `given` on the command line override the manifest.
///
/// # Errors
/// If the file cannot be read; else all errors in it.
pub(crate) fn read(path: &Path, given: &[OsString]) -> anyhow::Result<Vec<BatchFit>> {
    let text = fs::read_to_string(path).with_context(|| format!("cannot read the manifest {}", path.display()))?;
    let file = TomlFile { path, text: &text };
    let content: Content = file.parse()?;
    let mut reader = Reader::new(file, given);
    reader.read(content);
    if reader.fits.is_empty() && reader.problems.is_empty() {
        reader.problems.push(anyhow!(
            "{}: the manifest has no fit; give photos and environments, or a [[fit]] with photo and env",
            path.display()
        ));
    }
    Problems::check(reader.problems.iter().map(|error| format!("{error:#}")).collect(), &path.display().to_string())?;
    Ok(reader.fits)
}

/// A manifest as it is written.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Content {
    photos: Option<Spanned<Value>>,
    environments: Option<Spanned<Value>>,
    models: Option<Spanned<Value>>,
    #[serde(default)]
    defaults: Table,
    #[serde(default)]
    set: Vec<Spanned<Table>>,
    #[serde(default)]
    fit: Vec<Spanned<Table>>,
}

/// Keys of a product, which are not settings.
const PRODUCT: [&str; 3] = ["photos", "environments", "models"];

/// The parts of a fit before it is parsed.
struct Draft {
    span: Range<usize>,
    photo: OsString,
    flags: Vec<OsString>,
    /// Its whole name. `None`: the name is made of the prefix and the inputs.
    name: Option<String>,
    prefix: Option<String>,
}

struct Reader<'a> {
    file: TomlFile<'a>,
    given: &'a [OsString],
    grammar: Command,
    /// Keys of the whole batch: flags of `lookalike batch` that a fit does not have.
    of_the_batch: Vec<String>,
    defaults: Vec<OsString>,
    fits: Vec<BatchFit>,
    names: names::Names,
    problems: Vec<anyhow::Error>,
}

impl<'a> Reader<'a> {
    fn new(file: TomlFile<'a>, given: &'a [OsString]) -> Self {
        let mut grammar = EntryArgs::command();
        grammar.build();
        let of_a_fit: Vec<&str> = grammar.get_arguments().filter_map(clap::Arg::get_long).collect();
        let batch = BatchArgs::augment_args(Command::new("batch"));
        let of_the_batch =
            batch.get_arguments().filter_map(clap::Arg::get_long).filter(|long| !of_a_fit.contains(long));
        let of_the_batch = of_the_batch.map(str::to_owned).collect();
        Self {
            file,
            given,
            of_the_batch,
            grammar,
            defaults: Vec::new(),
            fits: Vec::new(),
            names: names::Names::default(),
            problems: Vec::new(),
        }
    }

    fn read(&mut self, content: Content) {
        let defaults =
            self.settings(content.defaults, "a photo belongs to one fit: move it from [defaults] into a [[fit]]");
        self.defaults = defaults.flags;
        self.top([content.photos, content.environments, content.models]);
        for table in content.set {
            self.set(table);
        }
        for table in content.fit {
            self.fit(table);
        }
    }

    /// The product at the top, if there is one.
    fn top(&mut self, lists: [Option<Spanned<Value>>; 3]) {
        if lists[0].is_some() {
            let first = lists.iter().flatten().map(|value| value.span().start).min().unwrap_or(0);
            return self.product(lists, first..first, &[], None);
        }
        let [_, environments, models] = lists;
        for (list, name, setting) in [(environments, "environments", "env"), (models, "models", "model")] {
            if let Some(list) = list {
                let error = anyhow!(
                    "\"{name}\" at the top needs \"photos\" at the top; add them, move \"{name}\" into each [[set]], or give one \
                     of them in [defaults] as \"{setting}\""
                );
                self.problem(list.span(), &error);
            }
        }
    }

    /// The flags of a table; its problems are noted.
    fn settings(&mut self, table: Table, photo_is_wrong: &str) -> Config {
        let (theirs, ours): (Table, Table) =
            table.into_iter().partition(|(key, _)| self.of_the_batch.contains(&key.get_ref().replace('_', "-")));
        for key in theirs.into_keys() {
            let name = key.get_ref().replace('_', "-");
            self.problem(
                key.span(),
                &anyhow!("{name:?} is a setting of the whole batch: give it as --{name} on the command line"),
            );
        }
        if let Some(key) = ours.keys().find(|key| key.get_ref() == "photo").filter(|_| !photo_is_wrong.is_empty()) {
            self.problem(key.span(), &anyhow!("{photo_is_wrong}"));
        }
        let (config, problems) = config::of_table(&self.grammar, &self.file, ours);
        self.problems.extend(problems);
        config
    }

    fn problem(&mut self, span: Range<usize>, error: &anyhow::Error) {
        self.problems.push(self.file.at(span, error));
    }

    fn set(&mut self, table: Spanned<Table>) {
        let span = table.span();
        let mut table = table.into_inner();
        let lists = PRODUCT.map(|name| take(&mut table, name).map(|(_, value)| value));
        let prefix = self.name(&mut table);
        let config = self.settings(table, "a [[set]] lists its photos under \"photos\"");
        self.product(lists, span, &config.flags, prefix);
    }

    fn fit(&mut self, table: Spanned<Table>) {
        let span = table.span();
        let mut table = table.into_inner();
        let name = self.name(&mut table);
        let before = self.problems.len();
        let config = self.settings(table, "");
        if self.problems.len() > before {
            return;
        }
        match config.positionals.into_values().next() {
            Some(photo) => self.draft(Draft { span, photo, flags: config.flags, name, prefix: None }),
            None => self.problem(span, &anyhow!("this fit has no photo; give photo = \"FILE\"")),
        }
    }

    /// The name in a table, if it is valid.
    fn name(&mut self, table: &mut Table) -> Option<String> {
        let (key, value) = take(table, "name")?;
        let checked = match value.into_inner() {
            Value::String(name) => names::check(&name, names::GIVEN).map(|()| name),
            _ => Err(anyhow!("\"name\" must be text")),
        };
        checked.map_err(|error| self.problem(key, &error)).ok()
    }

    /// Every photo under every light with every model. The light changes last, so that it is loaded once.
    fn product(
        &mut self,
        lists: [Option<Spanned<Value>>; 3],
        span: Range<usize>,
        flags: &[OsString],
        prefix: Option<String>,
    ) {
        let [photos, environments, models] = lists;
        let Some(photos) = photos else {
            return self.problem(span, &anyhow!("there are no photos; give photos = \"PATTERN\" or a list of them"));
        };
        let photos = self.files("photos", Some(photos));
        let environments = self.files("environments", environments);
        let models = models.map(|list| self.models(list));
        // Without a list, the setting decides.
        let flags_of = |flag: &str, list: Option<Vec<OsString>>| {
            list.map_or_else(|| vec![None], |list| list.into_iter().map(|value| Some(joined(flag, value))).collect())
        };
        let (environments, models) = (flags_of("--env=", environments), flags_of("--model=", models));
        let count = environments.len() * photos.as_ref().map_or(0, Vec::len) * models.len();
        if count + self.fits.len() > MOST_FITS {
            let error = anyhow!("{count} fits; a batch has at most {MOST_FITS}: split it, or name fewer files");
            return self.problem(span, &error);
        }
        for environment in &environments {
            for photo in photos.iter().flatten() {
                for model in &models {
                    let flags = flags.iter().chain(environment).chain(model).cloned().collect();
                    let (photo, prefix) = (photo.clone(), prefix.clone());
                    self.draft(Draft { span: span.clone(), photo, flags, name: None, prefix });
                }
            }
        }
    }

    /// The files of a list of patterns.
    fn files(&mut self, what: &'static str, list: Option<Spanned<Value>>) -> Option<Vec<OsString>> {
        let list = list?;
        let span = list.span();
        let folder = self.file.path.parent().unwrap_or(Path::new(""));
        let (files, problems) = Patterns::of(what, list.into_inner())
            .map_or_else(|error| (Vec::new(), vec![error]), |patterns| patterns.files(folder));
        for error in problems {
            self.problem(span.clone(), &error);
        }
        Some(files)
    }

    fn models(&mut self, list: Spanned<Value>) -> Vec<OsString> {
        let span = list.span();
        match Patterns::of("models", list.into_inner()) {
            Ok(names) => names.into_names().into_iter().map(OsString::from).collect(),
            Err(error) => {
                self.problem(span, &error);
                Vec::new()
            }
        }
    }

    /// Parses a fit as `lookalike fit` would, gives it a name and keeps it.
    fn draft(&mut self, draft: Draft) {
        let span = draft.span.clone();
        if let Err(error) = self.parse(draft) {
            self.problem(span, &error);
        }
    }

    fn parse(&mut self, draft: Draft) -> anyhow::Result<()> {
        let flags: Vec<OsString> = self.defaults.iter().chain(&draft.flags).chain(self.given).cloned().collect();
        let photo = draft.photo.to_string_lossy();
        if !flags.iter().any(|flag| flag.to_string_lossy().starts_with("--env=")) {
            return Err(anyhow!("{photo} has no light; give env or environments"));
        }
        let parse = |preset: &[OsString]| {
            let end = [OsString::from("--"), draft.photo.clone()];
            EntryArgs::try_parse_from(preset.iter().chain(&flags).chain(&end))
                .map_err(|error| anyhow!("{}", first_paragraph(&error)))
        };
        let mut args = parse(&[])?;
        if let Some(preset) = args.preset() {
            args = parse(&preset::flags(preset))?;
        }
        let line = self.file.line(draft.span.clone());
        let mut fit = args.into_settings(String::new(), line)?;
        fit.name = match draft.name {
            Some(name) => name,
            None => {
                let (photo, light) = (&fit.capture.photo, &fit.capture.environment.path);
                names::of_inputs(draft.prefix.as_deref(), photo, light, &fit.methods.name())
            }
        };
        names::check(&fit.name, names::MADE)?;
        self.names.claim(&fit.name, line)?;
        self.fits.push(fit);
        Ok(())
    }
}

/// Takes a key out of a table, with its place.
fn take(table: &mut Table, name: &str) -> Option<(Range<usize>, Spanned<Value>)> {
    let key = table.keys().find(|key| key.get_ref() == name)?.clone();
    table.remove(&key).map(|value| (key.span(), value))
}

fn joined(flag: &str, value: OsString) -> OsString {
    let mut token = OsString::from(flag);
    token.push(value);
    token
}

#[cfg(test)]
mod tests;
