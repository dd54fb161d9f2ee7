//! The job script: `deploy/slurm/lookalike.sbatch` with a command line and options inserted at the marked lines.

use super::SlurmJob;
use anyhow::{Context, bail};
use std::path::Path;

/// The script that is also submitted by hand.
pub(super) const TEMPLATE: &str = include_str!("../../../deploy/slurm/lookalike.sbatch");
/// The line of the template after which options of `sbatch` win over its own.
pub(super) const OPTIONS: &str = "# [lookalike batch --slurm: options]\n";
/// The line of the template that the command line takes the place of.
pub(super) const COMMAND_LINE: &str = "# [lookalike batch --slurm: command line]\n";

/// Flags that say where workers are: in a job, the script does.
const OF_THE_SCRIPT: [&str; 4] = ["--workers", "--listen", "--advertise", "--access"];

impl SlurmJob {
    /// The text of the job script.
    ///
    /// # Errors
    /// When the command says where workers are, or an option or a path cannot stand in a job script.
    pub fn script(&self) -> anyhow::Result<String> {
        for argument in &self.command {
            let flag = argument.split('=').next().unwrap_or_default();
            if OF_THE_SCRIPT.contains(&flag) {
                bail!(
                    "{flag} cannot be used in a Slurm job, whose script starts a worker on each node and gives it the address; leave {flag} out"
                );
            }
        }
        let command = self.command.iter().map(|argument| quoted(argument)).collect::<Vec<_>>().join(" ");
        let program = quoted(text_of(&self.program)?);
        let results = quoted(text_of(&self.out)?);
        let begin = format!("export LOOKALIKE={program}\nresults={results}\nset -- {command}\n");
        Ok(TEMPLATE.replacen(OPTIONS, &self.directives()?, 1).replacen(COMMAND_LINE, &begin, 1))
    }

    /// Ours, then the user's: for Slurm the later one wins.
    fn directives(&self) -> anyhow::Result<String> {
        // A percent sign starts a pattern in the name of the log.
        let log = text_of(&self.out)?.replace('%', "%%") + "/slurm-%j.out";
        let name = self.out.file_name().map_or_else(|| "lookalike".into(), |name| name.to_string_lossy());
        let own =
            [format!("--job-name={name}"), format!("--chdir={}", text_of(&self.folder)?), format!("--output={log}")];
        let mut directives = String::new();
        for options in [&own[..], &self.options[..]] {
            if options.is_empty() {
                continue;
            }
            if let Some(option) = options.iter().find(|option| option.contains(['\n', '\r'])) {
                bail!("an option of sbatch must be one line, found {option:?}");
            }
            let line = options.iter().map(|option| quoted_for_sbatch(option)).collect::<Vec<_>>().join(" ");
            directives.push_str(&format!("#SBATCH {line}\n"));
        }
        Ok(directives)
    }
}

fn text_of(path: &Path) -> anyhow::Result<&str> {
    path.to_str().with_context(|| {
        format!("a job script holds UTF-8 only, but the path {} is not UTF-8; rename it", path.display())
    })
}

/// One word of a shell's command line.
fn quoted(word: &str) -> String {
    let plain = |byte: u8| byte.is_ascii_alphanumeric() || b"-_./,:=+@".contains(&byte);
    if !word.is_empty() && word.bytes().all(plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', r"'\''"))
}

/// One word of an `#SBATCH` line: as in a shell, but a backslash escapes in quotes too.
fn quoted_for_sbatch(word: &str) -> String {
    quoted(&word.replace('\\', r"\\"))
}
