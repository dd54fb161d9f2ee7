//! BVLS: linear least squares with bounds on the variables, for a few variables, given by the normal equations.
//!
//! Minimises `|A x - b|^2`, that is `x^T (A^T A) x / 2 - (A^T b)^T x` up to constants, over lower <= x <= upper.
//!
//! Source: Stark & Parker, *Bounded-Variable Least-Squares: an Algorithm and Applications* (Computational Statistics
//! 10, 1995). Variables are free or at a bound. The free variables move towards their unconstrained minimum. If one of
//! them reaches a bound on the way, it is fixed there and the others continue. At the minimum over the free variables,
//! the variable at a bound with the steepest descent into the box is freed. The search ends when no variable at a bound
//! has descent into the box. These are the Karush-Kuhn-Tucker conditions, which are sufficient because the problem is
//! convex.
//!
//! This version differs in two ways. It works on the normal equations (Stark & Parker: on a QR factorisation of A),
//! because the residuals of many pixels are summed to them. And freeing a variable is undone unless it lowers the
//! objective, as computed from the step. That prevents cycling; Stark & Parker test the sign of one step.
//!
//! `A^T A` may be singular: one of the equal minima is returned, and dependent variables keep their values.

use super::error::{SearchError, check_dimension};
use super::normal_equations::NormalEquations;

/// The state of a variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BoundState {
    /// Between its bounds.
    Free,
    /// Equal to its lower bound.
    AtLower,
    /// Equal to its upper bound.
    AtUpper,
}

/// The minimum of a bounded linear least-squares problem.
#[derive(Debug, Clone, PartialEq)]
pub struct BoundedSolution {
    /// The minimum. A variable at a bound is equal to it to the bit.
    pub point: Vec<f64>,
    /// The state of each variable.
    pub states: Vec<BoundState>,
}

/// Solves the problem whose `A^T A` and `A^T b` are `normal`, starting from 0 clamped to the box. Bounds may be
/// infinite if `A^T A` is regular.
///
/// # Errors
/// If a bound has the wrong length, a range is empty or NaN, or the normal equations are not finite.
pub fn solve(normal: &NormalEquations, lower: &[f64], upper: &[f64]) -> Result<BoundedSolution, SearchError> {
    let n = normal.dimension();
    check_dimension("the lower bound", n, lower.len())?;
    check_dimension("the upper bound", n, upper.len())?;
    for (index, (&lower, &upper)) in lower.iter().zip(upper).enumerate() {
        if !(lower <= upper && lower < f64::INFINITY && upper > f64::NEG_INFINITY) {
            return Err(SearchError::EmptyRange { index, lower, upper });
        }
    }
    if !normal.is_finite() {
        return Err(SearchError::NormalNotFinite);
    }
    let mut set = ActiveSet::new(normal, lower, upper);
    set.minimise_free();
    set.free_bound_variables();
    Ok(BoundedSolution { point: set.point, states: set.states })
}

/// The iterate: always inside the box; after [`minimise_free`](Self::minimise_free), at the minimum over its free
/// variables.
#[derive(Debug)]
struct ActiveSet<'a> {
    normal: &'a NormalEquations,
    lower: &'a [f64],
    upper: &'a [f64],
    point: Vec<f64>,
    states: Vec<BoundState>,
}

impl<'a> ActiveSet<'a> {
    fn new(normal: &'a NormalEquations, lower: &'a [f64], upper: &'a [f64]) -> Self {
        let point: Vec<f64> = lower.iter().zip(upper).map(|(&lower, &upper)| 0.0_f64.clamp(lower, upper)).collect();
        let mut set = Self { normal, lower, upper, point, states: vec![BoundState::Free; lower.len()] };
        (0..set.point.len()).for_each(|i| set.fix_at_bound(i));
        set
    }

    /// Moves the free variables to their minimum. A variable that reaches a bound on the way is fixed there.
    fn minimise_free(&mut self) {
        // Every round but the last fixes at least one more variable.
        for _ in 0..=self.point.len() {
            let step = self.free_step();
            let fraction = (0..step.len()).map(|i| self.fraction_to_bound(i, step[i])).fold(1.0, f64::min);
            for (i, &step) in step.iter().enumerate().filter(|&(_, &step)| step != 0.0) {
                let blocks = fraction < 1.0 && self.fraction_to_bound(i, step) <= fraction;
                let bound = if step < 0.0 { self.lower[i] } else { self.upper[i] };
                self.point[i] = if blocks { bound } else { self.point[i] + fraction * step };
                self.point[i] = self.point[i].clamp(self.lower[i], self.upper[i]);
                self.fix_at_bound(i);
            }
            if fraction >= 1.0 {
                return;
            }
        }
    }

