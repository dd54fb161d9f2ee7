//! The project's rules that the compiler does not check: which module may import which, what the library must not use, what keeps results
//! the same on every machine, the form of files. Each test reads the sources; each message names the place and the remedy.
//! ARCHITECTURE.md states the same rules in prose.

mod circles;
mod contracts;
mod documents;
mod files;
mod imports;
mod models;
mod paths;
mod source;

use std::collections::BTreeSet;

use paths::{Found, calls, chain, paths, words};
use source::{Source, sources};

/// Parts of the standard library that `common` must not use: it opens, waits for and prints nothing.
const WORLD: [&str; 8] = [
    "std::env",
    "std::fs",
    "std::net",
    "std::os",
    "std::process",
    "std::thread",
    "std::time::Instant",
    "std::time::SystemTime",
];

/// Words with the same effect, however they were imported.
const WORLD_WORDS: [&str; 8] = ["Instant", "SystemTime", "from_file", "stderr", "stdin", "stdout", "to_file", "tokio"];

/// Macros that print.
const PRINTING: [&str; 5] = ["dbg", "eprint", "eprintln", "print", "println"];

/// Methods of `f64` whose result depends on the system's mathematical library, or on what the processor fuses.
const UNPORTABLE: [&str; 27] = [
    "acos", "acosh", "asin", "asinh", "atan", "atan2", "atanh", "cbrt", "cos", "cosh", "exp", "exp2", "exp_m1",
    "hypot", "ln", "ln_1p", "log", "log10", "log2", "mul_add", "powf", "powi", "sin", "sin_cos", "sinh", "tan", "tanh",
];

/// Functions of glam that call such methods.
const UNPORTABLE_OF_GLAM: [&str; 9] = [
    "angle_between",
    "from_axis_angle",
    "from_euler",
    "from_rotation_x",
    "from_rotation_y",
    "from_rotation_z",
    "rotate_towards",
    "slerp",
    "to_axis_angle",
];

/// Fails with one line per offence.
#[track_caller]
fn none(rule: &str, offences: Vec<String>) {
    assert!(offences.is_empty(), "{rule}:\n  {}", offences.join("\n  "));
}

/// The sources of the library, without its tests.
fn common() -> impl Iterator<Item = Source> {
    sources().into_iter().filter(|source| source.path.starts_with("common/src/"))
}

fn at(source: &Source, found: &Found, what: &str) -> String {
    format!("{}:{}: {} {what}", source.path, found.line, found.name)
}

/// Whether a path lies in [`WORLD`].
fn is_outside(path: &str) -> bool {
    WORLD.iter().any(|world| path.strip_prefix(world).is_some_and(|rest| rest.is_empty() || rest.starts_with("::")))
}

#[test]
fn library_uses_no_files_clocks_threads_or_output() {
    let mut offences = Vec::new();
    for source in common() {
        let used =
            paths(&source.code, "std").into_iter().filter(|found| is_outside(&found.name) || found.name == "std::time");
        offences.extend(used.map(|found| at(&source, &found, "(take bytes, readers or values instead)")));
        for (word, after) in words(&source.code) {
            let prints = after.starts_with('!') && !after.starts_with("!=") && PRINTING.contains(&word.name.as_str());
            if prints || WORLD_WORDS.contains(&word.name.as_str()) {
                offences.push(at(&source, &word, "(return values; the binaries read, time and print)"));
            }
        }
    }
    none("nothing under common/ opens a file or a socket, reads a clock or a variable, or prints", offences);
}

#[test]
fn results_do_not_depend_on_the_systems_math_library() {
    let scientific = |path: &str| path.starts_with("common/src/") || path.starts_with("app/src/demo/");
    let mut offences = Vec::new();
    for source in sources().iter().filter(|source| scientific(&source.path)) {
        if source.path != "common/src/math/elementary.rs" {
            let unportable = calls(&source.code).into_iter().filter(|found| UNPORTABLE.contains(&found.name.as_str()));
            offences.extend(unportable.map(|found| at(source, &found, "is not portable; see math::elementary")));
            let of_glam = words(&source.code).filter(|(word, _)| UNPORTABLE_OF_GLAM.contains(&word.name.as_str()));
            offences.extend(of_glam.map(|(word, _)| at(source, &word, "is not portable; see math::elementary")));
        }
        if !source.path.starts_with("common/src/math/") {
            let direct = paths(&source.code, "libm");
            offences.extend(direct.iter().map(|found| at(source, found, "bypasses math::elementary")));
        }
    }
    none("elementary functions come from math::elementary", offences);
}

