//! Generalised pattern search with the settings of MATLAB's `patternsearch`, the search of \[BP20b\].
//!
//! From the incumbent x the poll tries x + m e_1, ..., x + m e_n, x - m e_1, ..., x - m e_n, in this order, where m is
//! the mesh size in the box's scaled coordinates. The first better point becomes the incumbent (no complete poll) and
//! the mesh size doubles, without limit. The next poll starts from e_1 again. If no point is better, the mesh size
//! halves. There is no search step, no accelerator and no cache of visited points. Source: the Global Optimization
//! Toolbox pages "How Pattern Search Polling Works", "Set Mesh Options", "Set Options" (its table of defaults) and the
//! exit flags of `patternsearch`; Torczon, *On the Convergence of Pattern Search Algorithms* (SIAM J. Optim. 7(1),
//! 1997).
//!
//! The search ends when one of these holds, tested in this order after each iteration:
//! 1. the mesh size is below the mesh tolerance;
//! 2. the mesh size and, in units of x, the change in x of a successful poll are below the step tolerance;
//! 3. the mesh size is below the step tolerance and the decrease of a successful poll was below the function tolerance;
//! 4. 100 n iterations or 2000 n evaluations are used up.
//!
//! Rules 2 and 3 are MATLAB's exit flags 2 and 3 ("the change in x", or in the function, "and the mesh size are both
//! less than the specified tolerance"; the page "Setting Solver Tolerances" does not mention the mesh). With the
//! default tolerances, which are equal, rule 1 always applies first. Rules 2 and 3 apply only if a caller sets a step
//! tolerance above the mesh tolerance.
//!
//! Differences from MATLAB, and points that its documentation leaves open:
//! - Scaling is by the bounds (see [`bounds`](super::bounds)), not by `ScaleMesh`.
//! - A point outside the box is skipped and not counted. MATLAB "modifies poll points to be feasible", but does not
//!   describe how for bounds. With skipping, the search may end up to the final mesh size away from a bound.
//! - The evaluation limit is exact, also within a poll.
//! - A point whose value is not finite is rejected like a worse one; at the start it is an error.

use super::bounds::Bounds;
use super::error::{SearchError, check_option};
use super::termination::{Progress, Termination};
use std::ops::ControlFlow;

/// Settings of a pattern search.
#[derive(Debug, Clone, PartialEq)]
pub struct PatternOptions {
    /// Mesh size of the first poll, in scaled coordinates, above 0.
    pub initial_mesh: f64,
    /// Factor of the mesh size after a success, at least 1.
    pub expansion: f64,
    /// Factor of the mesh size after a failure, in (0, 1).
    pub contraction: f64,
    /// The search ends when the mesh size is below this, above 0.
    pub mesh_tolerance: f64,
    /// The search ends when the mesh size and, in units of x, the change in x are below this, at least 0.
    pub step_tolerance: f64,
    /// The search ends when the decrease is below this and the mesh size below the step tolerance, at least 0.
    pub function_tolerance: f64,
    /// Largest number of polls.
    pub max_iterations: usize,
    /// Largest number of evaluations, the start included, at least 1.
    pub max_evaluations: usize,
}

impl PatternOptions {
    /// The defaults of MATLAB's `patternsearch` for this many parameters.
    #[must_use]
    pub const fn matlab(dimension: usize) -> Self {
        Self {
            initial_mesh: 1.0,
            expansion: 2.0,
            contraction: 0.5,
            mesh_tolerance: 1e-6,
            step_tolerance: 1e-6,
            function_tolerance: 1e-6,
            max_iterations: 100 * dimension,
            max_evaluations: 2000 * dimension,
        }
    }

    fn check(&self) -> Result<(), SearchError> {
        let positive = |x: f64| x > 0.0 && x.is_finite();
        let finite_factor = self.expansion >= 1.0 && self.expansion.is_finite();
        check_option("initial_mesh", self.initial_mesh, positive(self.initial_mesh), "a number above 0")?;
        check_option("expansion", self.expansion, finite_factor, "a number of at least 1")?;
        let shrinks = self.contraction > 0.0 && self.contraction < 1.0;
        check_option("contraction", self.contraction, shrinks, "a number between 0 and 1, both excluded")?;
        check_option("mesh_tolerance", self.mesh_tolerance, positive(self.mesh_tolerance), "a number above 0")?;
        check_option("step_tolerance", self.step_tolerance, self.step_tolerance >= 0.0, "a number of at least 0")?;
        let tolerance = self.function_tolerance;
        check_option("function_tolerance", tolerance, tolerance >= 0.0, "a number of at least 0")?;
        check_option("max_evaluations", self.max_evaluations as f64, self.max_evaluations > 0, "at least 1")
    }
}

/// The result of a pattern search.
#[derive(Debug, Clone, PartialEq)]
pub struct Minimum {
    /// The best point, inside the box.
    pub point: Vec<f64>,
    /// The value that the objective returned for exactly this point; at most its value at the start.
    pub value: f64,
    /// Number of calls of the objective.
    pub evaluations: usize,
    /// Number of polls.
    pub iterations: usize,
    /// Why the search ended.
    pub termination: Termination,
    /// Mesh size at the end, in scaled coordinates.
    pub mesh_size: f64,
}

