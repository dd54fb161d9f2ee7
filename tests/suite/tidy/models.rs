//! A reflectance model is one file, whose head comment is its manual page, and one line in the registry.

use super::{
    common,
    documents::document,
    none,
    paths::words,
    source::{Source, literals, sources},
};
use lookalike::brdf::{MODELS, Model};
use std::collections::BTreeSet;

/// The files of the program that name models, and why. A new model must not need a line in any of them.
const NAME_MODELS: [(&str, &str); 4] = [
    ("common/src/brdf/mod.rs", "the registry"),
    ("app/src/cli/args/batch.rs", "an example in the help"),
    ("app/src/cli/args/render.rs", "an example in the help"),
    ("report/src/section/models.rs", "compares particular models, as the papers do"),
];

#[test]
fn head_comment_of_a_models_file_is_its_manual_page() {
    let files: Vec<Source> = common().filter(|source| is_of_a_model(&source.code)).collect();
    let mut offences = Vec::new();
    let mut described = BTreeSet::new();
    for source in &files {
        let head = source.text.lines().next().unwrap_or_default();
        let name = head.strip_prefix("//! `").and_then(|rest| rest.split_once("`:")).map(|(name, _)| name);
        match name.and_then(|name| MODELS.iter().find(|model| model.name() == name)) {
            Some(model) => {
                described.insert(model.name());
                offences.extend(table_offences(source, *model));
            }
            None => offences.push(format!("{}:1: expected \"//! `NAME`: ...\" of a registered model", source.path)),
        }
    }
    let missing = MODELS.iter().filter(|model| !described.contains(model.name()));
    offences.extend(missing.map(|model| format!("common/src/brdf: no file whose head describes {}", model.name())));
    none(
        "a model's file opens with its name, formula, sources and a table of its parameters as they are in the code",
        offences,
    );
}

#[test]
fn model_is_named_only_in_its_file_and_the_registry() {
    // A model that has a folder may name itself in all of it.
    let own = common().filter(|source| is_of_a_model(&source.code));
    let own: Vec<String> =
        own.map(|source| source.path.strip_suffix("mod.rs").unwrap_or(&source.path).to_owned()).collect();
    let is_program = |path: &str| path.contains("/src/") && !path.starts_with("tests/");
    let (mut offences, mut naming) = (Vec::new(), BTreeSet::new());
    for source in sources().iter().filter(|source| is_program(&source.path)) {
        if own.iter().any(|own| source.path.starts_with(own)) {
            continue;
        }
        let named = names_of_models(source);
        if NAME_MODELS.iter().any(|(path, _)| *path == source.path) {
            naming.extend(named.iter().map(|_| source.path.clone()));
        } else {
            offences.extend(named.iter().map(|(line, name)| {
                format!("{}:{line}: {name}; iterate MODELS, or use DEFAULT_MODEL or PAPER_MODEL", source.path)
            }));
        }
    }
    let idle = NAME_MODELS.iter().filter(|(path, _)| !naming.contains(*path));
    offences.extend(idle.map(|(path, _)| format!("{path} names no model: remove it from NAME_MODELS")));
    none("adding a model takes its file, a line in MODELS, docs/references.bib and CHANGELOG.md", offences);
}

#[test]
fn no_test_and_no_page_lists_every_model() {
    let mut offences = Vec::new();
    let files = sources().into_iter().filter(|source| source.path != "common/src/brdf/mod.rs");
    let texts = files.map(|source| (source.path, source.text));
    let pages = ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "docs/batch.md", "docs/design.md", "docs/study.md"];
    for (path, text) in texts.chain(pages.map(|name| (name.to_owned(), document(name)))) {
        if MODELS.iter().all(|model| contains_name(&text, model.name()) || contains_name(&text, &type_of(*model))) {
            offences.push(format!("{path}: lists every model; iterate MODELS, or point to the help"));
        }
    }
    none("a list of all models needs an edit for the next one", offences);
}

/// Whether a file declares a model.
fn is_of_a_model(code: &str) -> bool {
    code.contains("impl Model for") || code.contains("impl LinearModel for")
}

/// The type of a model, which is its `Debug` form.
fn type_of(model: &dyn Model) -> String {
    format!("{model:?}")
}

/// Models named by their types in code or by their names in literals, with the lines. Doc comments of arguments count, because they
/// become the help.
fn names_of_models(source: &Source) -> Vec<(usize, String)> {
    let types: Vec<String> = MODELS.iter().map(|model| type_of(*model)).collect();
    let by_type = words(&source.code).filter(|(word, _)| types.contains(&word.name));
    let mut named: Vec<(usize, String)> = by_type.map(|(word, _)| (word.line, word.name)).collect();
    let help = source.text.lines().enumerate().filter(|(_, line)| line.trim_start().starts_with("///"));
    let help = help.filter(|_| source.path.starts_with("app/src/cli/args/"));
    let literals = literals(source).into_iter().map(|literal| (literal.line, literal.name));
    for (line, text) in literals.chain(help.map(|(i, line)| (i + 1, line.to_owned()))) {
        let names = MODELS.iter().filter(|model| contains_name(&text, model.name()));
        named.extend(names.map(|model| (line, model.name().to_owned())));
    }
    named
}

/// Whether a text contains a name that is no part of a longer one.
fn contains_name(text: &str, name: &str) -> bool {
    let is_part = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    text.match_indices(name).any(|(i, _)| !text[..i].ends_with(is_part) && !text[i + name.len()..].starts_with(is_part))
}

/// What is wrong with the table of parameters in the head comment.
fn table_offences(source: &Source, model: &dyn Model) -> Vec<String> {
    let head: Vec<&str> = source.text.lines().map_while(|line| line.strip_prefix("//!")).map(str::trim).collect();
    let cells = |row: &str| row.trim_matches('|').split('|').map(|cell| cell.trim().to_owned()).collect::<Vec<_>>();
    let rows: Vec<Vec<String>> = head.iter().filter(|line| line.starts_with("| `")).map(|row| cells(row)).collect();
    let mut offences = Vec::new();
    let documented: Vec<&str> = rows.iter().map(|row| row[0].trim_matches('`')).collect();
    let declared: Vec<&str> = model.parameters().iter().map(|parameter| parameter.name).collect();
    if documented != declared {
        offences.push(format!("{}: the table has {documented:?}, the model {declared:?}", source.path));
    }
    for (row, parameter) in rows.iter().zip(model.parameters()) {
        let bounds = row.last().and_then(|cell| cell.strip_prefix('[')?.strip_suffix(']')?.split_once(','));
        let bounds = bounds.and_then(|(low, high)| Some((low.trim().parse().ok()?, high.trim().parse().ok()?)));
        if bounds != Some((parameter.lower, parameter.upper)) {
            let (name, lower, upper) = (parameter.name, parameter.lower, parameter.upper);
            offences.push(format!("{}: expected bounds [{lower}, {upper}] of {name} in {row:?}", source.path));
        }
    }
    if !head.iter().any(|line| contains_a_year(line)) {
        offences.push(format!("{}: the head names no source with its year", source.path));
    }
    offences
}

fn contains_a_year(line: &str) -> bool {
    words(line).any(|(word, _)| word.name.len() == 4 && (word.name.starts_with("19") || word.name.starts_with("20")))
}
