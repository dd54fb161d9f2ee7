//! The kind of each node type: its name on the wire, in the journal and in logs.

/// Integrates the transport table of a subset's pixels.
pub const TRANSPORT: &str = "transport";
/// As [`TRANSPORT`], of the coarse picture's table.
pub const TRANSPORT_COARSE: &str = "transport-coarse";
/// As [`TRANSPORT`], of the full-resolution table.
pub const TRANSPORT_FULL: &str = "transport-full";
/// Searches the parameters at one gamma.
pub const SEARCH: &str = "search";
/// Judges the candidates.
pub const SELECT: &str = "select";
/// As [`SELECT`], on the coarse picture, before the choice among several models.
pub const SCOUT: &str = "scout";
/// Searches the coarse picture before polish.
pub const EXPLORE: &str = "explore";
/// Lowers the score of the winner.
pub const POLISH: &str = "polish";
/// Renders the pictures at the end of a fit.
pub const REPORT: &str = "report";
/// How well the photo determines the parameters of the match.
pub const UNCERTAINTY: &str = "uncertainty";
/// Compares the match with its neighbours under other lights.
pub const RELIGHT: &str = "relight";
/// Renders a photo.
pub const RENDER: &str = "render";
/// Minimises the score from one start.
pub const BRUTE_FORCE: &str = "brute-force";
/// Scores given parameters.
pub const APPRAISE: &str = "appraise";
