//! Counts of workers that died while they executed a node.

/// The deaths of workers that executed a node.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Deaths {
    /// While it ran together with other nodes, or before it was a suspect.
    pub in_company: u32,
    /// While it was the only node on its worker.
    pub alone: u32,
    /// While it was the only node on its worker, but other workers were dying for a different reason.
    pub not_counted: u32,
}

impl Deaths {
    pub(crate) fn total(self) -> u32 {
        self.in_company + self.alone + self.not_counted
    }
}
