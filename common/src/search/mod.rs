//! Minimisers of a function over a box. They know a closure and its bounds, and nothing about light.
//!
//! | module | minimises | where it comes from |
//! |---|---|---|
//! | [`pattern`] | any function, no derivatives | generalised pattern search, settings of MATLAB's `patternsearch` |
//! | [`quasi_newton`] | a smooth function, no derivatives | BFGS projected onto the box, differences |
//! | [`least_squares`] | a sum of squares with a Jacobian | Levenberg-Marquardt with the box inside the step |
//! | [`bvls`] | a linear sum of squares | bounded-variable least squares, Stark & Parker 1995 |
//! | [`multi_start`] | whatever one of the above does | the best few of many starts, equal minima merged |
//!
//! Everything is `f64` in a fixed order, on one thread or with its values collected in order: equal inputs give equal bits. Every search counts the calls of
//! its objective, can be watched and stopped ([`Progress`]), and says why it ended ([`Termination`]). A search never
//! returns a point outside its box, nor one worse than its start. An objective that is not finite at the start is an
//! error; elsewhere it is a rejected point.
//!
//! ```
//! use lookalike::search::{Bounds, pattern};
//! let bounds = Bounds::linear(&[0.0, 0.0], &[1.0, 1.0])?;
//! let bowl = |x: &[f64]| (x[0] - 0.25).abs() + (x[1] - 0.5).abs();
//! let minimum = pattern::minimise(bowl, &[1.0, 1.0], &bounds, &pattern::PatternOptions::matlab(2))?;
//! assert_eq!(minimum.point, [0.25, 0.5]);
//! # Ok::<(), lookalike::search::SearchError>(())
//! ```

pub mod bounds;
pub mod bvls;
#[cfg(test)]
pub(crate) mod derivative;
pub mod error;
pub mod least_squares;
pub mod multi_start;
pub mod normal_equations;
pub mod pattern;
pub mod quasi_newton;
pub mod sandwich;
mod semidefinite;
pub mod termination;
#[cfg(test)]
mod test_functions;

pub use bounds::{Bounds, Scale};
pub use error::SearchError;
pub use normal_equations::NormalEquations;
pub use sandwich::Sandwich;
pub use termination::{Progress, Termination};
