//! BVLS: linear least squares with bounds on the variables, for a handful of variables given by their normal equations.
//!
//! Minimises `|A x - b|^2`, that is `x^T (A^T A) x / 2 - (A^T b)^T x` up to constants, over lower <= x <= upper.
//!
//! Source: Stark & Parker, *Bounded-Variable Least-Squares: an Algorithm and Applications* (Computational Statistics
//! 10, 1995). Variables are free or at a bound. Free ones take their unconstrained minimum, going only as far as the
//! first bound on the way, whose variable then stays there. At the minimum of the free ones, the bound variable whose
//! gradient pulls inwards hardest is freed, until none pulls: the Karush-Kuhn-Tucker conditions, sufficient as the
//! problem is convex.
//!
//! Ours differs in two ways. It works on the normal equations (Stark & Parker: a QR factorisation of A), because these
//! are what many pixels sum to. And freeing a variable is undone unless it lowers the objective by a positive amount,
//! measured from the step itself; that rules out cycling, for which they test the sign of one step.
//!
//! A singular `A^T A` is no fault: among equal minima one is returned, dependent variables staying where they were.

use super::error::{SearchError, check_dimension};
use super::normal_equations::NormalEquations;

/// Where a variable stands.
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
    /// The minimum; a variable at a bound equals it to the bit.
    pub point: Vec<f64>,
    /// Where each variable stands.
    pub states: Vec<BoundState>,
}

/// Solves the problem whose `A^T A` and `A^T b` are `normal`, starting from 0 moved into the box. Bounds may be
/// infinite where `A^T A` is regular.
///
/// # Errors
/// When a bound has the wrong length, a range is empty or NaN, or the normal equations are not finite.
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
    set.settle();
    set.free_while_it_helps();
    Ok(BoundedSolution { point: set.point, states: set.states })
}

/// The iterate: always inside the box, and after [`settle`](Self::settle) at the minimum over its free variables.
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
        (0..set.point.len()).for_each(|i| set.hold_at_bound(i));
        set
    }

    /// Moves the free variables to their minimum, holding at its bound each that meets one on the way.
    fn settle(&mut self) {
        // Every round but the last holds at least one more variable.
        for _ in 0..=self.point.len() {
            let step = self.free_step();
            let fraction = (0..step.len()).map(|i| self.room(i, step[i])).fold(1.0, f64::min);
            for (i, &step) in step.iter().enumerate().filter(|&(_, &step)| step != 0.0) {
                let blocks = fraction < 1.0 && self.room(i, step) <= fraction;
                let bound = if step < 0.0 { self.lower[i] } else { self.upper[i] };
                self.point[i] = if blocks { bound } else { self.point[i] + fraction * step };
                self.point[i] = self.point[i].clamp(self.lower[i], self.upper[i]);
                self.hold_at_bound(i);
            }
            if fraction >= 1.0 {
                return;
            }
        }
    }

    /// Frees bound variables one at a time while that lowers the objective.
    fn free_while_it_helps(&mut self) {
        let n = self.point.len();
        let mut tried = vec![false; n];
        // In exact arithmetic each success reaches a new face of the box; this many of them are never needed in
        // practice, and end the search should rounding make it wander among equal points.
        for _ in 0..SWEEPS * (n + 1) * (n + 1) {
            let Some(i) = self.hardest_pull(&tried) else { return };
            let (point, states, pull) = (self.point.clone(), self.states.clone(), self.descent());
            self.states[i] = BoundState::Free;
            self.settle();
            if self.decrease_since(&point, &pull) > 0.0 {
                tried.fill(false);
            } else {
                (self.point, self.states) = (point, states);
                tried[i] = true;
            }
        }
    }

    /// The unconstrained step to the minimum over the free variables; 0 for the others.
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

    /// The fraction of `step` that variable `i` can take before it meets its bound; more than 1 if it does not.
    fn room(&self, i: usize, step: f64) -> f64 {
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

    /// The untried bound variable with the largest descent into the box, in units of its own column, if any is above
    /// the rounding of its gradient.
    fn hardest_pull(&self, tried: &[bool]) -> Option<usize> {
        let mut hardest = None;
        let mut largest = 0.0;
        for (i, descent) in self.descent().into_iter().enumerate().filter(|&(i, _)| !tried[i]) {
            let inwards = match self.states[i] {
                BoundState::AtLower if self.lower[i] < self.upper[i] => descent,
                BoundState::AtUpper if self.lower[i] < self.upper[i] => -descent,
                _ => continue,
            };
            let pull = inwards / self.normal.matrix(i, i).sqrt();
            if inwards > self.rounding(i) && pull > largest {
                (hardest, largest) = (Some(i), pull);
            }
        }
        hardest
    }

    /// A bound on the rounding error of component `i` of the gradient.
    fn rounding(&self, i: usize) -> f64 {
        let n = self.point.len();
        let terms: f64 = (0..n).map(|j| (self.normal.matrix(i, j) * self.point[j]).abs()).sum();
        (n + 1) as f64 * f64::EPSILON * (self.normal.vector(i).abs() + terms)
    }

    /// How much lower the objective is here than at `point`, where the negative gradient was `descent`.
    fn decrease_since(&self, point: &[f64], descent: &[f64]) -> f64 {
        let step: Vec<f64> = self.point.iter().zip(point).map(|(new, old)| new - old).collect();
        let curved = self.normal.times(&step);
        (0..step.len()).map(|i| step[i] * (descent[i] - 0.5 * curved[i])).sum()
    }

    fn hold_at_bound(&mut self, i: usize) {
        if self.point[i] == self.lower[i] {
            self.states[i] = BoundState::AtLower;
        } else if self.point[i] == self.upper[i] {
            self.states[i] = BoundState::AtUpper;
        }
    }
}

/// Attempts to free a variable, per square of the number of variables.
const SWEEPS: usize = 10;

#[cfg(test)]
mod tests;
