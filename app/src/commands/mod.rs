//! The commands: what each does with its settings. They return the exit code of a run that was carried out; errors are
//! reported by the command line.

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
