//! Labels of the nodes of a part: the name of the part, a separator, and the label from the part's planner.

/// The longest name of a part, in bytes: with the label of a node behind it, it stays within
/// [`MAX_NAME_BYTES`](super::MAX_NAME_BYTES).
pub const MAX_PART_NAME_BYTES: usize = 160;

/// What lies between the name of a part and the label of one of its nodes.
const SEPARATOR: &str = ": ";

/// The label of a node of a part.
pub(super) fn part_label(part: &str, label: &str) -> String {
    format!("{part}{SEPARATOR}{label}")
}

/// The name of the part in a label, if there is one, and the rest.
#[must_use]
pub fn split_label(label: &str) -> (Option<&str>, &str) {
    label.split_once(SEPARATOR).map_or((None, label), |(part, rest)| (Some(part), rest))
}
