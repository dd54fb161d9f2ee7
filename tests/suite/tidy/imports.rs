//! Which module may import which, inside a member and from other members.

use super::{
    at, none,
    paths::paths,
    source::{Source, sources},
};

/// The tables of the members.
const MAY_IMPORT: [(&str, MayImport); 3] = [("common", COMMON), ("coordinator", COORDINATOR), ("app", APP)];

/// The modules of a member that each of its modules may import. Keep it tight: widen it in the commit that explains why.
type MayImport = &'static [(&'static str, &'static [&'static str])];

const COMMON: MayImport = &[
    ("choice", &[]),
    ("math", &[]),
    ("image", &["math"]),
    ("brdf", &["math"]),
    ("light", &["choice", "image", "math"]),
    ("scene", &["image", "light", "math"]),
    ("render", &["brdf", "choice", "image", "light", "math", "scene"]),
    ("metric", &["choice", "image", "math"]),
    ("search", &["math"]),
    ("fit", &["brdf", "choice", "image", "light", "math", "metric", "render", "scene", "search"]),
    ("nodes", &["brdf", "fit", "graph", "image", "light", "math", "metric", "protocol", "render", "scene", "search"]),
    ("plan", &["brdf", "fit", "graph", "image", "light", "math", "metric", "nodes", "render", "scene"]),
    ("graph", &[]),
    ("protocol", &["graph"]),
];

const COORDINATOR: MayImport = &[
    ("access", &["atomic"]),
    ("actions", &["events"]),
    ("atomic", &[]),
    ("events", &[]),
    ("journal", &["actions", "atomic", "events", "state"]),
    ("limits", &[]),
    ("metrics", &["events", "limits", "runner"]),
    ("policy", &[]),
    ("reactor", &["actions", "events", "policy", "state"]),
    ("rpc", &["events", "limits", "policy", "reactor", "tls"]),
    (
        "runner",
        &["access", "actions", "events", "journal", "limits", "policy", "reactor", "rpc", "spawn", "state", "tls"],
    ),
    ("spawn", &["events", "reactor", "rpc"]),
    ("state", &["actions", "events", "policy"]),
    ("tls", &["access"]),
];

const APP: MayImport = &[
    ("batch", &["exit", "fit", "inputs", "outputs", "problems", "progress", "run", "settings", "wrap"]),
    ("cli", &["commands", "exit", "problems", "settings", "wrap"]),
    (
        "commands",
        &["batch", "demo", "exit", "fit", "inputs", "outputs", "progress", "run", "settings", "slurm", "study", "wrap"],
    ),
    ("demo", &[]),
    ("exit", &[]),
    ("fit", &["exit", "outputs", "progress", "run", "settings"]),
    ("inputs", &["settings", "wrap"]),
    ("outputs", &["problems", "settings", "wrap"]),
    ("problems", &[]),
    ("progress", &["outputs", "settings", "wrap"]),
    ("run", &["exit", "outputs", "settings"]),
    ("settings", &[]),
    ("slurm", &["exit"]),
    ("study", &["exit", "fit", "inputs", "outputs", "progress", "run", "settings"]),
    ("wrap", &[]),
];

/// The imports that the table of a member does not allow.
fn offences(member: &str, table: MayImport, sources: &[Source]) -> Vec<String> {
    let mut offences = Vec::new();
    for source in sources {
        let Some(module) = source.module_of(member) else { continue };
        let Some((name, allowed)) = table.iter().find(|(name, _)| *name == module) else {
            offences.push(format!(
                "{}: the module {module} is not in the table of {member}; give it its place",
                source.path
            ));
            continue;
        };
        for found in paths(&source.code, "crate") {
            let target = found.name.split("::").nth(1).unwrap_or("*");
            if target != module && !allowed.contains(&target) {
                offences.push(at(source, &found, &format!("must not be imported by {name}")));
            }
        }
        // A path of `super` that leaves its module would not be seen by the check above.
        let folders = source.path.matches('/').count() - 2 + usize::from(!source.path.ends_with("/mod.rs"));
        for found in paths(&source.code, "super") {
            if found.name.split("::").filter(|name| *name == "super").count() >= folders.max(1) {
                offences.push(at(source, &found, "leaves its module; write crate::"));
            }
        }
    }
    offences
}

#[test]
fn modules_of_a_member_import_in_one_direction() {
    let sources = sources();
    let found = MAY_IMPORT.iter().flat_map(|(member, table)| offences(member, table, &sources)).collect();
    none("the order is that of the tables in tests/suite/tidy/imports.rs", found);
}

#[test]
fn import_that_is_not_allowed_is_named() {
    let source = |path: &str, code: &str| Source { path: path.into(), text: String::new(), code: code.into() };
    let sources = [
        source("coordinator/src/policy.rs", "use crate::events::RunEvent;"),
        source("coordinator/src/reactor/mod.rs", "use crate::{events::RunEvent, policy::Policy};\nuse crate::rpc;"),
        source("coordinator/src/tls.rs", "use super::limits::Limits;"),
        source("coordinator/src/new.rs", ""),
    ];
    let found = offences("coordinator", COORDINATOR, &sources);
    let expected = [
        "coordinator/src/policy.rs:1: crate::events::RunEvent must not be imported by policy",
        "coordinator/src/reactor/mod.rs:2: crate::rpc must not be imported by reactor",
        "coordinator/src/tls.rs:1: super::limits::Limits leaves its module; write crate::",
        "coordinator/src/new.rs: the module new is not in the table of coordinator; give it its place",
    ];
    assert_eq!(found, expected);
}

/// What each member may import from other members, except in tests. A name that ends with `::` stands for everything in it.
const MEMBERS_MAY_IMPORT: [(&str, &[&str]); 3] = [
    ("worker/src/", &["lookalike::graph::", "lookalike::protocol::"]),
    ("coordinator/src/", &["lookalike::graph::", "lookalike::protocol::", "lookalike_worker::"]),
    ("report/src/", &["lookalike::brdf::", "lookalike::image::", "lookalike::math::"]),
];

#[test]
fn members_import_what_their_role_allows() {
    const OURS: [&str; 5] =
        ["lookalike", "lookalike_app", "lookalike_coordinator", "lookalike_report", "lookalike_worker"];
    let mut offences = Vec::new();
    for source in sources().iter().filter(|source| source.path != "worker/src/main.rs") {
        let of = MEMBERS_MAY_IMPORT.iter().find(|(member, _)| source.path.starts_with(member));
        let Some((_, allowed)) = of else { continue };
        for found in OURS.iter().flat_map(|root| paths(&source.code, root)) {
            let name = format!("{}::", found.name);
            if !allowed.iter().any(|allowed| name.starts_with(allowed)) {
                offences.push(at(source, &found, &format!("(its member may import {allowed:?})")));
            }
        }
    }
    none(
        "worker and coordinator know no rendering, only worker/src/main.rs names node types, and the report reads rows",
        offences,
    );
}
