//! The step that a fit has reached.

use crate::graph::NodeId;

/// The step that a fit has reached, with the node whose output decides the next one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Step {
    /// Stage one: some search is open.
    Searching,
    /// The candidates are judged on the coarse picture, to start from the best there.
    Scouting(NodeId),
    /// Stage two judges the candidates.
    Selecting(NodeId),
    /// Stage three searches on the coarse picture.
    Exploring(NodeId),
    /// The model waits for the lobe that another one finds on the coarse picture.
    Following,
    /// The model waits for the others on the coarse picture.
    Waiting,
    /// Stage three searches at full resolution.
    Polishing(NodeId),
    /// The pictures are being made.
    Reporting,
}
