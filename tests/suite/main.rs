//! One test binary of modules, so that the suite links once.

mod cli;
mod physics;
mod recovery;
