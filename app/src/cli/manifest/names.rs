//! Names of fits, which are names of folders.

use anyhow::bail;
use lookalike::graph::MAX_PART_NAME_BYTES;
use std::{collections::BTreeMap, path::Path};

/// The names that are taken, in lower case, with the lines that took them: some file systems cannot tell `A` from `a`.
#[derive(Debug, Default)]
pub(super) struct Names(BTreeMap<String, usize>);

impl Names {
    /// Records a checked name for the fit of this line.
    pub(super) fn claim(&mut self, name: &str, line: usize) -> anyhow::Result<()> {
        match self.0.insert(name.to_lowercase(), line) {
            None => Ok(()),
            Some(other) if other == line => {
                bail!("two fits are named {name:?}; list a file once, or give each fit a name in a [[fit]] of its own")
            }
            Some(other) => bail!(
                "two fits are named {name:?}, the other one on line {other}; give a [[fit]] another name, or a [[set]] a name, \
                 which then precedes the names of its fits"
            ),
        }
    }
}

/// Files that a batch writes beside the folders of its fits. Names that SQLite and unfinished writes derive from them are reserved as well.
const FILES: [&str; 9] = [
    "access.json",
    "access.key.pem",
    "lookalike.sbatch",
    "run.lock",
    "run.sqlite",
    "run.written",
    "status.json",
    "summary.csv",
    "summary.json",
];

/// Names of devices on Windows, with any extension; COM and LPT with a digit are devices too.
const DEVICES: [&str; 4] = ["con", "prn", "aux", "nul"];

/// Advice about a name that was given.
pub(super) const GIVEN: &str = "use another one";
/// Advice about a name that was made of the inputs.
pub(super) const MADE: &str = "give the fit a name in a [[fit]], or rename the photo";

/// Accepts a name that is valid as a folder on every system and one word in a log. `advice` is the remedy in the message.
pub(super) fn check(name: &str, advice: &str) -> anyhow::Result<()> {
    if name.is_empty() || name.len() > MAX_PART_NAME_BYTES {
        bail!("a name must have 1 to {MAX_PART_NAME_BYTES} bytes, found {}: {name:?}; {advice}", name.len());
    }
    if !name.chars().all(is_plain) || name.starts_with(['.', '-']) || name.ends_with('.') {
        let instead = plain(name);
        bail!(
            "the name {name:?} is not a valid folder name on every system; use only letters, digits and . _ - +, such as {instead:?}"
        );
    }
    let lower = name.to_lowercase();
    let is_file =
        |file: &str| lower.strip_prefix(file).is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '-']));
    if FILES.iter().any(|file| is_file(file)) || (lower.starts_with("slurm-") && lower.ends_with(".out")) {
        bail!("the name {name:?} is reserved for a file of the batch; {advice}");
    }
    let stem = lower.split('.').next().unwrap_or_default();
    let is_port = |port: &str| stem.strip_prefix(port).is_some_and(|rest| matches!(rest.as_bytes(), [b'0'..=b'9']));
    if DEVICES.contains(&stem) || is_port("com") || is_port("lpt") {
        bail!("{name:?} is the name of a device on Windows; {advice}");
    }
    Ok(())
}

/// The name of a fit without a given name: photo, light and model.
pub(super) fn of_inputs(prefix: Option<&str>, photo: &Path, environment: &Path, model: &str) -> String {
    let stem = |path: &Path| plain(&path.file_stem().unwrap_or_default().to_string_lossy());
    let parts = [prefix.map(str::to_owned), Some(stem(photo)), Some(stem(environment)), Some(model.to_owned())];
    parts.into_iter().flatten().collect::<Vec<_>>().join("-")
}

fn is_plain(c: char) -> bool {
    c.is_alphanumeric() || matches!(c, '.' | '_' | '-' | '+')
}

fn plain(text: &str) -> String {
    let plain: String = text.chars().map(|c| if is_plain(c) { c } else { '_' }).collect();
    let plain = plain.trim_start_matches(['.', '-']).trim_end_matches('.');
    if plain.is_empty() { "fit".to_owned() } else { plain.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_made_of_the_inputs() {
        let name = |photo: &str| of_inputs(None, Path::new(photo), Path::new("maps/grace cross.hdr"), "ggx");
        assert_eq!(name("a/red ball.exr"), "red_ball-grace_cross-ggx");
        assert_eq!(name(".exr"), "exr-grace_cross-ggx");
        let with = of_inputs(Some("day"), Path::new("é.png"), Path::new("m.hdr"), "cook-torrance");
        assert_eq!(with, "day-é-m-cook-torrance");
        assert!(check(&with, GIVEN).is_ok());
    }

    #[test]
    fn names_that_are_not_valid_folders_are_refused_with_a_valid_one() {
        for (name, instead) in
            [("a/b", "a_b"), ("../up", "_up"), ("two words", "two_words"), (".hidden", "hidden"), ("a:b", "a_b")]
        {
            let message = check(name, GIVEN).unwrap_err().to_string();
            assert!(message.contains(&format!("such as {instead:?}")), "{message}");
            assert!(check(instead, GIVEN).is_ok());
        }
        for name in ["", "-x", &"x".repeat(500)] {
            assert!(check(name, GIVEN).is_err(), "{name}");
        }
    }

    #[test]
    fn names_of_files_and_devices_are_refused_and_no_others() {
        let files = [
            "run.sqlite",
            "Run.sqlite-wal",
            "status.json.partial",
            "access.key.pem",
            "lookalike.sbatch",
            "slurm-7.out",
        ];
        for name in files {
            let message = check(name, MADE).unwrap_err().to_string();
            assert!(
                message.contains("reserved for a file of the batch; give the fit a name in a [[fit]]"),
                "{message}"
            );
        }
        for name in ["CON", "nul.exr-map-ggx", "com1", "LPT9.a"] {
            assert!(check(name, GIVEN).unwrap_err().to_string().ends_with("on Windows; use another one"), "{name}");
        }
        for name in ["run.0001-map-ggx", "summary", "access-ggx", "slurm-7", "con-map-ggx", "com10", "manifest"] {
            check(name, GIVEN).unwrap();
        }
    }

    #[test]
    fn names_that_differ_only_in_case_are_refused() {
        let mut names = Names::default();
        names.claim("Gold", 3).unwrap();
        let message = names.claim("gold", 7).unwrap_err().to_string();
        assert!(message.contains("the other one on line 3"), "{message}");
    }
}
