//! The coordinator: the command line of Lookalike, and the process that plans a fit, hands its nodes to workers and
//! judges the candidates.

pub mod access;
pub mod comm;
pub mod core;
pub mod reactor;
mod rpc;
pub mod runner;
pub mod spawn;
