//! The kind of each node type: its name on the wire, in the journal and in logs.

pub(crate) const TRANSPORT: &str = "transport";
pub(crate) const SEARCH: &str = "search";
pub(crate) const SELECT: &str = "select";
pub(crate) const EXPLORE: &str = "explore";
pub(crate) const POLISH: &str = "polish";
pub(crate) const REPORT: &str = "report";
pub(crate) const RENDER: &str = "render";
pub(crate) const BRUTE_FORCE: &str = "brute-force";
pub(crate) const APPRAISE: &str = "appraise";
