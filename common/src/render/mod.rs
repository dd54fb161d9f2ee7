//! From light, shape and BRDF to pixels.
//!
//! Two independent ways to the same numbers: the direct [`integrator`] (Monte Carlo, the slow reference, any
//! reflectance) and the [`transport`] tables (deterministic adaptive quadrature over a [`pyramid`] of the light, for the
//! basis lobes of a model), each tested against the other.
//!
//! Direct light from the environment only: a convex object, no inter-reflection.

mod blur;
pub mod cut;
pub mod footprint;
pub mod image;
pub mod integrator;
pub mod knots;
pub mod point;
pub mod pyramid;
pub mod subset;
pub mod table;
pub mod transport;
