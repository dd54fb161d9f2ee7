//! The step that a fit has reached.

use crate::graph::NodeId;

/// The step that a fit has reached, with the node whose output decides the next one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Step {
    /// Stage one: some search is open.
    Searching,
    /// Stage two judges the candidates.
    Selecting(NodeId),
    /// Stage three searches on the coarse picture.
    Exploring(NodeId),
    /// Stage three searches at full resolution.
    Polishing(NodeId),
    /// The pictures are being made.
    Reporting,
}
