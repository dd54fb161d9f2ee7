//! The command line of a job, from the one with which the user submits it.

use anyhow::bail;
use std::ffi::OsString;

/// The command line of the job: the user's own, the command first, without what submits it. What stands behind a lone `--` is for
/// `sbatch`.
///
/// # Errors
/// When an argument is not UTF-8, which a job script cannot hold.
pub fn command_line(typed: &[OsString]) -> anyhow::Result<Vec<String>> {
    let mut command = Vec::new();
    for argument in typed.iter().take_while(|argument| *argument != "--") {
        match argument.to_str() {
            // The script asks for --resume itself. --force was carried out when the job was submitted: a requeued job would delete
            // its own results.
            Some("--slurm" | "--resume" | "--force") => {}
            Some(text) => command.push(text.to_owned()),
            None => bail!("a job script holds UTF-8 only, but the argument {argument:?} is not UTF-8; rename the file"),
        }
    }
    Ok(command)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn job_runs_the_command_line_without_the_flags_that_submit_it() {
        let typed = "batch a.toml --resume --out run --slurm --seed 3 -- --nodes=4 -p gpu";
        let command = command_line(&typed.split(' ').map(OsString::from).collect::<Vec<_>>()).unwrap();
        assert_eq!(command, ["batch", "a.toml", "--out", "run", "--seed", "3"]);
        let typed = ["study", "a.toml", "--force", "--out", "run", "--slurm"].map(OsString::from);
        assert_eq!(command_line(&typed).unwrap(), ["study", "a.toml", "--out", "run"]);
    }
}
