//! A projected quasi-Newton search for a smooth function over a box, without derivatives.
//!
//! BFGS (Nocedal & Wright, *Numerical Optimization*, 2nd ed. 2006, section 6.1) on the free coordinates, in the box's
//! scaled coordinates, where equal steps have about equal effect in every parameter. A coordinate at a bound is not
//! free while the function decreases towards the outside (Bertsekas, *Projected Newton Methods*, SIAM J. Control Optim.
//! 20(2), 1982). Steps are projected onto the box and shortened, by a parabola, until they decrease the function enough
//! (Armijo). Derivatives are one-sided differences, evaluated in parallel. When no step along them decreases the
//! function, the search continues with central differences.
//!
//! It needs a few iterations of one evaluation per parameter. A pattern search advances slowly in the narrow valleys
//! that colours and width of a BRDF form.

use super::bounds::Bounds;
use super::error::{SearchError, check_option};
use super::termination::{Progress, Termination};
use rayon::prelude::*;
use std::ops::ControlFlow;

/// Settings of a quasi-Newton search.
#[derive(Debug, Clone, PartialEq)]
pub struct QuasiNewtonOptions {
    /// Step of the differences, in scaled coordinates, in (0, 0.1].
    pub difference: f64,
    /// Longest step of an iteration in any scaled coordinate, above 0.
    pub longest_step: f64,
    /// The search ends when two iterations in a row decrease the function by less than this, at least 0.
    pub function_tolerance: f64,
    /// Largest number of evaluations, the start included, at least 1.
    pub max_evaluations: usize,
}

impl Default for QuasiNewtonOptions {
    fn default() -> Self {
        Self { difference: 1e-3, longest_step: 0.2, function_tolerance: 1e-5, max_evaluations: 300 }
    }
}

impl QuasiNewtonOptions {
    fn check(&self) -> Result<(), SearchError> {
        let inside = self.difference > 0.0 && self.difference <= 0.1;
        check_option("difference", self.difference, inside, "a number above 0 and at most 0.1")?;
        check_option("longest_step", self.longest_step, self.longest_step > 0.0, "a number above 0")?;
        let tolerance = self.function_tolerance;
        check_option("function_tolerance", tolerance, tolerance >= 0.0, "a number of at least 0")?;
        check_option("max_evaluations", self.max_evaluations as f64, self.max_evaluations > 0, "at least 1")
    }
}

/// The result of a quasi-Newton search.
#[derive(Debug, Clone, PartialEq)]
pub struct Minimum {
    /// The best point, inside the box.
    pub point: Vec<f64>,
    /// The objective at the point, at most its value at the start.
    pub value: f64,
    /// Number of calls of the objective.
    pub evaluations: usize,
    /// Number of steps taken.
    pub iterations: usize,
    /// Why the search ended.
    pub termination: Termination,
}

/// The fraction of the decrease predicted by the slope that a step must achieve (Armijo).
const ARMIJO: f64 = 1e-4;

/// The most times that a step is shortened.
const MAX_SHORTENINGS: usize = 8;

/// Minimises `objective` over the box from `start`, a point of the box. It calls `observe` after every iteration;
/// `Break` ends the search with the incumbent. A point whose value is not finite is rejected.
///
/// # Errors
/// If the start is outside the box, the objective is not finite at the start, or an option is out of range.
pub fn minimise(
    objective: impl Fn(&[f64]) -> f64 + Sync,
    start: &[f64],
    bounds: &Bounds,
    options: &QuasiNewtonOptions,
    observe: &mut dyn FnMut(&Progress<'_>) -> ControlFlow<()>,
) -> Result<Minimum, SearchError> {
    options.check()?;
    bounds.check_start(start)?;
    let value = objective(start);
    if !value.is_finite() {
        return Err(SearchError::NotFinite { what: "the objective", point: start.to_vec() });
    }
    let n = start.len();
    let mut search = Search {
        objective,
        bounds,
        options,
        at: (0..n).map(|i| bounds.to_scaled(i, start[i])).collect(),
        inverse: identity(n),
        is_fresh: true,
        minimum: Minimum {
            point: start.to_vec(),
            value,
            evaluations: 1,
            iterations: 0,
            termination: Termination::Stopped,
        },
    };
    search.minimum.termination = search.run(observe);
    Ok(search.minimum)
}

struct Search<'a, F> {
    objective: F,
    bounds: &'a Bounds,
    options: &'a QuasiNewtonOptions,
    /// The incumbent in scaled coordinates.
    at: Vec<f64>,
    /// Approximation of the inverse Hessian, rows of `n`.
    inverse: Vec<f64>,
    /// Whether `inverse` is the identity, with no curvature measured yet.
    is_fresh: bool,
    minimum: Minimum,
}