#[test]
fn results_do_not_depend_on_hashing_or_on_threads() {
    let mut offences = Vec::new();
    for source in common() {
        let hashed = words(&source.code).filter(|(word, _)| word.name == "HashMap" || word.name == "HashSet");
        offences.extend(hashed.map(|(word, _)| at(&source, &word, "has no order; use BTreeMap or BTreeSet")));
        for (place, _) in source.code.match_indices("par_") {
            let chain = chain(&source.code, place);
            let merging =
                ["sum", "product", "reduce", "fold", "reduce_with", "try_reduce", "find_any", "for_each_with"];
            if let Some(name) = chain.iter().find(|name| merging.contains(name)) {
                let line = Source::line(&source.code, place);
                offences
                    .push(format!("{}:{line}: {name} of a parallel iterator; collect in order, then sum", source.path));
            }
        }
    }
    none("sums run in one order, and no order comes from a hash or a thread", offences);
}

#[test]
fn state_machines_use_neither_sockets_nor_clocks() {
    const PURE: [&str; 7] = [
        "coordinator/src/actions.rs",
        "coordinator/src/events.rs",
        "coordinator/src/policy.rs",
        "coordinator/src/reactor/",
        "coordinator/src/state/",
        "worker/src/cache.rs",
        "worker/src/tasks.rs",
    ];
    let mut offences = Vec::new();
    let mut seen = BTreeSet::new();
    for source in sources() {
        let Some(place) =
            PURE.iter().find(|pure| source.path == **pure || pure.ends_with('/') && source.path.starts_with(**pure))
        else {
            continue;
        };
        seen.insert(place);
        let used = paths(&source.code, "std").into_iter().filter(|found| is_outside(&found.name));
        offences.extend(used.map(|found| at(&source, &found, "(time and events are injected)")));
        let words = words(&source.code).filter(|(word, _)| WORLD_WORDS.contains(&word.name.as_str()));
        offences.extend(words.map(|(word, _)| at(&source, &word, "(time and events are injected)")));
    }
    assert_eq!(seen.len(), PURE.len(), "a file of {PURE:?} was moved: follow it here");
    none("state changes are plain functions of (state, event)", offences);
}

#[test]
fn comments_and_literals_are_blanked_and_words_found() {
    let blanked =
        source::without_comments_and_strings("a /* b /* c */ */ \"d // \\\" e\" r#\"f\"#; 'g' 'h: '\\'' // i\nj");
    let left: Vec<String> = words(&blanked).map(|(word, _)| word.name).collect();
    assert_eq!(left, ["a", "r", "h", "j"]);
    let tree =
        "use std::{fs::{self, File}, io::Read as _, path::*}; crate::x::<u8>(); mystd::no; std::time::Instant::now()";
    let names = |root| paths(tree, root).into_iter().map(|found| found.name).collect::<Vec<_>>();
    assert_eq!(names("std"), ["std::fs", "std::fs::File", "std::io::Read", "std::path::*", "std::time::Instant::now"]);
    assert_eq!(names("crate"), ["crate::x"]);
    let sum = "v.par_iter().map(|x| x.iter().fold(0, f)).sum::<f64>().max(y.min(z)); w.reduce(g)";
    assert_eq!(chain(sum, 2), ["map", "sum", "max"]);
    let all: Vec<String> =
        calls("x.exp(); f64::powf(x, 2.0); y.sin_cos ; z.sum::<f64>()").into_iter().map(|f| f.name).collect();
    assert_eq!(all, ["powf", "exp", "sum"]);
    let files = sources();
    let source = |path: &str| files.iter().find(|source| source.path == path).expect(path);
    assert!(source("common/src/metric/tests/vectors.rs").code.is_empty(), "a test module is not library code");
    assert!(!source("common/src/fit/objective.rs").code.contains("mod tests"), "nor is an inline one");
}
