//! The commands. Each takes its settings and returns the exit code of a completed run; the command line reports errors.

pub(crate) mod access;
pub(crate) mod batch;
pub(crate) mod compare;
pub(crate) mod demo;
pub(crate) mod fit;
mod output;
pub(crate) mod render;
pub(crate) mod status;
pub(crate) mod study;
mod submit;
pub(crate) mod worker;
