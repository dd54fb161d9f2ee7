//! The real `lookalike` under a name of its own, so that cargo hands its path to the suites.

fn main() {}
