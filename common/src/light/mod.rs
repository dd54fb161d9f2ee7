//! Natural light: the environment map, its layouts, and the density from which directions are sampled.
//!
//! [`Environment`] is radiance as a function of direction (canonical lat-long, bilinear). [`Mapping`] lists the layouts
//! of map files; [`to_lat_long`] converts each of them to the canonical layout and keeps the energy.
//! [`FORMULA_LIGHTS`] are three lights to look at a result under. [`LightDistribution`] draws directions with a density that follows the bilinear function.

mod distribution;
mod environment;
mod error;
mod formula;
mod mapping;
mod resample;

pub use distribution::{LightDistribution, LightSample};
pub use environment::Environment;
pub use error::LightError;
pub use formula::{FORMULA_LIGHTS, FormulaLight};
pub use mapping::Mapping;
pub use resample::to_lat_long;
