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

use crate::graph::Registry;

pub(super) use appraise::{AppraiseParameters, AppraisedWire};
pub(super) use brute_force::BruteForceParameters;
pub(super) use polish::PolishParameters;
pub(super) use render::{RenderParameters, RenderedWire};
pub(super) use report::{ReportParameters, ReportWire};
pub(super) use search::{CompressWire, DirectWire, SearchParameters};
pub(super) use select::SelectParameters;
pub(super) use transport::TransportParameters;
pub(super) use view::{ViewWire, joined};

/// All node types of fits and studies. Coordinator and workers hold the same registry.
#[must_use]
pub fn registry() -> Registry {
    Registry::default()
        .with(transport::Transport)
        .with(search::Search)
        .with(select::Select)
        .with(explore::Explore)
        .with(polish::Polish)
        .with(report::Report)
        .with(render::Render)
        .with(brute_force::BruteForce)
        .with(appraise::Appraise)
}

pub(super) const TRANSPORT: &str = "transport";
pub(super) const SEARCH: &str = "search";
pub(super) const SELECT: &str = "select";
pub(super) const EXPLORE: &str = "explore";
pub(super) const POLISH: &str = "polish";
pub(super) const REPORT: &str = "report";
pub(super) const RENDER: &str = "render";
pub(super) const BRUTE_FORCE: &str = "brute-force";
pub(super) const APPRAISE: &str = "appraise";