/// The kind of differences that approximate derivatives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Differences {
    /// From the point and one value beside it: cheap, with an error of half the step times the second derivative.
    Forward,
    /// From two values around the point.
    Central,
}

impl<F: Fn(&[f64]) -> f64 + Sync> Search<'_, F> {
    fn run(&mut self, observe: &mut dyn FnMut(&Progress<'_>) -> ControlFlow<()>) -> Termination {
        let (mut kind, mut small_steps) = (Differences::Forward, 0);
        let Some(mut gradient) = self.gradient(kind) else { return Termination::MaxEvaluations };
        loop {
            if self.report(observe).is_break() {
                return Termination::Stopped;
            }
            let before = (self.at.clone(), self.minimum.value);
            match self.step(&gradient) {
                Step::Taken => {}
                Step::OutOfEvaluations => return Termination::MaxEvaluations,
                // First suspect the approximate Hessian, then the one-sided differences.
                Step::None if !self.is_fresh => self.reset_inverse(),
                Step::None if kind == Differences::Forward => kind = Differences::Central,
                Step::None => return Termination::StepTolerance,
            }
            let decrease = before.1 - self.minimum.value;
            self.minimum.iterations += usize::from(decrease > 0.0);
            small_steps =
                if decrease > 0.0 && decrease < self.options.function_tolerance { small_steps + 1 } else { 0 };
            if small_steps == 2 {
                return Termination::FunctionTolerance;
            }
            let Some(next) = self.gradient(kind) else { return Termination::MaxEvaluations };
            if decrease > 0.0 {
                self.update_inverse(&before.0, &gradient, &next);
            }
            gradient = next;
        }
    }

    fn report(&self, observe: &mut dyn FnMut(&Progress<'_>) -> ControlFlow<()>) -> ControlFlow<()> {
        observe(&Progress {
            evaluations: self.minimum.evaluations,
            iterations: self.minimum.iterations,
            value: self.minimum.value,
            point: &self.minimum.point,
        })
    }

    fn natural(&self, scaled: &[f64]) -> Vec<f64> {
        (0..scaled.len()).map(|i| self.bounds.to_natural(i, scaled[i])).collect()
    }

    /// Derivatives by the scaled coordinates; `None` when there are not enough evaluations left.
    fn gradient(&mut self, kind: Differences) -> Option<Vec<f64>> {
        let steps: Vec<[f64; 2]> = (0..self.at.len()).map(|i| self.difference(i, kind)).collect();
        let probes: Vec<(usize, f64)> = steps
            .iter()
            .enumerate()
            .flat_map(|(i, ends)| ends.map(|end| (i, end)))
            .filter(|(_, end)| *end != 0.0)
            .collect();
        if self.minimum.evaluations + probes.len() > self.options.max_evaluations {
            return None;
        }
        self.minimum.evaluations += probes.len();
        let value = |&(i, step): &(usize, f64)| {
            let mut probe = self.minimum.point.clone();
            probe[i] = self.bounds.to_natural(i, self.at[i] + step);
            (self.objective)(&probe)
        };
        let values: Vec<f64> = probes.par_iter().map(value).collect();
        let at = |i: usize, end: f64| {
            let known = probes.iter().position(|probe| *probe == (i, end)).map(|k| values[k]);
            known.unwrap_or(self.minimum.value)
        };
        let slope = |(i, &[low, high]): (usize, &[f64; 2])| {
            let slope = (at(i, high) - at(i, low)) / (high - low);
            // The slope is unknown where a value is not finite: do not move the coordinate.
            if slope.is_finite() { slope } else { 0.0 }
        };
        Some(steps.iter().enumerate().map(slope).collect())
    }

    /// The steps of a coordinate's difference below and above the point, inside the box; 0 stands for the point.
    fn difference(&self, i: usize, kind: Differences) -> [f64; 2] {
        let ((first, last), h) = (self.bounds.scaled_range(i), self.options.difference);
        let (below, above) = (h.min(self.at[i] - first), h.min(last - self.at[i]));
        // A step of less than half the difference is too short to use.
        let [below, above] = [below, above].map(|step| if step < 0.5 * h { 0.0 } else { step });
        match kind {
            Differences::Central => [-below, above],
            Differences::Forward if above > 0.0 => [0.0, above],
            Differences::Forward => [-below, 0.0],
        }
    }

    /// Whether each coordinate is free: not at a bound beyond which the function decreases.
    fn free(&self, gradient: &[f64]) -> Vec<bool> {
        let is_free = |i: usize| {
            let (first, last) = self.bounds.scaled_range(i);
            first < last && !(self.at[i] <= first && gradient[i] > 0.0) && !(self.at[i] >= last && gradient[i] < 0.0)
        };
        (0..self.at.len()).map(is_free).collect()
    }

    /// A step against the gradient that decreases the function enough.
    fn step(&mut self, gradient: &[f64]) -> Step {
        let direction = self.direction(gradient);
        let longest = direction.iter().fold(0.0_f64, |m, d| m.max(d.abs()));
        if longest == 0.0 {
            return Step::None;
        }
        // The first step is short, because the curvature is unknown.
        let reach = if self.is_fresh { 0.25 * self.options.longest_step } else { self.options.longest_step };
        let mut length = if self.is_fresh { reach / longest } else { (reach / longest).min(1.0) };
        for _ in 0..MAX_SHORTENINGS {
            if self.minimum.evaluations >= self.options.max_evaluations {
                return Step::OutOfEvaluations;
            }
            let to = |i: usize| {
                let (first, last) = self.bounds.scaled_range(i);
                (self.at[i] + length * direction[i]).clamp(first, last)
            };
            let scaled: Vec<f64> = (0..self.at.len()).map(to).collect();
            let predicted: f64 = scaled.iter().zip(&self.at).zip(gradient).map(|((to, at), g)| (to - at) * g).sum();
            let point = self.natural(&scaled);
            let value = (self.objective)(&point);
            self.minimum.evaluations += 1;
            if value < self.minimum.value + ARMIJO * predicted.min(0.0) {
                self.at = scaled;
                self.minimum.point = point;
                self.minimum.value = value;
                return Step::Taken;
            }
            // The minimum of the parabola through the value and slope at the incumbent and the value at the trial
            // point.
            let excess = value - self.minimum.value - predicted;
            let best = if excess > 0.0 && excess.is_finite() { -0.5 * predicted / excess } else { 0.1 };
            length *= best.clamp(0.1, 0.5);
        }
        Step::None
    }

    /// `-H g` on the free coordinates, or `-g` if that is not a descent direction.
    fn direction(&mut self, gradient: &[f64]) -> Vec<f64> {
        let (n, free) = (gradient.len(), self.free(gradient));
        let newton = |i: usize| {
            let row = &self.inverse[i * n..][..n];
            if free[i] { -(0..n).filter(|&j| free[j]).map(|j| row[j] * gradient[j]).sum::<f64>() } else { 0.0 }
        };
        let direction: Vec<f64> = (0..n).map(newton).collect();
        let slope: f64 = direction.iter().zip(gradient).map(|(d, g)| d * g).sum();
        if slope < 0.0 {
            return direction;
        }
        self.reset_inverse();
        (0..n).map(|i| if free[i] { -gradient[i] } else { 0.0 }).collect()
    }

    fn reset_inverse(&mut self) {
        self.inverse = identity(self.at.len());
        self.is_fresh = true;
    }

    /// The BFGS update by the last step.
    fn update_inverse(&mut self, before: &[f64], gradient: &[f64], next: &[f64]) {
        let n = before.len();
        let step: Vec<f64> = self.at.iter().zip(before).map(|(a, b)| a - b).collect();
        let gradient_change: Vec<f64> = next.iter().zip(gradient).map(|(a, b)| a - b).collect();
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let (curvature, size) = (dot(&step, &gradient_change), dot(&gradient_change, &gradient_change));
        // Skip an update that would not keep the matrix positive definite.
        if curvature <= 1e-8 * (dot(&step, &step) * size).sqrt() {
            return;
        }
        if self.is_fresh {
            // The scale of the first matrix (Nocedal & Wright, eq. 6.20).
            self.inverse = identity(n).iter().map(|x| x * curvature / size).collect();
            self.is_fresh = false;
        }
        let scaled_change: Vec<f64> = (0..n).map(|i| dot(&self.inverse[i * n..][..n], &gradient_change)).collect();
        let factor = (1.0 + dot(&gradient_change, &scaled_change) / curvature) / curvature;
        for i in 0..n {
            for j in 0..n {
                self.inverse[i * n + j] +=
                    factor * step[i] * step[j] - (scaled_change[i] * step[j] + step[i] * scaled_change[j]) / curvature;
            }
        }
    }
}

/// The outcome of a step.
enum Step {
    Taken,
    None,
    OutOfEvaluations,
}

fn identity(n: usize) -> Vec<f64> {
    (0..n * n).map(|k| if k % (n + 1) == 0 { 1.0 } else { 0.0 }).collect()
}

#[cfg(test)]
mod tests {
    use super::super::{bounds::Scale, pattern, test_functions::rosenbrock};
    use super::*;

    fn found(
        objective: impl Fn(&[f64]) -> f64 + Sync,
        start: &[f64],
        bounds: &Bounds,
        max_evaluations: usize,
    ) -> Result<Minimum, SearchError> {
        let options =
            QuasiNewtonOptions { difference: 1e-5, function_tolerance: 1e-12, max_evaluations, longest_step: 0.2 };
        minimise(objective, start, bounds, &options, &mut |_| ControlFlow::Continue(()))
    }

    #[test]
    fn a_curved_valley_takes_far_fewer_evaluations_than_with_pattern_search() {
        let bounds = Bounds::linear(&[-2.0, -2.0], &[2.0, 2.0]).unwrap();
        let minimum = found(rosenbrock, &[-1.2, 1.0], &bounds, 1000).unwrap();
        assert!(minimum.value < 1e-5, "{minimum:?}");
        let budget =
            pattern::PatternOptions { max_evaluations: minimum.evaluations, ..pattern::PatternOptions::matlab(2) };
        let other = pattern::minimise(rosenbrock, &[-1.2, 1.0], &bounds, &budget).unwrap();
        assert!(other.value > 100.0 * minimum.value, "{other:?} {minimum:?}");
    }

    #[test]
    fn a_minimum_outside_the_box_is_found_on_the_bound() {
        let bounds = Bounds::linear(&[0.0, 0.0], &[1.0, 1.0]).unwrap();
        let bowl = |x: &[f64]| (x[0] + 0.5).powi(2) + (x[1] - 0.3).powi(2) + 0.5 * x[0] * x[1];
        let minimum = found(bowl, &[0.8, 0.9], &bounds, 500).unwrap();
        assert_eq!(minimum.point[0], 0.0);
        assert!((minimum.point[1] - 0.3).abs() < 1e-4, "{minimum:?}");
    }

    #[test]
    fn a_start_at_a_bound_leaves_it_if_the_function_decreases_inwards() {
        let bounds = Bounds::new(vec![0.0; 2], vec![1.0; 2], vec![Scale::OffsetLogarithmic; 2]).unwrap();
        let bowl = |x: &[f64]| (x[0] - 0.02).powi(2) + (x[1] - 0.4).powi(2);
        let minimum = found(bowl, &[0.0, 1.0], &bounds, 500).unwrap();
        assert!((minimum.point[0] - 0.02).abs() < 1e-4 && (minimum.point[1] - 0.4).abs() < 1e-4, "{minimum:?}");
    }

    #[test]
    fn limits_are_kept_and_the_result_is_no_worse_than_the_start() {
        let bounds = Bounds::linear(&[-2.0, -2.0], &[2.0, 2.0]).unwrap();
        for limit in [1, 2, 3, 7, 20, 50] {
            let minimum = found(rosenbrock, &[-1.2, 1.0], &bounds, limit).unwrap();
            assert!(minimum.evaluations <= limit && minimum.value <= rosenbrock(&[-1.2, 1.0]), "{minimum:?}");
            assert_eq!(minimum.termination, Termination::MaxEvaluations);
            assert_eq!(minimum.value, rosenbrock(&minimum.point));
        }
        let mut seen = 0;
        let mut stop = |_: &Progress<'_>| {
            seen += 1;
            if seen == 3 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let options = QuasiNewtonOptions::default();
        let stopped = minimise(rosenbrock, &[-1.2, 1.0], &bounds, &options, &mut stop).unwrap();
        assert_eq!((stopped.termination, stopped.iterations), (Termination::Stopped, 2));
    }

    #[test]
    fn a_point_that_is_not_finite_is_rejected_and_a_start_that_is_not_finite_is_an_error() {
        let bounds = Bounds::linear(&[0.0], &[1.0]).unwrap();
        let cliff = |x: &[f64]| if x[0] < 0.3 { f64::NAN } else { x[0] };
        let minimum = found(cliff, &[0.9], &bounds, 200).unwrap();
        assert!(minimum.point[0] >= 0.3 && minimum.point[0] < 0.35, "{minimum:?}");
        assert!(matches!(found(cliff, &[0.1], &bounds, 200), Err(SearchError::NotFinite { .. })));
        assert!(matches!(found(cliff, &[2.0], &bounds, 200), Err(SearchError::StartOutside { .. })));
        assert!(matches!(found(cliff, &[0.9], &bounds, 0), Err(SearchError::Option { .. })));
    }
}
