//! What a job runs, from what the user typed to submit it.

use anyhow::bail;
use std::ffi::OsString;

/// The command line of the job: the user's own, without the program's name, without what submits, and with the command first, where
/// the job script looks for it. What stands behind a lone `--` is for `sbatch`.
///
/// # Errors
/// When an argument is not UTF-8, which a job script cannot hold, or there is no `command` in the list.
pub fn command_line(argv: &[OsString], command: &str) -> anyhow::Result<Vec<String>> {
    let (mut before, mut after) = (Vec::new(), None::<Vec<String>>);
    for argument in argv.iter().skip(1).take_while(|argument| *argument != "--") {
        let Some(text) = argument.to_str() else {
            bail!("a job script is text, and the argument {argument:?} is not UTF-8");
        };
        match &mut after {
            // The script asks for --resume itself.
            _ if ["--slurm", "--resume"].contains(&text) => {}
            // A value of --log can read like a command.
            None if text == command && before.last().is_none_or(|last| last != "--log") => after = Some(Vec::new()),
            None => before.push(text.to_owned()),
            Some(after) => after.push(text.to_owned()),
        }
    }
    let Some(after) = after else { bail!("expected the command {command}, found {before:?}") };
    Ok([vec![command.to_owned()], before, after].concat())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(line: &str) -> anyhow::Result<Vec<String>> {
        command_line(&line.split(' ').map(OsString::from).collect::<Vec<_>>(), "batch")
    }

    #[test]
    fn job_runs_what_was_typed_without_what_submits_it() {
        let job = of("lookalike batch a.toml --out run --slurm --seed 3 -- --nodes=4 -p gpu").unwrap();
        assert_eq!(job, ["batch", "a.toml", "--out", "run", "--seed", "3"]);
        let job = of("/bin/lookalike --log batch batch --slurm --resume a.toml --out=run").unwrap();
        assert_eq!(job, ["batch", "--log", "batch", "a.toml", "--out=run"]);
        assert!(of("lookalike fit a.exr --slurm").unwrap_err().to_string().starts_with("expected the command batch"));
    }
}