/// Minimises `objective` over the box from `start`, a point of the box.
///
/// # Errors
/// If the start is outside the box, the objective is not finite at the start, or an option is out of range.
pub fn minimise(
    objective: impl FnMut(&[f64]) -> f64,
    start: &[f64],
    bounds: &Bounds,
    options: &PatternOptions,
) -> Result<Minimum, SearchError> {
    minimise_observed(objective, start, bounds, options, &mut |_| ControlFlow::Continue(()))
}

/// [`minimise`] that calls `observe` after every evaluation. `Break` ends the search with the incumbent.
///
/// # Errors
/// As [`minimise`].
pub fn minimise_observed(
    objective: impl FnMut(&[f64]) -> f64,
    start: &[f64],
    bounds: &Bounds,
    options: &PatternOptions,
    observe: &mut dyn FnMut(&Progress<'_>) -> ControlFlow<()>,
) -> Result<Minimum, SearchError> {
    options.check()?;
    bounds.check_start(start)?;
    let mut search = Search {
        objective,
        observe,
        bounds,
        options,
        scaled: (0..start.len()).map(|i| bounds.to_scaled(i, start[i])).collect(),
        minimum: Minimum {
            point: start.to_vec(),
            value: f64::INFINITY,
            evaluations: 0,
            iterations: 0,
            termination: Termination::Stopped,
            mesh_size: options.initial_mesh,
        },
    };
    search.minimum.termination = search.run()?;
    Ok(search.minimum)
}

struct Search<'a, F> {
    objective: F,
    observe: &'a mut dyn FnMut(&Progress<'_>) -> ControlFlow<()>,
    bounds: &'a Bounds,
    options: &'a PatternOptions,
    /// The incumbent in scaled coordinates.
    scaled: Vec<f64>,
    /// The incumbent and the counts so far.
    minimum: Minimum,
}

/// The outcome of a poll.
enum Poll {
    Success { step: f64, decrease: f64 },
    Failure,
    Ended(Termination),
}

impl<F: FnMut(&[f64]) -> f64> Search<'_, F> {
    fn run(&mut self) -> Result<Termination, SearchError> {
        let start = self.minimum.point.clone();
        self.minimum.value = (self.objective)(&start);
        self.minimum.evaluations = 1;
        if !self.minimum.value.is_finite() {
            return Err(SearchError::NotFinite { what: "the objective", point: start });
        }
        if self.report().is_break() {
            return Ok(Termination::Stopped);
        }
        loop {
            if self.minimum.iterations >= self.options.max_iterations {
                return Ok(Termination::MaxIterations);
            }
            let poll = self.poll();
            self.minimum.iterations += 1;
            if let Some(termination) = self.update(&poll) {
                return Ok(termination);
            }
        }
    }

    /// Tries the points of the mesh around the incumbent until one is better.
    fn poll(&mut self) -> Poll {
        let n = self.scaled.len();
        let mut trial = self.minimum.point.clone();
        for direction in 0..2 * n {
            let axis = direction % n;
            let step = if direction < n { self.minimum.mesh_size } else { -self.minimum.mesh_size };
            let scaled = self.scaled[axis] + step;
            let (first, last) = self.bounds.scaled_range(axis);
            if scaled < first || scaled > last {
                continue;
            }
            if self.minimum.evaluations >= self.options.max_evaluations {
                return Poll::Ended(Termination::MaxEvaluations);
            }
            let previous = std::mem::replace(&mut trial[axis], self.bounds.to_natural(axis, scaled));
            let value = (self.objective)(&trial);
            self.minimum.evaluations += 1;
            let decrease = self.minimum.value - value;
            let success = value.is_finite() && decrease > 0.0;
            if success {
                self.scaled[axis] = scaled;
                self.minimum.point[axis] = trial[axis];
                self.minimum.value = value;
            }
            if self.report().is_break() {
                return Poll::Ended(Termination::Stopped);
            }
            if success {
                return Poll::Success { step: (trial[axis] - previous).abs(), decrease };
            }
            trial[axis] = previous;
        }
        Poll::Failure
    }

    /// Resizes the mesh after a poll. Returns a reason if the search is over.
    fn update(&mut self, poll: &Poll) -> Option<Termination> {
        let options = self.options;
        match poll {
            Poll::Success { .. } => self.minimum.mesh_size *= options.expansion,
            Poll::Failure => self.minimum.mesh_size *= options.contraction,
            Poll::Ended(termination) => return Some(*termination),
        }
        let mesh = self.minimum.mesh_size;
        if mesh < options.mesh_tolerance {
            return Some(Termination::MeshTolerance);
        }
        if let Poll::Success { step, decrease } = poll
            && mesh < options.step_tolerance
        {
            if *step < options.step_tolerance {
                return Some(Termination::StepTolerance);
            }
            if *decrease < options.function_tolerance {
                return Some(Termination::FunctionTolerance);
            }
        }
        (self.minimum.evaluations >= options.max_evaluations).then_some(Termination::MaxEvaluations)
    }

    fn report(&mut self) -> ControlFlow<()> {
        let Minimum { evaluations, iterations, value, ref point, .. } = self.minimum;
        (self.observe)(&Progress { evaluations, iterations, value, point })
    }
}

#[cfg(test)]
mod tests;
