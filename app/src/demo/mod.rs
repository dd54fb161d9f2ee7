//! The bundled scene: a light and a material in closed form, so that the demo needs no files and gives the same bits on every
//! machine.
//!
//! Radiance is linear Rec. 709; directions are those of the conventions: +Y up, the camera on +Z.

pub mod environment;
pub mod material;
mod pavilion;
pub mod photo;
mod sky;
