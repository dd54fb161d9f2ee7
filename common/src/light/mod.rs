//! Natural light: the environment map, its layouts, and the density from which directions are sampled.
//!
//! [`Environment`] is radiance as a function of direction (canonical lat-long, bilinear). [`Mapping`] lists the layouts
//! of map files; [`to_lat_long`] converts each of them to the canonical layout and keeps the energy.
//! [`LightDistribution`] draws directions with a density that follows the bilinear function.

mod distribution;
mod environment;
mod error;
mod mapping;
mod resample;

pub use distribution::{LightDistribution, LightSample};
pub use environment::Environment;
pub use error::LightError;
pub use mapping::Mapping;
pub use resample::to_lat_long;
