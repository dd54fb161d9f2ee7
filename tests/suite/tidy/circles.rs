//! No file imports itself through others. A path (`crate::`, `super::`, `self::`) is an import of the file that defines its
//! item: a module that only re-exports the item does not count, and neither does `mod name;`.

use std::collections::{BTreeMap, BTreeSet};

use super::{
    none,
    paths::paths,
    source::{Source, sources},
};

/// The path of a module inside its crate: `["scene", "camera"]`.
type Module = Vec<String>;

/// The modules of one crate.
struct Crate<'a> {
    files: BTreeMap<Module, &'a str>,
    /// For each module the items that it re-exports, as paths from the root of the crate.
    re_exports: BTreeMap<Module, Vec<Module>>,
}

impl<'a> Crate<'a> {
    fn of(member: &str, sources: &'a [Source]) -> Self {
        let root = format!("{member}/src/");
        let module = |source: &'a Source| {
            let inside = source.path.strip_prefix(&root)?.strip_suffix(".rs")?;
            // Programs are crates of their own, and test modules are blank.
            if inside == "main" || inside.starts_with("bin/") || source.code.trim().is_empty() {
                return None;
            }
            let names = inside.split('/').filter(|name| !["lib", "mod"].contains(name));
            Some((names.map(str::to_owned).collect(), source.code.as_str()))
        };
        let files: BTreeMap<Module, &str> = sources.iter().filter_map(module).collect();
        let of = |(module, code): (&Module, &&str)| {
            let paths = re_exports(code).into_iter().flat_map(|statement| {
                let first = statement.split("::").next().unwrap_or_default().to_owned();
                paths(&statement, &first).into_iter().filter_map(|path| absolute(module, &path.name))
            });
            (module.clone(), paths.collect())
        };
        let re_exports = files.iter().map(of).collect();
        Self { files, re_exports }
    }

    /// The module that defines the item of a path, through at most this many re-exports.
    fn definer(&self, path: &[String], hops: usize) -> Module {
        let length = (0..=path.len()).rev().find(|length| self.files.contains_key(&path[..*length])).unwrap_or(0);
        let (module, rest) = path.split_at(length);
        let Some((item, deeper)) = rest.split_first().filter(|_| hops > 0) else { return module.to_vec() };
        let re_exported = self.re_exports.get(module).into_iter().flatten();
        match re_exported.into_iter().find(|origin| origin.last() == Some(item) && origin[..] != path[..=length]) {
            Some(origin) => self.definer(&[origin, deeper].concat(), hops - 1),
            None => module.to_vec(),
        }
    }

    /// For each module, the modules that define the items it names.
    fn imports(&self) -> BTreeMap<Module, BTreeSet<Module>> {
        let of = |(module, code): (&Module, &&str)| {
            let mut code = (*code).to_owned();
            for statement in re_exports(&code) {
                code = code.replace(&statement, "");
            }
            let named = ["crate", "super", "self"].into_iter().flat_map(|root| paths(&code, root));
            let targets = named.filter_map(|path| absolute(module, &path.name)).map(|path| self.definer(&path, 8));
            (module.clone(), targets.filter(|target| target != module).collect())
        };
        self.files.iter().map(of).collect()
    }
}

/// The trees of `pub use ...;` and its restricted forms.
fn re_exports(code: &str) -> Vec<String> {
    let uses = code.match_indices("use ").filter(|(place, _)| {
        let before = code[..*place].trim_end();
        before.ends_with("pub")
            || before.ends_with(')') && before.rsplit('\n').next().is_some_and(|line| line.trim().starts_with("pub("))
    });
    uses.filter_map(|(place, word)| code[place + word.len()..].split(';').next()).map(str::to_owned).collect()
}

/// A path from the root of the crate; `None` if it leaves the crate.
fn absolute(module: &[String], path: &str) -> Option<Module> {
    let mut names: Vec<&str> = path.split("::").collect();
    let mut base = match names[0] {
        "crate" => Vec::new(),
        "super" => module[..module.len().checked_sub(1)?].to_vec(),
        _ => module.to_vec(),
    };
    if ["crate", "super", "self"].contains(&names[0]) {
        names.remove(0);
    }
    while names.first() == Some(&"super") {
        names.remove(0);
        base.pop()?;
    }
    Some(base.into_iter().chain(names.into_iter().map(str::to_owned)).collect())
}

/// A way from a module back to itself.
fn circle(imports: &BTreeMap<Module, BTreeSet<Module>>, start: &Module) -> Option<Vec<Module>> {
    let mut ways = vec![vec![start.clone()]];
    let mut seen = BTreeSet::new();
    while !ways.is_empty() {
        let mut longer = Vec::new();
        for way in ways {
            for next in imports.get(way.last()?).into_iter().flatten() {
                if next == start {
                    return Some(way);
                }
                if seen.insert(next.clone()) {
                    longer.push([way.as_slice(), std::slice::from_ref(next)].concat());
                }
            }
        }
        ways = longer;
    }
    None
}

/// The shortest circle through each module that has one, each circle once.
fn circles(member: &str, sources: &[Source]) -> Vec<String> {
    let imports = Crate::of(member, sources).imports();
    let mut seen = BTreeSet::new();
    let found = imports.keys().filter_map(|start| circle(&imports, start)).filter(|way| {
        let members: BTreeSet<&Module> = way.iter().collect();
        seen.insert(format!("{members:?}"))
    });
    found
        .map(|way| format!("{member}: {}", way.iter().map(|m| m.join("::")).collect::<Vec<_>>().join(" -> ")))
        .collect()
}

#[test]
fn no_file_imports_itself_through_others() {
    let sources = sources();
    let members = ["app", "common", "coordinator", "report", "tests", "worker"];
    let found: Vec<String> = members.iter().flat_map(|member| circles(member, &sources)).collect();
    none("move what both need into a file of its own", found);
}

#[test]
fn circles_are_found_through_re_exports() {
    let source = |path: &str, code: &str| Source { path: path.into(), text: String::new(), code: code.into() };
    let with = |b: &str| {
        let sources = [
            source("m/src/lib.rs", "mod a; mod b;\npub(crate) use a::{A, deep::Deep};"),
            source("m/src/a.rs", "mod deep; use super::b::B; struct A;"),
            source("m/src/a/deep.rs", "struct Deep;"),
            source("m/src/b.rs", b),
            source("m/src/main.rs", "use crate::a::A;"),
        ];
        circles("m", &sources)
    };
    assert_eq!(with("struct B; use crate::A;"), ["m: a -> b"]);
    assert_eq!(with("struct B(super::a::A);"), ["m: a -> b"]);
    assert!(with("struct B; use crate::Deep;").is_empty());
    assert!(with("struct B; pub use crate::A;").is_empty());
}
