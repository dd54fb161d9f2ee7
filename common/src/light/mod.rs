//! Natural light: the environment map, its layouts, and the density it is sampled with.
//!
//! [`Environment`] is radiance as a function of direction (canonical lat-long, bilinear). [`Mapping`] names the layouts
//! files come in and [`to_lat_long`] brings each of them to the canonical one, keeping its energy.
//! [`LightDistribution`] draws directions with the density of the bilinear function itself.

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
