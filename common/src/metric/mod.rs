//! How far apart two images are: the per-pixel cost of stage one and the perceptual error CSSIM of stage two.

pub mod cost;
