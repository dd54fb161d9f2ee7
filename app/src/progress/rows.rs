//! The running parts of a run, each with the stage that it has reached.

use super::{
    parts::PartEvent,
    stage::{Count, Stage, Tally},
};
use lookalike::{fit::BestScore, graph::NodeId};
use lookalike_coordinator::events::RunEvent;
use std::{collections::BTreeMap, sync::Arc};

/// The running parts, by number.
#[derive(Default)]
pub(super) struct Rows {
    pub(super) running: BTreeMap<u32, Row>,
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
                self.running.insert(*number, Row { name, best, tally: Tally::default() });
            }
            PartEvent::Finished { number, .. } | PartEvent::Failed { number, .. } => {
                self.running.remove(number);
                self.owners.retain(|_, owner| owner != number);
            }
        }
    }

    /// Counts an event. Returns the number of the part that it belongs to, the part, and the stage with its count.
    pub(super) fn note(&mut self, event: &RunEvent) -> Option<(u32, &Row, Stage, Count)> {
        let owner = match event {
            RunEvent::NodeAdded { name }
            | RunEvent::NodeFinished { name, .. }
            | RunEvent::NodeRecalled { name, .. } => name.part,
            RunEvent::NodeProgress { node, .. } => *self.owners.get(node)?,
            _ => return None,
        };
        let row = self.running.get_mut(&owner)?;
        if let RunEvent::NodeAdded { name } = event {
            self.owners.insert(name.node, owner);
        }
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

#[cfg(test)]
mod tests {
    use super::*;
    use lookalike::nodes;
    use lookalike_coordinator::events::NodeName;

    #[test]
    fn node_counts_for_the_part_of_its_number_whatever_its_label_says() {
        let mut rows = Rows::default();
        for (number, name) in [(3, "gold"), (4, "chrome")] {
            rows.part(&PartEvent::Started { number, name: name.to_owned(), best: Arc::default() });
        }
        let added = |label: &str, part| {
            let (node, kind) = (NodeId(7), nodes::SEARCH.to_owned());
            RunEvent::NodeAdded { name: NodeName { node, kind, label: label.into(), part } }
        };
        let owner = |rows: &mut Rows, event: &RunEvent| rows.note(event).map(|(number, ..)| number);
        assert_eq!(owner(&mut rows, &added("gold: gamma 1", 4)), Some(4));
        assert_eq!(owner(&mut rows, &added("gamma 1", 3)), Some(3));
        assert_eq!(owner(&mut rows, &added("gold: gamma 1", 5)), None, "no such part is running");
        rows.part(&PartEvent::Failed { number: 3, name: "gold".to_owned(), error: String::new() });
        assert_eq!(owner(&mut rows, &added("gold: gamma 1", 3)), None);
    }
}
