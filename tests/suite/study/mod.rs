//! Studies end to end, on materials and light that need no file: what they leave, that they go on where they were, and that the small
//! preset gives what it gave.

mod preset;
mod refusals;
mod scene;
