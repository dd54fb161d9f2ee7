//! The method's steps as nodes of the job graph: one file, one [`NodeType`](crate::graph::NodeType) each. Every node is a
//! pure function of its parameters and input blobs.
//!
//! `transport` and `search` run on workers; `select`, `explore`, `polish` and `report` in the coordinator's process.

mod explore;
mod polish;
mod report;
mod search;
mod select;
mod transport;
mod view;

use crate::graph::Registry;

pub(super) use polish::PolishParameters;
pub(super) use report::{ReportParameters, ReportWire};
pub(super) use search::{CompressWire, DirectWire, SearchParameters};
pub(super) use select::SelectParameters;
pub(super) use transport::TransportParameters;
pub(super) use view::{ViewWire, joined};

/// All node types of a fit. Coordinator and workers hold the same registry.
#[must_use]
pub fn registry() -> Registry {
    Registry::default()
        .with(transport::Transport)
        .with(search::Search)
        .with(select::Select)
        .with(explore::Explore)
        .with(polish::Polish)
        .with(report::Report)
}

pub(super) const TRANSPORT: &str = "transport";
pub(super) const SEARCH: &str = "search";
pub(super) const SELECT: &str = "select";
pub(super) const EXPLORE: &str = "explore";
pub(super) const POLISH: &str = "polish";
pub(super) const REPORT: &str = "report";
