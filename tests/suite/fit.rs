//! `lookalike fit` from end to end: the real binary, its worker processes, its files, on a small scene that the test makes.

mod ending;
mod outputs;
mod resume;
mod same_bits;
pub(crate) mod scene;
mod settings;
