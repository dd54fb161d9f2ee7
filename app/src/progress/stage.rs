//! The stages of a fit as a user sees them, counted from the events of its nodes.

use lookalike::graph::{NodeId, split_label};
use lookalike_coordinator::events::{NodeName, RunEvent};
use std::collections::BTreeMap;

/// One line of the display.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Stage {
    SubsetTables,
    Searches,
    FullTables,
    Judging,
    Polish,
    Pictures,
}

impl Stage {
    pub(super) const ALL: [Self; 6] =
        [Self::SubsetTables, Self::Searches, Self::FullTables, Self::Judging, Self::Polish, Self::Pictures];

    pub(super) fn title(self) -> &'static str {
        match self {
            Self::SubsetTables => "first transport",
            Self::Searches => "stage one: searches",
            Self::FullTables => "full transport",
            Self::Judging => "stage two: CSSIM",
            Self::Polish => "stage three: polish",
            Self::Pictures => "pictures",
        }
    }

    /// A shorter title.
    pub(super) fn short(self) -> &'static str {
        match self {
            Self::SubsetTables => "subset",
            Self::Searches => "searches",
            Self::FullTables => "full table",
            Self::Judging => "judging",
            Self::Polish => "polish",
            Self::Pictures => "pictures",
        }
    }

    /// The stage a node belongs to.
    fn of(name: &NodeName) -> Option<Self> {
        Some(match name.kind.as_str() {
            "transport" if split_label(&name.label).1.starts_with("transport in full") => Self::FullTables,
            "transport" => Self::SubsetTables,
            "search" => Self::Searches,
            "select" => Self::Judging,
            "explore" | "polish" => Self::Polish,
            "report" => Self::Pictures,
            _ => return None,
        })
    }
}

/// Thousandths of nodes planned and done.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Count {
    pub(super) planned: u64,
    pub(super) done: u64,
    /// Of the node that is under way, in thousandths.
    pub(super) permille: u64,
}

impl Count {
    pub(super) fn is_complete(self) -> bool {
        self.planned > 0 && self.done == self.planned
    }
}

/// Counts nodes by stage.
#[derive(Debug, Default)]
pub(super) struct Tally {
    counts: BTreeMap<Stage, Count>,
    stages: BTreeMap<NodeId, Stage>,
}

impl Tally {
    /// Takes note of an event; the stage it concerns, with its count.
    pub(super) fn note(&mut self, event: &RunEvent) -> Option<(Stage, Count)> {
        let stage = match event {
            RunEvent::NodeAdded { name } => {
                let stage = Stage::of(name)?;
                self.stages.insert(name.node, stage);
                self.counts.entry(stage).or_default().planned += 1;
                stage
            }
            RunEvent::NodeFinished { name, .. } | RunEvent::NodeRecalled { name, .. } => {
                let stage = Stage::of(name)?;
                let count = self.counts.entry(stage).or_default();
                count.done += 1;
                count.permille = 0;
                stage
            }
            RunEvent::NodeProgress { node, permille } => {
                let stage = *self.stages.get(node)?;
                self.counts.entry(stage).or_default().permille = u64::from(*permille);
                stage
            }
            _ => return None,
        };
        Some((stage, self.counts[&stage]))
    }

    /// The first stage that is not complete, else the last one.
    pub(super) fn latest(&self) -> Option<(Stage, Count)> {
        let open = self.counts.iter().find(|(_, count)| !count.is_complete());
        open.or_else(|| self.counts.last_key_value()).map(|(stage, count)| (*stage, *count))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_are_counted_in_their_stage() {
        let name = |node: u64, kind: &str, label: &str| NodeName {
            node: NodeId(node),
            kind: kind.to_owned(),
            label: label.to_owned(),
        };
        let mut tally = Tally::default();
        let added = |tally: &mut Tally, n, kind, label| {
            tally.note(&RunEvent::NodeAdded { name: name(n, kind, label) }).unwrap()
        };
        assert_eq!(added(&mut tally, 0, "transport", "transport of the subset, pixels 0 to 31").0, Stage::SubsetTables);
        assert_eq!(added(&mut tally, 1, "transport", "transport in full, pixels 0 to 31").0, Stage::FullTables);
        assert_eq!(added(&mut tally, 2, "polish", "polish").1, Count { planned: 1, done: 0, permille: 0 });
        let half = tally.note(&RunEvent::NodeProgress { node: NodeId(2), permille: 500 }).unwrap();
        assert_eq!(half, (Stage::Polish, Count { planned: 1, done: 0, permille: 500 }));
    }
}
