//! The stages of a fit that the display shows, counted from the events of its nodes.

use lookalike::{graph::NodeId, nodes};
use lookalike_coordinator::events::{NodeName, RunEvent};
use std::collections::BTreeMap;

/// One line of the display.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Stage {
    /// Transport tables of the pixel subsets.
    Tables,
    Searches,
    /// The full-resolution table and the scores of the candidates.
    Judging,
    /// Polish, with the tables that it adds.
    Polish,
    Pictures,
}

impl Stage {
    pub(super) fn title(self) -> &'static str {
        match self {
            Self::Tables => "light tables",
            Self::Searches => "searches",
            Self::Judging => "judging",
            Self::Polish => "polishing",
            Self::Pictures => "pictures",
        }
    }

    /// Its place among the lines of a fit.
    pub(super) fn place(self) -> u8 {
        self as u8
    }

    /// Whether the best score so far is shown with it.
    pub(super) fn is_scored(self) -> bool {
        matches!(self, Self::Judging | Self::Polish)
    }

    /// The kind of node that completes the stage.
    fn last_kind(self) -> &'static str {
        match self {
            Self::Tables => nodes::TRANSPORT,
            Self::Searches => nodes::SEARCH,
            Self::Judging => nodes::SELECT,
            Self::Polish => nodes::POLISH,
            Self::Pictures => nodes::REPORT,
        }
    }
}

/// Nodes planned and done.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Count {
    pub(super) planned: u64,
    pub(super) done: u64,
    /// The progress of the running node, in thousandths.
    pub(super) permille: u64,
    /// Whether a node of the kind that completes the stage has ended.
    has_ended: bool,
}

impl Count {
    pub(super) fn is_complete(self) -> bool {
        self.has_ended && self.done == self.planned
    }

    /// The completed share of the stage, in thousandths.
    pub(super) fn thousandths(self) -> u64 {
        (self.done * 1000 + self.permille).checked_div(self.planned).unwrap_or(0).min(1000)
    }
}

/// Counts nodes by stage.
#[derive(Debug, Default)]
pub(super) struct Tally {
    counts: BTreeMap<Stage, Count>,
    stages: BTreeMap<NodeId, Stage>,
}

impl Tally {
    /// Counts an event. Returns the stage it belongs to, with its count.
    pub(super) fn note(&mut self, event: &RunEvent) -> Option<(Stage, Count)> {
        let stage = match event {
            RunEvent::NodeAdded { name } => {
                let stage = self.stage_of(name)?;
                self.stages.insert(name.node, stage);
                self.counts.entry(stage).or_default().planned += 1;
                stage
            }
            RunEvent::NodeFinished { name, .. } | RunEvent::NodeRecalled { name, .. } => {
                let stage = *self.stages.get(&name.node)?;
                let count = self.counts.entry(stage).or_default();
                count.done += 1;
                count.permille = 0;
                count.has_ended |= name.kind == stage.last_kind();
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

    /// The first stage that is not complete; the last one if all are.
    pub(super) fn latest(&self) -> Option<(Stage, Count)> {
        let open = self.counts.iter().find(|(_, count)| !count.is_complete());
        open.or_else(|| self.counts.last_key_value()).map(|(stage, count)| (*stage, *count))
    }

    /// The stage of a node that is added now.
    fn stage_of(&self, name: &NodeName) -> Option<Stage> {
        let is_judged = self.counts.get(&Stage::Judging).is_some_and(|count| count.has_ended);
        Some(match name.kind.as_str() {
            // Tables that are added after the candidates were judged are for polish.
            nodes::TRANSPORT_FULL if is_judged => Stage::Polish,
            nodes::TRANSPORT | nodes::TRANSPORT_COARSE => Stage::Tables,
            nodes::SEARCH | nodes::BRUTE_FORCE => Stage::Searches,
            nodes::TRANSPORT_FULL | nodes::SELECT | nodes::APPRAISE => Stage::Judging,
            nodes::SCOUT | nodes::EXPLORE | nodes::POLISH => Stage::Polish,
            nodes::REPORT | nodes::UNCERTAINTY | nodes::RELIGHT | nodes::RENDER => Stage::Pictures,
            _ => return None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lookalike_coordinator::events::Site;
    use std::time::Duration;

    fn name(node: u64, kind: &str) -> NodeName {
        NodeName { node: NodeId(node), kind: kind.to_owned(), label: "".into(), part: 0 }
    }

    fn added(tally: &mut Tally, node: u64, kind: &str) -> (Stage, Count) {
        tally.note(&RunEvent::NodeAdded { name: name(node, kind) }).unwrap()
    }

    fn finished(tally: &mut Tally, node: u64, kind: &str) -> (Stage, Count) {
        let (name, site, elapsed) = (name(node, kind), Site::Coordinator, Duration::ZERO);
        tally.note(&RunEvent::NodeFinished { name, site, bytes: 0, elapsed }).unwrap()
    }

    #[test]
    fn nodes_are_counted_in_their_stage_which_ends_once() {
        let mut tally = Tally::default();
        assert_eq!(added(&mut tally, 0, nodes::TRANSPORT).0, Stage::Tables);
        assert!(finished(&mut tally, 0, nodes::TRANSPORT).1.is_complete());
        assert_eq!(added(&mut tally, 1, nodes::TRANSPORT_FULL).0, Stage::Judging);
        assert!(!finished(&mut tally, 1, nodes::TRANSPORT_FULL).1.is_complete(), "nothing was judged yet");
        added(&mut tally, 2, nodes::SELECT);
        assert!(finished(&mut tally, 2, nodes::SELECT).1.is_complete());
        assert_eq!(added(&mut tally, 3, nodes::TRANSPORT_FULL).0, Stage::Polish);
        added(&mut tally, 4, nodes::POLISH);
        let half = tally.note(&RunEvent::NodeProgress { node: NodeId(4), permille: 500 }).unwrap();
        assert_eq!((half.0, half.1.thousandths()), (Stage::Polish, 250));
        assert_eq!(Count::default().thousandths(), 0);
    }
}
