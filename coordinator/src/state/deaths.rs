//! How often workers have died of a node.

/// The deaths of workers that executed a node.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Deaths {
    /// While they executed it, perhaps with others, or before it was a suspect.
    pub in_company: u32,
    /// While it had its worker for itself.
    pub alone: u32,
    /// While it had its worker for itself, when other workers died of something else.
    pub not_counted: u32,
}

impl Deaths {
    pub(crate) fn total(self) -> u32 {
        self.in_company + self.alone + self.not_counted
    }
}
