//! What nodes cost: seconds from their start to the arrival of their output, by label. Workers of one thread each, one per core, make
//! them seconds of one core. Kept in a file, so that a run that is gone on with knows what was computed before.

use crate::{comm::RunEvent, outputs::OutFolder};
use anyhow::Context;
use std::{
    collections::{BTreeMap, BTreeSet},
    fs::{self, File, OpenOptions},
    io::Write,
};

const FILE: &str = "seconds.tsv";

/// The seconds of all nodes.
#[derive(Debug)]
pub(super) struct Seconds {
    known: BTreeMap<String, f64>,
    file: File,
}

impl Seconds {
    /// Those of an earlier run in the folder, if there was one, and a file to add more to.
    pub(super) fn open(out: &OutFolder) -> anyhow::Result<Self> {
        let path = out.file(FILE);
        let text = if path.exists() {
            fs::read_to_string(&path).with_context(|| path.display().to_string())?
        } else {
            String::new()
        };
        let mut known = BTreeMap::new();
        // The last line may have been cut off by the end of the process.
        for (seconds, label) in text.split_inclusive('\n').filter_map(|line| line.strip_suffix('\n')?.split_once('\t'))
        {
            if let Ok(seconds) = seconds.parse::<f64>() {
                *known.entry(label.to_owned()).or_default() += seconds;
            }
        }
        let file = OpenOptions::new().create(true).append(true).open(&path);
        Ok(Self { known, file: file.with_context(|| format!("cannot write {}", path.display()))? })
    }

    /// Takes note of what an event says.
    pub(super) fn note(&mut self, event: &RunEvent) {
        let RunEvent::NodeFinished { name, elapsed, .. } = event else { return };
        let seconds = elapsed.as_secs_f64();
        *self.known.entry(name.label.clone()).or_default() += seconds;
        if let Err(error) = writeln!(self.file, "{seconds}\t{}", name.label) {
            tracing::warn!("cannot write {FILE}: {error}");
        }
    }

    /// The sum over those of the labels that `counts`. A label is that of a node with the name of a cell before it.
    pub(super) fn sum(&self, labels: &BTreeSet<String>, counts: impl Fn(&str) -> bool) -> f64 {
        let own = |label: &str| counts(lookalike::graph::split_label(label).1);
        labels.iter().filter(|label| own(label)).filter_map(|label| self.known.get(label)).sum()
    }
}
