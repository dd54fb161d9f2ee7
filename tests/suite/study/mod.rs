//! Studies end to end, on materials and light from formulas: their files, resuming, and the stored results of the small preset.

mod preset;
mod refusals;
mod scene;