    /// Frees variables at bounds, one at a time, while that lowers the objective.
    fn free_bound_variables(&mut self) {
        let n = self.point.len();
        let mut tried = vec![false; n];
        // In exact arithmetic each success reaches a new face of the box. The limit is far above what is needed in
        // practice; it ends the search if rounding makes it move among equal points.
        for _ in 0..ATTEMPTS * (n + 1) * (n + 1) {
            let Some(i) = self.steepest_at_bound(&tried) else { return };
            let (point, states, pull) = (self.point.clone(), self.states.clone(), self.descent());
            self.states[i] = BoundState::Free;
            self.minimise_free();
            if self.decrease_since(&point, &pull) > 0.0 {
                tried.fill(false);
            } else {
                (self.point, self.states) = (point, states);
                tried[i] = true;
            }
        }
    }

    /// The unconstrained step to the minimum over the free variables; 0 for all others.
    fn free_step(&self) -> Vec<f64> {
        let free: Vec<usize> = (0..self.point.len()).filter(|&i| self.states[i] == BoundState::Free).collect();
        let descent = self.descent();
        let rhs: Vec<f64> = free.iter().map(|&i| descent[i]).collect();
        let mut step = vec![0.0; self.point.len()];
        for (&i, value) in free.iter().zip(self.normal.factor(&free).solve(&rhs)) {
            step[i] = value;
        }
        step
    }

    /// The fraction of `step` after which variable `i` reaches its bound; above 1 if it does not reach it.
    fn fraction_to_bound(&self, i: usize, step: f64) -> f64 {
        if step == 0.0 {
            return f64::INFINITY;
        }
        let bound = if step < 0.0 { self.lower[i] } else { self.upper[i] };
        (bound - self.point[i]) / step
    }

    /// `A^T b - A^T A x`, the negative gradient.
    fn descent(&self) -> Vec<f64> {
        let product = self.normal.times(&self.point);
        product.into_iter().enumerate().map(|(i, product)| self.normal.vector(i) - product).collect()
    }

    /// The variable at a bound, not yet tried, with the steepest descent into the box, in units of its column. `None`
    /// if no descent exceeds the rounding error of the gradient.
    fn steepest_at_bound(&self, tried: &[bool]) -> Option<usize> {
        let mut steepest = None;
        let mut largest = 0.0;
        for (i, descent) in self.descent().into_iter().enumerate().filter(|&(i, _)| !tried[i]) {
            let inwards = match self.states[i] {
                BoundState::AtLower if self.lower[i] < self.upper[i] => descent,
                BoundState::AtUpper if self.lower[i] < self.upper[i] => -descent,
                _ => continue,
            };
            let pull = inwards / self.normal.matrix(i, i).sqrt();
            if inwards > self.rounding(i) && pull > largest {
                (steepest, largest) = (Some(i), pull);
            }
        }
        steepest
    }

    /// A bound on the rounding error of component `i` of the gradient.
    fn rounding(&self, i: usize) -> f64 {
        let n = self.point.len();
        let terms: f64 = (0..n).map(|j| (self.normal.matrix(i, j) * self.point[j]).abs()).sum();
        (n + 1) as f64 * f64::EPSILON * (self.normal.vector(i).abs() + terms)
    }

    /// The decrease of the objective since `point`, where the negative gradient was `descent`.
    fn decrease_since(&self, point: &[f64], descent: &[f64]) -> f64 {
        let step: Vec<f64> = self.point.iter().zip(point).map(|(new, old)| new - old).collect();
        let curved = self.normal.times(&step);
        (0..step.len()).map(|i| step[i] * (descent[i] - 0.5 * curved[i])).sum()
    }

    fn fix_at_bound(&mut self, i: usize) {
        if self.point[i] == self.lower[i] {
            self.states[i] = BoundState::AtLower;
        } else if self.point[i] == self.upper[i] {
            self.states[i] = BoundState::AtUpper;
        }
    }
}

/// The limit of attempts to free a variable, per square of the number of variables plus one.
const ATTEMPTS: usize = 10;

#[cfg(test)]
mod tests;
