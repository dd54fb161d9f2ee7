//! The work of a node for its fit or survey, so that costs can be added up.

use crate::nodes;

/// The work of a node for a fit or a survey.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Work {
    /// A shard of the table that searches read: that of a subset, or a survey's table.
    Table,
    /// One search: the place of its result among the candidates of a fit or the minima of a survey.
    Search(usize),
    /// Judging the candidates, and the table for it.
    StageTwo,
    /// Exploring and polishing, and the tables for them.
    StageThree,
    /// The pictures and the uncertainty at the end.
    Pictures,
    /// Anything else: the photo, the scores of given points.
    Other,
}

impl Work {
    /// The work of a node of a fit other than a search. `is_judged`: whether stage two is over.
    pub(super) fn of_fit(kind: &str, is_judged: bool) -> Self {
        match kind {
            nodes::TRANSPORT => Self::Table,
            nodes::TRANSPORT_FULL if is_judged => Self::StageThree,
            nodes::TRANSPORT_FULL | nodes::SELECT => Self::StageTwo,
            nodes::TRANSPORT_COARSE | nodes::SCOUT | nodes::EXPLORE | nodes::POLISH => Self::StageThree,
            nodes::REPORT | nodes::UNCERTAINTY | nodes::RELIGHT => Self::Pictures,
            _ => Self::Other,
        }
    }

    /// The work of a node of a survey other than a search.
    pub(super) fn of_survey(kind: &str) -> Self {
        match kind {
            nodes::TRANSPORT_FULL => Self::Table,
            nodes::REPORT => Self::Pictures,
            _ => Self::Other,
        }
    }
}
