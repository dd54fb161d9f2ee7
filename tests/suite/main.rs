//! One test binary of modules, so that the suite links once.

mod bad_input;
mod cli;
mod cluster;
mod cluster_hostile;
mod compare;
mod fit;
mod network;
mod program;
mod render;
mod tidy;
