//! Documents agree with the sources: links and paths resolve, commands and flags exist, keys are in the bibliography.

use super::{
    none,
    source::{root, sources},
};
use std::{collections::BTreeSet, fs, process::Command};

const DOCUMENTS: [&str; 21] = [
    "README.md",
    "ARCHITECTURE.md",
    "CONTRIBUTING.md",
    "CHANGELOG.md",
    "docs/accuracy.md",
    "docs/batch.md",
    "docs/capture.md",
    "docs/cluster.md",
    "docs/conventions.md",
    "docs/design.md",
    "docs/fit-json.md",
    "docs/journal.md",
    "docs/method.md",
    "docs/overhead.md",
    "docs/progress.md",
    "docs/real-materials.md",
    "docs/results-ggx-f90.md",
    "docs/results.md",
    "docs/security.md",
    "docs/speed.md",
    "docs/study.md",
];
const FOLDERS: [&str; 11] = [
    "app/",
    "common/",
    "coordinator/",
    "deploy/",
    "docs/",
    "fuzz/",
    "report/",
    "tests/",
    "worker/",
    ".ci/",
    "experiments/",
];

/// A document without its HTML comments.
pub(super) fn document(name: &str) -> String {
    let text = fs::read_to_string(root().join(name)).unwrap_or_else(|error| panic!("{name}: {error}"));
    let mut parts = text.split("<!--");
    let before = parts.next().unwrap_or_default();
    parts.fold(before.to_owned(), |shown, part| shown + part.split_once("-->").map_or("", |(_, after)| after))
}

/// Every text between `open` and `close`.
pub(super) fn between<'a>(text: &'a str, open: &str, close: &str) -> Vec<&'a str> {
    text.split(open).skip(1).filter_map(|rest| Some(rest.split_once(close)?.0)).collect()
}

/// The fenced blocks of a document and what is left without them.
fn blocks(text: &str) -> (Vec<&str>, String) {
    let parts: Vec<&str> = text.split("```").collect();
    (parts.iter().skip(1).step_by(2).copied().collect(), parts.iter().step_by(2).copied().collect())
}

/// The `--flags` in a text.
fn flags(text: &str) -> BTreeSet<&str> {
    let is_part = |c: char| c.is_ascii_lowercase() || c == '-';
    let starts = text.match_indices("--").filter(|(i, _)| !text[..*i].ends_with(|c: char| is_part(c)));
    let ends = starts.map(|(i, _)| &text[i..i + text[i..].find(|c: char| !is_part(c)).unwrap_or(text.len() - i)]);
    ends.filter(|flag| flag.len() > 2 && flag.as_bytes()[2] != b'-').collect()
}

fn help(command: &str) -> String {
    let mut program = Command::new(env!("CARGO_BIN_EXE_lookalike-under-test"));
    let output = program.args(command.split(' ')).arg("--help").output().expect("the binary under test starts");
    assert!(output.status.success(), "lookalike {command} --help");
    String::from_utf8(output.stdout).expect("help is UTF-8")
}

#[test]
fn links_and_paths_in_documents_resolve() {
    let mut offences = Vec::new();
    for name in DOCUMENTS {
        let text = document(name);
        let (_, prose) = blocks(&text);
        let links = between(&prose, "](", ")").into_iter().chain(between(&prose, "src=\"", "\""));
        let named = prose.split('`').skip(1).step_by(2).filter(|path| {
            FOLDERS.iter().any(|folder| path.starts_with(folder)) && !path.contains(['*', '<', ' ', '{', '('])
        });
        // Links start from the document's folder, paths in the text from the root.
        let folder = root().join(name).parent().expect("a document lies in a folder").to_owned();
        let places = links.filter(|link| !link.starts_with("http")).map(|link| (folder.clone(), link));
        for (from, link) in places.chain(named.map(|path| (root(), path))) {
            let path = link.split('#').next().unwrap_or_default();
            if !path.is_empty() && !from.join(path).exists() {
                offences.push(format!("{name}: {link} does not exist"));
            }
        }
    }
    none("documents name what is there", offences);
}

#[test]
fn commands_and_flags_in_documents_exist() {
    const COMMANDS: [&str; 9] =
        ["access new", "batch", "demo", "fit", "status", "study", "render", "compare", "worker"];
    const OF_CARGO: [&str; 11] = [
        "--bench",
        "--bin",
        "--example",
        "--features",
        "--lib",
        "--locked",
        "--nocapture",
        "--path",
        "--profile",
        "--release",
        "--test",
    ];
    // Of sbatch, podman, kubectl and a validator.
    const OF_CLUSTERS: [&str; 15] = [
        "--array",
        "--cpus-per-task",
        "--exclusive",
        "--file",
        "--for",
        "--from-file",
        "--no-kill",
        "--nodes",
        "--open-mode",
        "--requeue",
        "--signal",
        "--strict",
        "--tag",
        "--test-only",
        "--time",
    ];
    // Of oiiotool, which scales and mirrors maps.
    const OF_IMAGES: [&str; 2] = ["--flop", "--mulc"];
    // Of experiments/speed.py.
    const OF_EXPERIMENTS: [&str; 5] = ["--after", "--before", "--data", "--runs", "--works"];
    let helps: Vec<(&str, String)> = COMMANDS.iter().map(|command| (*command, help(command))).collect();
    let of_others = OF_CARGO.into_iter().chain(OF_CLUSTERS).chain(OF_IMAGES).chain(OF_EXPERIMENTS);
    let known: BTreeSet<&str> = helps.iter().flat_map(|(_, help)| flags(help)).chain(of_others).collect();
    let mut offences = Vec::new();
    for name in DOCUMENTS {
        let text = document(name);
        offences.extend(flags(&text).difference(&known).map(|flag| format!("{name}: no command has {flag}")));
        let joined = text.replace("\\\n", " ");
        for line in joined.lines().filter(|line| line.starts_with("lookalike ")) {
            // What follows a lone `--` are arguments of another program.
            let line = line.split(" -- ").next().unwrap_or_default();
            let command = line.split_whitespace().nth(1).unwrap_or_default();
            match helps.iter().find(|(known, _)| known.split(' ').next() == Some(command)) {
                Some((_, help)) => {
                    let unknown =
                        flags(line).difference(&flags(help)).map(|flag| (*flag).to_owned()).collect::<Vec<_>>();
                    offences.extend(unknown.iter().map(|flag| format!("{name}: lookalike {command} has no {flag}")));
                }
                None => offences.push(format!("{name}: lookalike {command} is not there")),
            }
        }
    }
    none("documents name commands and flags that exist", offences);
}

