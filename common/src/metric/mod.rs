//! The difference between two images: the per-pixel cost of stage one and the perceptual error CSSIM of stage two.
//!
//! Selection and polishing use [`Judge`]: CSSIM against a prepared reference. [`cid`] is the same measure on two
//! displayed images, with the authors' variants; [`icid`] is its successor. [`MetricKind`] has the metrics by name.
//! [`DisplayImage`] and [`auto_exposure`] are the display transform before them. The pipeline, in the order of the
//! files: `display`, `colour` and `scielab` (or `icam`) under `working`, `lab2000hl`, `differences`, then `cssim`; or
//! `window`, `features`, then `cid` or `icid`, and `maps` for pictures.
//!
//! Scores depend much more on resolution, exposure and background than on details of the formulas. Compare only scores
//! with equal resolution, exposure and background.

mod blocks;
mod cid;
mod colour;
pub mod cost;
mod cssim;
mod differences;
mod dispatch;
mod display;
mod error;
mod features;
mod icam;
mod icid;
mod kind;
mod lab2000hl;
mod maps;
mod noise;
mod planes;
mod region;
mod row_math;
mod scielab;
mod spans;
mod window;
mod working;

pub use blocks::{Block, Blocks};
pub use cid::{CidOptions, Scales, cid};
#[cfg(test)]
use colour::lab_from_linear;
pub use colour::linear_from_lab;
pub use cssim::{Judge, JudgeOptions, Score};
pub use dispatch::Lanes;
pub use display::{DisplayImage, auto_exposure, decode_srgb, encode_srgb};
pub use error::MetricError;
pub use icid::{IcidOptions, IcidScore, Intent, icid};
pub use kind::{Difference, MetricKind};
pub use lab2000hl::Lab2000hl;
pub use maps::{ErrorMap, Maps};
pub use noise::{noise_floor, relative_noise};
pub use working::SpatialFilter;

#[cfg(test)]
mod tests;
