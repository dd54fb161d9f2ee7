//! The coordinator: runs the nodes of a planner's job graph on workers that connect to it, and keeps the journal of the
//! run. It knows neither rendering nor a command line: it imports `lookalike`'s graph and protocol only.

pub mod access;
pub mod actions;
pub mod atomic;
pub mod events;
pub mod journal;
pub mod limits;
pub mod metrics;
pub mod policy;
pub mod reactor;
mod rpc;
pub mod runner;
pub mod spawn;
pub mod state;
pub mod tls;
