//! The real `lookalike-worker` under a name of its own, so that cargo hands its path to the suites.

fn main() {}
