//! Labels of the nodes of a part: the name of the part, a separator, and the label from the part's planner.

/// The longest name of a part, in bytes: together with the label of a node it stays within
/// [`MAX_NAME_BYTES`](super::MAX_NAME_BYTES).
pub const MAX_PART_NAME_BYTES: usize = 160;

/// Between the name of a part and the label of its node.
const SEPARATOR: &str = ": ";

/// The label of a node of a part.
pub(super) fn part_label(part: &str, label: &str) -> String {
    format!("{part}{SEPARATOR}{label}")
}

/// Splits a label into the name of the part, if it has one, and the rest.
#[must_use]
pub fn split_label(label: &str) -> (Option<&str>, &str) {
    label.split_once(SEPARATOR).map_or((None, label), |(part, rest)| (Some(part), rest))
}
