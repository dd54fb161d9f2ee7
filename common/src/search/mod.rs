//! Minimisers of a function over a box. They take a closure and bounds, and do not depend on rendering.
//!
//! | module | minimises | method |
//! |---|---|---|
//! | [`pattern`] | any function, no derivatives | generalised pattern search, settings of MATLAB's `patternsearch` |
//! | [`quasi_newton`] | a smooth function, no derivatives | BFGS projected onto the box, finite differences |
//! | [`least_squares`] | a sum of squares with a Jacobian | Levenberg-Marquardt with the box inside the step |
//! | [`bvls`] | a linear sum of squares | bounded-variable least squares, Stark & Parker 1995 |
//! | [`multi_start`] | any function, by a search above | the best few of many starts, equal minima merged |
//!
//! Equal inputs give equal bits: all sums are `f64` in a fixed order, on one thread or over values collected in order.
//! Every search counts the calls of its objective, reports its progress to an observer that may stop it ([`Progress`]),
//! and returns the reason why it ended ([`Termination`]). The result lies in the box and is no worse than the start. An
//! objective that is not finite is an error at the start; elsewhere the point is rejected.
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
pub mod eigen;
pub mod error;
pub mod least_squares;
pub mod multi_start;
pub mod normal_equations;
pub mod pattern;
pub mod quasi_newton;
mod semidefinite;
pub mod termination;
#[cfg(test)]
mod test_functions;

pub use bounds::{Bounds, Scale};
pub use error::SearchError;
pub use normal_equations::NormalEquations;
pub use termination::{Progress, Termination};
