//! `lookalike fit` from end to end: the real program, its worker processes and its files, on a small scene created by the test.

mod ending;
mod outputs;
mod resume;
mod same_bits;
pub(crate) mod scene;
mod settings;
