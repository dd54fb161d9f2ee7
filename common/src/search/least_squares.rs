//! Levenberg-Marquardt for residuals r(x) in R^m over a box, with m up to hundreds of thousands and a few parameters n.
//!
//! Minimises `|r(x)|^2`. With J the Jacobian, each iteration takes the step d that minimises the damped linear model
//! `|r + J d|^2 + mu |D d|^2` *over the box*: a bounded linear least-squares problem that [`bvls`] solves exactly. So a
//! coordinate whose minimum is at a bound reaches it in one step and is equal to it to the bit, a coordinate at a bound
//! can leave it, and no step is shortened or projected. The step is 0 if and only if the Karush-Kuhn-Tucker conditions
//! of the box hold.
//!
//! - Damping mu: Nielsen, *Damping Parameter in Marquardt's Method* (IMM-REP-1999-05), the rule of Madsen, Nielsen &
//!   Tingleff, *Methods for Non-Linear Least Squares Problems* (2004). It has a minimum above 0, so that a singular
//!   `J^T J` (two parameters that the residuals do not distinguish) gives a bounded step, which does not change the
//!   undetermined combination.
//! - D^2: the largest diagonal of `J^T J` so far (More 1978), which makes the path independent of units.
//! - Bounds: Kanzow, Yamashita & Fukushima, *Levenberg-Marquardt Methods with Strong Local Convergence Properties for
//!   Solving Nonlinear Equations with Convex Constraints* (J. Comput. Appl. Math. 172, 2004) prove local quadratic
//!   convergence of this constrained step. They damp by the residual, this code by Nielsen's rule.
//!
//! Coordinates are scaled by the box (see [`bounds`](super::bounds)), so a logarithmic parameter is searched in its
//! logarithm. Problems use natural parameters; the chain rule is applied here.
//!
//! Why not a crate: `levenberg-marquardt` 0.13 (MINPACK's `lmder`) has no bounds and stores J; `argmin` 0.10 has
//! Gauss-Newton without bounds; `basin` has bounded variants on a stored J and a linear-algebra backend. They do not
//! accept normal equations, which avoid storing 200,000 rows. And equal bits on every platform need a fixed order of
//! elimination.

use super::bounds::Bounds;
use super::bvls::{self, BoundState};
use super::error::{SearchError, check_option};
use super::normal_equations::NormalEquations;
use super::termination::{Progress, Termination};
use std::ops::ControlFlow;

/// Residuals r(x) of a few parameters, given by their sum of squares and their normal equations.
pub trait LeastSquaresProblem {
    /// Number of parameters n.
    fn dimension(&self) -> usize;

    /// The sum of squares `|r(x)|^2` at a natural point of the box. A value that is not finite rejects the point.
    fn cost(&mut self, point: &[f64]) -> f64;

    /// Adds `J^T J` and `J^T r` at a natural point to `normal`, which is zero, with one
    /// [`add_row`](NormalEquations::add_row) per residual or in blocks. It is called only where the cost is finite.
    /// Values that are not finite reject the point.
    fn linearise(&mut self, point: &[f64], normal: &mut NormalEquations);
}

/// Settings of a least-squares search.
#[derive(Debug, Clone, PartialEq)]
pub struct LeastSquaresOptions {
    /// The search ends when the cosine of the angle between the residuals and each column of J with descent inside the
    /// box is at most this (MINPACK's gtol). At least 0.
    pub gradient_tolerance: f64,
    /// The search ends when a step, in scaled coordinates, is at most this times (the length of the point + this). At
    /// least 0.
    pub step_tolerance: f64,
    /// The search ends when both the actual and the predicted change of the cost are at most this fraction of the cost.
    /// At least 0.
    pub cost_tolerance: f64,
    /// First damping mu, in units of the squared column lengths, above 0.
    pub initial_damping: f64,
    /// Largest number of evaluations of the cost, the start included, at least 1.
    pub max_evaluations: usize,
}

