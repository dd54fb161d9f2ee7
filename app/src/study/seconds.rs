//! The cost of nodes, by label: seconds from the start of a node to the arrival of its output. There is one worker of one
//! thread per core, so these are seconds of one core. They are kept in a file, so that a resumed run includes earlier
//! processes.

use super::record::Cost;
use crate::outputs::OutFolder;
use anyhow::Context;
use lookalike_coordinator::events::RunEvent;
use std::{
    collections::BTreeMap,
    fs::{self, File, OpenOptions},
    io::Write,
};

pub(super) const FILE: &str = "seconds.tsv";

/// The line that separates processes.
const EPOCH: &str = "#";

/// The seconds of all nodes.
#[derive(Debug)]
pub(super) struct Seconds {
    /// Nodes of earlier processes.
    before: BTreeMap<String, f64>,
    /// Nodes of this process.
    now: BTreeMap<String, f64>,
    file: File,
}

impl Seconds {
    /// Reads the seconds of an earlier run in the folder, if there was one, and opens their file to append to it.
    pub(super) fn open(out: &OutFolder) -> anyhow::Result<Self> {
        let path = out.file(FILE);
        let shown = path.display().to_string();
        let text = if path.exists() {
            fs::read_to_string(&path).with_context(|| format!("cannot read {shown}"))?
        } else {
            String::new()
        };
        let before = read(&text);
        let file = OpenOptions::new().create(true).append(true).open(&path);
        let mut file = file.with_context(|| format!("cannot write {shown}"))?;
        // End a line that was cut off.
        let end = if text.is_empty() || text.ends_with('\n') { "" } else { "\n" };
        writeln!(file, "{end}{EPOCH}").with_context(|| format!("cannot write {shown}"))?;
        Ok(Self { before, now: BTreeMap::new(), file })
    }

    /// Adds the seconds of a node that has finished.
    pub(super) fn note(&mut self, event: &RunEvent) {
        let RunEvent::NodeFinished { name, elapsed, .. } = event else { return };
        let seconds = elapsed.as_secs_f64();
        *self.now.entry(name.label.to_string()).or_default() += seconds;
        if let Err(error) = writeln!(self.file, "{seconds}\t{}", name.label) {
            tracing::warn!("cannot write {FILE}: {error}");
        }
    }

    /// The sum over the nodes of a cell whose work counts.
    pub(super) fn sum(&self, nodes: &BTreeMap<String, Cost>, counts: impl Fn(Cost) -> bool) -> f64 {
        let known = |label: &String| self.now.get(label).or_else(|| self.before.get(label));
        nodes.iter().filter(|(_, work)| counts(**work)).filter_map(|(label, _)| known(label)).sum()
    }
}

/// The seconds by label. Within one process, nodes with one label are added up; a later process replaces the sum of an earlier
/// one.
fn read(text: &str) -> BTreeMap<String, f64> {
    let mut all = BTreeMap::new();
    let mut of_process: BTreeMap<String, f64> = BTreeMap::new();
    // If the process was killed, the last line may be incomplete.
    for line in text.split_inclusive('\n').filter_map(|line| line.strip_suffix('\n')) {
        if line == EPOCH {
            all.append(&mut of_process);
        } else if let Some((seconds, label)) = line.split_once('\t')
            && let Ok(seconds) = seconds.parse::<f64>()
        {
            *of_process.entry(label.to_owned()).or_default() += seconds;
        }
    }
    all.append(&mut of_process);
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_computed_again_counts_once_and_a_line_that_was_cut_off_not_at_all() {
        let seconds =
            read("#\n1.5\ta: polish\n0.5\ta: polish\n2\tb: select\n0.2\ta: sel\n#\n3\tb: select\n0.7\tc: pol");
        let expected = [("a: polish", 2.0), ("a: sel", 0.2), ("b: select", 3.0)];
        assert_eq!(seconds, expected.map(|(label, seconds)| (label.to_owned(), seconds)).into());
    }
}
