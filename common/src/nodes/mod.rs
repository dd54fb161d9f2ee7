//! The method's steps as nodes of the job graph: one file, one [`NodeType`](crate::graph::NodeType) each. Every node is a
//! pure function of its parameters and input blobs.
//!
//! `transport` and `search` run on workers; `select`, `explore`, `polish` and `report` in the coordinator's process. `render`, `brute-force`
//! and `appraise` belong to studies.

mod appraise;
mod brute_force;
mod explore;
mod polish;
mod render;
mod report;
mod search;
mod select;
mod transport;
mod view;
pub(crate) mod wire;

use crate::graph::Registry;

pub(crate) use appraise::{AppraiseParameters, AppraisedWire};
pub(crate) use brute_force::BruteForceParameters;
pub(crate) use polish::PolishParameters;
pub(crate) use render::{RenderParameters, RenderedWire};
pub(crate) use report::{ReportParameters, ReportWire};
pub(crate) use search::{CompressWire, DirectWire, SearchParameters};
pub(crate) use select::SelectParameters;
pub(crate) use transport::TransportParameters;
pub(crate) use view::{ViewWire, joined};

/// All node types of fits and studies. Coordinator and workers hold the same registry.
#[must_use]
pub fn registry() -> Registry {
    Registry::default()
        .with(transport::Transport { kind: TRANSPORT })
        .with(transport::Transport { kind: TRANSPORT_FULL })
        .with(search::Search)
        .with(select::Select)
        .with(explore::Explore)
        .with(polish::Polish)
        .with(report::Report)
        .with(render::Render)
        .with(brute_force::BruteForce)
        .with(appraise::Appraise)
}

/// Integrates the transport table of pixels of a subset or of the coarse picture.
pub const TRANSPORT: &str = "transport";
/// As [`TRANSPORT`], of the full-resolution table.
pub const TRANSPORT_FULL: &str = "transport-full";
/// Searches the parameters at one gamma.
pub const SEARCH: &str = "search";
/// Judges the candidates.
pub const SELECT: &str = "select";
/// Searches the coarse picture before polish.
pub const EXPLORE: &str = "explore";
/// Lowers the score of the winner.
pub const POLISH: &str = "polish";
/// Renders what a fit ends with.
pub const REPORT: &str = "report";
/// Renders a photo.
pub const RENDER: &str = "render";
/// Minimises the score from one start.
pub const BRUTE_FORCE: &str = "brute-force";
/// Scores given parameters.
pub const APPRAISE: &str = "appraise";
