//! The running parts of a run, each with the stage that it has reached.

use super::{
    parts::PartEvent,
    stage::{Count, Stage, Tally},
};
use lookalike::{
    fit::BestScore,
    graph::{NodeId, split_label},
};
use lookalike_coordinator::events::RunEvent;
use std::{collections::BTreeMap, sync::Arc};

/// The running parts, by number.
#[derive(Default)]
pub(super) struct Rows {
    pub(super) running: BTreeMap<u32, Row>,
    numbers: BTreeMap<String, u32>,
    /// The parts that the nodes belong to.
    owners: BTreeMap<NodeId, u32>,
}

/// A running part.
pub(super) struct Row {
    pub(super) name: String,
    best: Arc<BestScore>,
    tally: Tally,
}

impl Rows {
    /// Processes an event about a part.
    pub(super) fn part(&mut self, event: &PartEvent) {
        match event {
            PartEvent::Started { number, name, best } => {
                let (name, best) = (name.clone(), Arc::clone(best));
                self.numbers.insert(name.clone(), *number);
                self.running.insert(*number, Row { name, best, tally: Tally::default() });
            }
            PartEvent::Finished { number, .. } | PartEvent::Failed { number, .. } => {
                if let Some(row) = self.running.remove(number) {
                    self.numbers.remove(&row.name);
                }
                self.owners.retain(|_, owner| owner != number);
            }
        }
    }

    /// Counts an event. Returns the number of the part that it belongs to, the part, and the stage with its count.
    pub(super) fn note(&mut self, event: &RunEvent) -> Option<(u32, &Row, Stage, Count)> {
        let owner = match event {
            RunEvent::NodeAdded { name }
            | RunEvent::NodeFinished { name, .. }
            | RunEvent::NodeRecalled { name, .. } => {
                *self.numbers.get(split_label(&name.label).0.unwrap_or_default())?
            }
            RunEvent::NodeProgress { node, .. } => *self.owners.get(node)?,
            _ => return None,
        };
        if let RunEvent::NodeAdded { name } = event {
            self.owners.insert(name.node, owner);
        }
        let row = self.running.get_mut(&owner)?;
        let (stage, count) = row.tally.note(event)?;
        Some((owner, row, stage, count))
    }
}

impl Row {
    /// The first stage that is not complete, or the last one.
    pub(super) fn latest(&self) -> Option<(Stage, Count)> {
        self.tally.latest()
    }

    /// The best score so far, if a stage shows it.
    pub(super) fn best_at(&self, stage: Stage) -> Option<f64> {
        self.best.get().filter(|_| stage.is_scored())
    }
}
