//! The label of a node.

use std::fmt;

/// The longest name of a part, in bytes: together with the label of a node it stays within
/// [`MAX_NAME_BYTES`](super::MAX_NAME_BYTES).
pub const MAX_PART_NAME_BYTES: usize = 160;

/// What a node is called in displays, logs and the journal. It affects no result.
#[derive(Clone, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Label {
    /// The name of the node's part, in a run of [`Many`](super::Many) planners.
    pub part: Option<String>,
    /// The name within the part, such as `search gamma 1.3`.
    pub name: String,
}

impl Label {
    /// The label of this node in a part.
    #[must_use]
    pub(super) fn in_part(self, part: &str) -> Self {
        Self { part: Some(part.to_owned()), ..self }
    }

    /// The number of bytes of all names.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.part.as_ref().map_or(0, String::len) + self.name.len()
    }
}

impl fmt::Display for Label {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(part) = &self.part {
            write!(formatter, "{part}: ")?;
        }
        formatter.write_str(&self.name)
    }
}

/// As the text in quotes.
impl fmt::Debug for Label {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(&self.to_string(), formatter)
    }
}

impl From<String> for Label {
    fn from(name: String) -> Self {
        Self { part: None, name }
    }
}

impl From<&str> for Label {
    fn from(name: &str) -> Self {
        name.to_owned().into()
    }
}
