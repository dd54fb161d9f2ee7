//! One test binary of modules, so that the suite links once.

mod cluster;
mod cluster_hostile;
