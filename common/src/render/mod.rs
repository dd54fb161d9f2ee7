//! Renders pixels from light, shape and BRDF.
//!
//! Two independent methods compute the same numbers and are tested against each other: the direct [`integrator`] (Monte Carlo, the
//! slow reference, any reflectance) and the [`transport`] tables (deterministic adaptive quadrature over a [`pyramid`] of the light,
//! for the basis lobes of a model).
//!
//! Only direct light from the environment is rendered: the object is taken as convex, without inter-reflection.

mod blur;
pub mod cut;
pub mod footprint;
mod grid;
pub mod image;
pub mod integrator;
pub mod knots;
mod moments;
pub mod point;
pub mod pyramid;
pub mod spans;
pub mod subset;
pub mod table;
pub mod transport;