impl Default for LeastSquaresOptions {
    /// The tolerances are so small that tighter ones change no reported figure. The damping is that which Madsen,
    /// Nielsen & Tingleff recommend for a start of moderate quality.
    fn default() -> Self {
        Self {
            gradient_tolerance: 1e-10,
            step_tolerance: 1e-10,
            cost_tolerance: 1e-12,
            initial_damping: 1e-3,
            max_evaluations: 200,
        }
    }
}

impl LeastSquaresOptions {
    fn check(&self) -> Result<(), SearchError> {
        let at_least_zero = "a number of at least 0";
        check_option("gradient_tolerance", self.gradient_tolerance, self.gradient_tolerance >= 0.0, at_least_zero)?;
        check_option("step_tolerance", self.step_tolerance, self.step_tolerance >= 0.0, at_least_zero)?;
        check_option("cost_tolerance", self.cost_tolerance, self.cost_tolerance >= 0.0, at_least_zero)?;
        let positive = self.initial_damping > 0.0 && self.initial_damping.is_finite();
        check_option("initial_damping", self.initial_damping, positive, "a number above 0")?;
        check_option("max_evaluations", self.max_evaluations as f64, self.max_evaluations > 0, "at least 1")
    }
}

/// The result of a least-squares search.
#[derive(Debug, Clone, PartialEq)]
pub struct Minimum {
    /// The best point, natural, inside the box.
    pub point: Vec<f64>,
    /// The sum of squares that [`LeastSquaresProblem::cost`] returned for exactly this point; at most that at the
    /// start.
    pub value: f64,
    /// Calls of `cost`.
    pub evaluations: usize,
    /// Accepted steps.
    pub iterations: usize,
    /// Why the search ended.
    pub termination: Termination,
    /// Whether each coordinate is equal to a bound.
    pub states: Vec<BoundState>,
    /// `J^T J` and `J^T r` at the point, in natural parameters. Its [`NormalEquations::variances`] over the free
    /// parameters, times the variance of the residuals, are the predicted variances of the parameters.
    pub normal: NormalEquations,
}

/// Minimises the problem's sum of squares over the box from `start`, a point of the box.
///
/// # Errors
/// If the problem or the start does not fit the box, the cost or its linearisation is not finite at the start, or an
/// option is out of range.
pub fn minimise(
    problem: &mut dyn LeastSquaresProblem,
    start: &[f64],
    bounds: &Bounds,
    options: &LeastSquaresOptions,
) -> Result<Minimum, SearchError> {
    minimise_observed(problem, start, bounds, options, &mut |_| ControlFlow::Continue(()))
}

/// [`minimise`] that calls `observe` after every evaluation. `Break` ends the search with the incumbent.
///
/// # Errors
/// As [`minimise`].
pub fn minimise_observed(
    problem: &mut dyn LeastSquaresProblem,
    start: &[f64],
    bounds: &Bounds,
    options: &LeastSquaresOptions,
    observe: &mut dyn FnMut(&Progress<'_>) -> ControlFlow<()>,
) -> Result<Minimum, SearchError> {
    options.check()?;
    super::error::check_dimension("the problem", bounds.dimension(), problem.dimension())?;
    bounds.check_start(start)?;
    let value = problem.cost(start);
    if !value.is_finite() {
        return Err(SearchError::NotFinite { what: "the sum of squares", point: start.to_vec() });
    }
    let Some(incumbent) = Incumbent::at(problem, bounds, start.to_vec(), value) else {
        return Err(SearchError::NotFinite { what: "the Jacobian", point: start.to_vec() });
    };
    let column_squares = vec![0.0; start.len()];
    let damping = Damping { mu: options.initial_damping, growth: 2.0 };
    let mut search =
        Search { problem, bounds, options, observe, incumbent, column_squares, damping, evaluations: 1, iterations: 0 };
    let termination = search.run()?;
    Ok(search.finish(termination))
}

struct Search<'a> {
    problem: &'a mut dyn LeastSquaresProblem,
    bounds: &'a Bounds,
    options: &'a LeastSquaresOptions,
    observe: &'a mut dyn FnMut(&Progress<'_>) -> ControlFlow<()>,
    incumbent: Incumbent,
    /// D^2: the largest diagonal of `J^T J` so far, scaled coordinates.
    column_squares: Vec<f64>,
    damping: Damping,
    evaluations: usize,
    iterations: usize,
}