#[test]
fn readme_names_the_two_commands() {
    let text = document("README.md");
    let lines: Vec<&str> = blocks(&text).0.into_iter().flat_map(str::lines).collect();
    for command in ["cargo run --release --bin lookalike -- demo", "cargo test"] {
        assert!(lines.contains(&command), "expected the line {command:?} in a code block of README.md");
    }
}

#[test]
fn sections_of_the_design_that_are_cited_exist() {
    let design = document("docs/design.md");
    let headings = design.lines().filter_map(|line| line.strip_prefix("## ")?.split_once(". "));
    let sections: Vec<&str> = headings.map(|(number, _)| number).collect();
    assert_eq!(sections, ["1", "2", "3", "4", "5", "6", "7", "8", "9", "10"], "the sections of docs/design.md");
    let (mut offences, mut cited) = (Vec::new(), 0);
    for source in sources() {
        // Comments in one line, whatever their breaks.
        let lines =
            source.text.lines().map(|line| line.trim_start().trim_start_matches('/').trim_start_matches('!').trim());
        let text = lines.collect::<Vec<_>>().join(" ");
        for (place, phrase) in text.match_indices("design section") {
            let numbers = section_numbers(&text[place + phrase.len()..]);
            cited += numbers.len();
            if numbers.is_empty() && !source.path.starts_with("tests/suite/tidy") {
                offences.push(format!("{}: cites a section of the design without its number", source.path));
            }
            let unknown = numbers.iter().filter(|number| !sections.contains(&number.as_str()));
            offences.extend(unknown.map(|number| format!("{}: design section {number}", source.path)));
        }
    }
    assert!(cited > 20, "only {cited} citations found: does this test still read them?");
    none("docs/design.md has every section that a comment cites", offences);
}

/// The numbers that follow "design section": of ` 5`, `s 2 and 9`, `s 1, 2 and 10`.
fn section_numbers(text: &str) -> Vec<String> {
    let list = text.strip_prefix('s').unwrap_or(text);
    let words = list.split_whitespace().filter(|word| *word != "and");
    let is_number = |word: &&str| word.starts_with(|c: char| c.is_ascii_digit());
    let number = |word: &str| word.chars().take_while(char::is_ascii_digit).collect::<String>();
    let mut numbers = Vec::new();
    for word in words.take_while(is_number) {
        numbers.push(number(word));
        // A list continues after a comma or an "and"; a number after any other word belongs to another sentence.
        let goes_on = word.ends_with(',') || list.split_once(word).is_some_and(|(_, rest)| rest.starts_with(" and "));
        if !goes_on {
            break;
        }
    }
    numbers
}

#[test]
fn keys_cited_in_the_sources_are_in_the_bibliography() {
    let bibliography = fs::read_to_string(root().join("docs/references.bib")).expect("docs/references.bib");
    let entries: Vec<&str> = bibliography
        .lines()
        .filter_map(|line| line.strip_prefix('@')?.split_once('{'))
        .map(|(_, key)| key.trim_end_matches(','))
        .collect();
    let keys: BTreeSet<&str> = entries.iter().copied().collect();
    let mut offences = Vec::new();
    if keys.len() != entries.len() {
        offences.push("docs/references.bib: a key is there twice".to_owned());
    }
    let texts = sources().into_iter().map(|source| (source.path.clone(), source.text));
    for (path, text) in texts.chain(DOCUMENTS.map(|name| (name.to_owned(), document(name)))) {
        // A key such as [BP20b]: capital initials, two digits of the year, optionally a letter.
        let plain = text.replace("\\[", "[").replace("\\]", "]");
        let cited =
            between(&plain, "[", "]").into_iter().filter(|key| is_key(key)).map(str::to_owned).collect::<Vec<_>>();
        offences.extend(cited.iter().filter(|key| !keys.contains(key.as_str())).map(|key| format!("{path}: [{key}]")));
    }
    none("every key is in docs/references.bib", offences);
}

fn is_key(text: &str) -> bool {
    let initials = text.trim_start_matches(|c: char| c.is_ascii_uppercase());
    let year = initials.trim_end_matches(|c: char| c.is_ascii_lowercase());
    text.len() - initials.len() >= 2 && year.len() == 2 && year.bytes().all(|byte| byte.is_ascii_digit())
}
