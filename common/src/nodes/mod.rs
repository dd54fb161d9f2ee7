//! The steps of the method as nodes of the job graph, one file per [`NodeType`](crate::graph::NodeType). Every node is a pure function
//! of its parameters and input blobs.
//!
//! `transport` and `search` run on workers; `select`, `explore`, `polish`, `report`, `uncertainty` and `relight` in the coordinator's process, or on workers if a
//! batch asks for it. `render`, `brute-force` and `appraise` belong to studies.

mod appraise;
mod brute_force;
mod explore;
mod kinds;
mod polish;
mod relight;
mod render;
mod report;
mod search;
mod select;
mod transport;
mod uncertainty;
mod view;
pub(crate) mod wire;

use crate::graph::Registry;

pub(crate) use appraise::{AppraiseParameters, AppraisedWire};
pub(crate) use brute_force::BruteForceParameters;
pub(crate) use explore::ExploredWire;
pub use kinds::{
    APPRAISE, BRUTE_FORCE, EXPLORE, POLISH, RELIGHT, RENDER, REPORT, SCOUT, SEARCH, SELECT, TRANSPORT,
    TRANSPORT_COARSE, TRANSPORT_FULL, UNCERTAINTY,
};
pub(crate) use polish::PolishParameters;
pub(crate) use relight::{RelightParameters, RelitWire};
pub(crate) use render::{RenderParameters, RenderedWire};
pub(crate) use report::{ReportParameters, ReportWire};
pub(crate) use search::{DirectWire, SearchParameters};
pub(crate) use select::SelectParameters;
pub(crate) use transport::TransportParameters;
pub(crate) use uncertainty::{UncertaintyParameters, UncertaintyWire};
pub(crate) use view::{ViewWire, joined};

/// All node types of fits and studies. Coordinator and workers hold the same registry.
#[must_use]
pub fn registry() -> Registry {
    Registry::default()
        .with(transport::Transport { kind: TRANSPORT })
        .with(transport::Transport { kind: TRANSPORT_COARSE })
        .with(transport::Transport { kind: TRANSPORT_FULL })
        .with(search::Search)
        .with(select::Select { kind: SELECT })
        .with(select::Select { kind: SCOUT })
        .with(explore::Explore)
        .with(polish::Polish)
        .with(report::Report)
        .with(uncertainty::Uncertainty)
        .with(relight::Relight)
        .with(render::Render)
        .with(brute_force::BruteForce)
        .with(appraise::Appraise)
}