/// The best point so far with its linearisation.
#[derive(Debug)]
struct Incumbent {
    point: Vec<f64>,
    scaled: Vec<f64>,
    value: f64,
    natural_normal: NormalEquations,
    normal: NormalEquations,
}

/// A step of the damped model with its predicted decrease.
#[derive(Debug)]
struct Step {
    scaled: Vec<f64>,
    /// Decrease of the sum of squares that the undamped linear model predicts.
    predicted: f64,
    length: f64,
}

/// Nielsen's damping.
#[derive(Debug)]
struct Damping {
    mu: f64,
    growth: f64,
}

impl Search<'_> {
    fn run(&mut self) -> Result<Termination, SearchError> {
        if self.report().is_break() {
            return Ok(Termination::Stopped);
        }
        loop {
            if self.incumbent.largest_cosine(self.bounds) <= self.options.gradient_tolerance {
                return Ok(Termination::GradientTolerance);
            }
            let step = self.step()?;
            if step.scaled == self.incumbent.scaled {
                return Ok(Termination::StepTolerance);
            }
            // The model predicts no decrease; a negative value is rounding.
            if step.predicted <= 0.0 {
                return Ok(Termination::FunctionTolerance);
            }
            if self.evaluations >= self.options.max_evaluations {
                return Ok(Termination::MaxEvaluations);
            }
            if let Some(termination) = self.try_step(&step) {
                return Ok(termination);
            }
        }
    }

    /// The minimum of the damped linear model over the box.
    fn step(&mut self) -> Result<Step, SearchError> {
        let Incumbent { scaled, normal, .. } = &self.incumbent;
        let n = scaled.len();
        for i in 0..n {
            self.column_squares[i] = self.column_squares[i].max(normal.matrix(i, i));
        }
        let largest = self.column_squares.iter().copied().fold(0.0, f64::max);
        let mut damped = normal.clone();
        let (mut lower, mut upper) = (vec![0.0; n], vec![0.0; n]);
        for i in 0..n {
            // A column that was always 0 is damped like a weak one, so that its coordinate does not change.
            let square = self.column_squares[i].max(largest * f64::EPSILON);
            damped.set_matrix(i, i, normal.matrix(i, i) + self.damping.mu * square);
            damped.set_vector(i, -normal.vector(i));
            let (first, last) = self.bounds.scaled_range(i);
            (lower[i], upper[i]) = (first - scaled[i], last - scaled[i]);
        }
        let solution = bvls::solve(&damped, &lower, &upper)?;
        let landing = (0..n).map(|i| {
            let (first, last) = self.bounds.scaled_range(i);
            match solution.states[i] {
                BoundState::AtLower => first,
                BoundState::AtUpper => last,
                BoundState::Free => (scaled[i] + solution.point[i]).clamp(first, last),
            }
        });
        Ok(self.incumbent.step_to(landing.collect()))
    }

    /// Evaluates a step and takes it if it is better. Returns a reason if the search is over.
    fn try_step(&mut self, step: &Step) -> Option<Termination> {
        let point: Vec<f64> = (0..step.scaled.len())
            .map(|i| match step.scaled[i] == self.incumbent.scaled[i] {
                true => self.incumbent.point[i],
                false => self.bounds.to_natural(i, step.scaled[i]),
            })
            .collect();
        let value = self.problem.cost(&point);
        self.evaluations += 1;
        let previous = self.incumbent.value;
        let decrease = previous - value;
        let is_better = value.is_finite() && decrease > 0.0;
        let next = if is_better { Incumbent::at(self.problem, self.bounds, point, value) } else { None };
        let length = norm(&self.incumbent.scaled);
        if let Some(mut next) = next {
            next.scaled.clone_from(&step.scaled);
            self.incumbent = next;
            self.iterations += 1;
            self.damping.relax(decrease / step.predicted);
        } else {
            self.damping.tighten();
        }
        if self.report().is_break() {
            return Some(Termination::Stopped);
        }
        let negligible = self.options.cost_tolerance * previous;
        if decrease.abs() <= negligible && step.predicted <= negligible {
            return Some(Termination::FunctionTolerance);
        }
        let tolerance = self.options.step_tolerance;
        (step.length <= tolerance * (length + tolerance)).then_some(Termination::StepTolerance)
    }

    fn report(&mut self) -> ControlFlow<()> {
        let Incumbent { ref point, value, .. } = self.incumbent;
        (self.observe)(&Progress { evaluations: self.evaluations, iterations: self.iterations, value, point })
    }

    fn finish(self, termination: Termination) -> Minimum {
        let Incumbent { point, value, natural_normal, .. } = self.incumbent;
        let states = (0..point.len()).map(|i| match point[i] {
            x if x == self.bounds.lower()[i] => BoundState::AtLower,
            x if x == self.bounds.upper()[i] => BoundState::AtUpper,
            _ => BoundState::Free,
        });
        Minimum {
            states: states.collect(),
            point,
            value,
            evaluations: self.evaluations,
            iterations: self.iterations,
            termination,
            normal: natural_normal,
        }
    }
}

