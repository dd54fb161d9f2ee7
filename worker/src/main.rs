//! `lookalike-worker`: argument parsing only; everything else is in the library.

fn main() {}