impl Incumbent {
    /// Linearises at a point of known, finite cost; `None` if the linearisation is not finite.
    fn at(problem: &mut dyn LeastSquaresProblem, bounds: &Bounds, point: Vec<f64>, value: f64) -> Option<Self> {
        let mut natural_normal = NormalEquations::new(point.len());
        problem.linearise(&point, &mut natural_normal);
        let derivative: Vec<f64> = (0..point.len()).map(|i| bounds.scaled_derivative(i, point[i])).collect();
        let normal = natural_normal.reparametrised(&derivative);
        let scaled = (0..point.len()).map(|i| bounds.to_scaled(i, point[i])).collect();
        (natural_normal.is_finite() && normal.is_finite()).then_some(Self {
            point,
            scaled,
            value,
            natural_normal,
            normal,
        })
    }

    /// The largest cosine of the angle between the residuals and a column of J, over the coordinates with descent
    /// inside the box.
    fn largest_cosine(&self, bounds: &Bounds) -> f64 {
        let mut largest = 0.0;
        for (i, &t) in self.scaled.iter().enumerate() {
            let (first, last) = bounds.scaled_range(i);
            let gradient = self.normal.vector(i);
            let is_blocked = (t <= first && gradient >= 0.0) || (t >= last && gradient <= 0.0);
            let square = self.normal.matrix(i, i) * self.value;
            if !is_blocked && square > 0.0 {
                largest = f64::max(largest, gradient.abs() / square.sqrt());
            }
        }
        largest
    }

    fn step_to(&self, scaled: Vec<f64>) -> Step {
        let step: Vec<f64> = scaled.iter().zip(&self.scaled).map(|(new, old)| new - old).collect();
        let curved = self.normal.times(&step);
        let predicted = -(0..step.len()).map(|i| step[i] * (2.0 * self.normal.vector(i) + curved[i])).sum::<f64>();
        Step { scaled, predicted, length: norm(&step) }
    }
}

impl Damping {
    /// After a success whose decrease was `ratio` of the predicted one.
    fn relax(&mut self, ratio: f64) {
        let x = 2.0 * ratio - 1.0;
        self.mu = (self.mu * f64::max(1.0 / 3.0, 1.0 - x * x * x)).max(MIN_DAMPING);
        self.growth = 2.0;
    }

    /// After a failure.
    fn tighten(&mut self) {
        // The cap is far above any useful damping. Without it repeated failures would lead to infinity, not to a
        // tolerance.
        self.mu = (self.mu * self.growth).min(1e60);
        self.growth *= 2.0;
    }
}

fn norm(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// The minimum of the damping: a hundred times the rank tolerance of the elimination, so that a dependent column keeps
/// a pivot, and too small to slow the last, quadratic steps.
const MIN_DAMPING: f64 = 1e-12;

#[cfg(test)]
mod tests;
