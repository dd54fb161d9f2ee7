//! A projected quasi-Newton search for a smooth function over a box, when only its values are known.
//!
//! BFGS (Nocedal & Wright, *Numerical Optimization*, 2nd ed. 2006, section 6.1) on the free coordinates, in the box's scaled
//! coordinates, in which a step of the same length means about as much in every parameter. A coordinate at a bound is not free while the
//! function falls towards the outside (Bertsekas, *Projected Newton Methods*, SIAM J. Control Optim. 20(2), 1982). Steps are
//! projected onto the box and shortened, along a parabola, until they decrease the function enough (Armijo). Derivatives are one-sided differences, whose
//! values may be computed at the same time; once nothing decreases along them any more, they are central ones.
//!
//! It takes a few iterations of one evaluation per parameter each, where a pattern search creeps along the narrow valleys that
//! colours and width of a BRDF make.

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

/// What a quasi-Newton search found.
#[derive(Debug, Clone, PartialEq)]
pub struct Minimum {
    /// The best point, inside the box.
    pub point: Vec<f64>,
    /// The objective there, at most its value at the start.
    pub value: f64,
    /// Calls of the objective.
    pub evaluations: usize,
    /// Steps taken.
    pub iterations: usize,
    /// Why the search ended.
    pub termination: Termination,
}

/// Share of the decrease that the slope promises which a step has to bring (Armijo).
const ENOUGH: f64 = 1e-4;

/// A step is shortened at most this often.
const MOST_CUTS: usize = 8;

/// Minimises `objective` over the box from `start`, showing its progress to `observe` after every iteration; `Break` ends the search
/// with the incumbent. Values that are not finite count as worse than any.
///
/// # Errors
/// When the start is outside the box or the objective is not finite there, or an option is out of range.
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
    /// Whether it has learnt nothing yet.
    is_fresh: bool,
    minimum: Minimum,
}

/// How derivatives are taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Differences {
    /// From one value beside the point: cheap, off by half a step's curvature.
    Forward,
    /// From two values around the point.
    Central,
}

impl<F: Fn(&[f64]) -> f64 + Sync> Search<'_, F> {
    fn run(&mut self, observe: &mut dyn FnMut(&Progress<'_>) -> ControlFlow<()>) -> Termination {
        let (mut kind, mut small_steps) = (Differences::Forward, 0);
        let Some(mut gradient) = self.gradient(kind) else { return Termination::MaxEvaluations };
        loop {
            if self.tell(observe).is_break() {
                return Termination::Stopped;
            }
            let before = (self.at.clone(), self.minimum.value);
            match self.step(&gradient) {
                Step::Taken => {}
                Step::OutOfEvaluations => return Termination::MaxEvaluations,
                // What was learnt may mislead; then the differences may.
                Step::None if !self.is_fresh => self.forget(),
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
                self.learn(&before.0, &gradient, &next);
            }
            gradient = next;
        }
    }

    fn tell(&self, observe: &mut dyn FnMut(&Progress<'_>) -> ControlFlow<()>) -> ControlFlow<()> {
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
            // No slope is known where there is no value: leave the coordinate alone.
            if slope.is_finite() { slope } else { 0.0 }
        };
        Some(steps.iter().enumerate().map(slope).collect())
    }

    /// How far below and above the point a coordinate's difference reaches, inside the box; 0 is the point itself.
    fn difference(&self, i: usize, kind: Differences) -> [f64; 2] {
        let ((first, last), h) = (self.bounds.scaled_range(i), self.options.difference);
        let (below, above) = (h.min(self.at[i] - first), h.min(last - self.at[i]));
        // Too near to a bound for a difference that way.
        let [below, above] = [below, above].map(|step| if step < 0.5 * h { 0.0 } else { step });
        match kind {
            Differences::Central => [-below, above],
            Differences::Forward if above > 0.0 => [0.0, above],
            Differences::Forward => [-below, 0.0],
        }
    }

    /// Whether each coordinate may move: those at a bound towards which the function falls may not.
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
        // Without knowledge of the curvature the first step is a short one.
        let reach = if self.is_fresh { 0.25 * self.options.longest_step } else { self.options.longest_step };
        let mut length = if self.is_fresh { reach / longest } else { (reach / longest).min(1.0) };
        for _ in 0..MOST_CUTS {
            if self.minimum.evaluations >= self.options.max_evaluations {
                return Step::OutOfEvaluations;
            }
            let to = |i: usize| {
                let (first, last) = self.bounds.scaled_range(i);
                (self.at[i] + length * direction[i]).clamp(first, last)
            };
            let scaled: Vec<f64> = (0..self.at.len()).map(to).collect();
            let promised: f64 = scaled.iter().zip(&self.at).zip(gradient).map(|((to, at), g)| (to - at) * g).sum();
            let point = self.natural(&scaled);
            let value = (self.objective)(&point);
            self.minimum.evaluations += 1;
            if value < self.minimum.value + ENOUGH * promised.min(0.0) {
                self.at = scaled;
                self.minimum.point = point;
                self.minimum.value = value;
                return Step::Taken;
            }
            // The parabola through value and slope here and the value there.
            let excess = value - self.minimum.value - promised;
            let best = if excess > 0.0 && excess.is_finite() { -0.5 * promised / excess } else { 0.1 };
            length *= best.clamp(0.1, 0.5);
        }
        Step::None
    }

    /// `-H g` on the free coordinates; `-g` where that does not lead down.
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
        self.forget();
        (0..n).map(|i| if free[i] { -gradient[i] } else { 0.0 }).collect()
    }

    fn forget(&mut self) {
        self.inverse = identity(self.at.len());
        self.is_fresh = true;
    }

    /// The BFGS update by the last step.
    fn learn(&mut self, before: &[f64], gradient: &[f64], next: &[f64]) {
        let n = before.len();
        let step: Vec<f64> = self.at.iter().zip(before).map(|(a, b)| a - b).collect();
        let turn: Vec<f64> = next.iter().zip(gradient).map(|(a, b)| a - b).collect();
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let (curvature, size) = (dot(&step, &turn), dot(&turn, &turn));
        // Only what keeps the matrix positive definite is learnt.
        if curvature <= 1e-8 * (dot(&step, &step) * size).sqrt() {
            return;
        }
        if self.is_fresh {
            // The scale of the first matrix (Nocedal & Wright, eq. 6.20).
            self.inverse = identity(n).iter().map(|x| x * curvature / size).collect();
            self.is_fresh = false;
        }
        let turned: Vec<f64> = (0..n).map(|i| dot(&self.inverse[i * n..][..n], &turn)).collect();
        let factor = (1.0 + dot(&turn, &turned) / curvature) / curvature;
        for i in 0..n {
            for j in 0..n {
                self.inverse[i * n + j] +=
                    factor * step[i] * step[j] - (turned[i] * step[j] + step[i] * turned[j]) / curvature;
            }
        }
    }
}

/// What became of an iteration.
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
    fn a_curved_valley_is_followed_to_its_end_in_far_fewer_evaluations_than_by_pattern_search() {
        let bounds = Bounds::linear(&[-2.0, -2.0], &[2.0, 2.0]).unwrap();
        let minimum = found(rosenbrock, &[-1.2, 1.0], &bounds, 1000).unwrap();
        assert!(minimum.value < 1e-5, "{minimum:?}");
        let budget =
            pattern::PatternOptions { max_evaluations: minimum.evaluations, ..pattern::PatternOptions::matlab(2) };
        let rival = pattern::minimise(rosenbrock, &[-1.2, 1.0], &bounds, &budget).unwrap();
        assert!(rival.value > 100.0 * minimum.value, "{rival:?} {minimum:?}");
    }

    #[test]
    fn a_minimum_at_a_bound_is_found_there_and_one_behind_a_bound_on_it() {
        let bounds = Bounds::linear(&[0.0, 0.0], &[1.0, 1.0]).unwrap();
        let bowl = |x: &[f64]| (x[0] + 0.5).powi(2) + (x[1] - 0.3).powi(2) + 0.5 * x[0] * x[1];
        let minimum = found(bowl, &[0.8, 0.9], &bounds, 500).unwrap();
        assert_eq!(minimum.point[0], 0.0);
        assert!((minimum.point[1] - 0.3).abs() < 1e-4, "{minimum:?}");
    }

    #[test]
    fn a_start_at_a_bound_leaves_it_where_the_function_falls_inwards() {
        let bounds = Bounds::new(vec![0.0; 2], vec![1.0; 2], vec![Scale::OffsetLogarithmic; 2]).unwrap();
        let bowl = |x: &[f64]| (x[0] - 0.02).powi(2) + (x[1] - 0.4).powi(2);
        let minimum = found(bowl, &[0.0, 1.0], &bounds, 500).unwrap();
        assert!((minimum.point[0] - 0.02).abs() < 1e-4 && (minimum.point[1] - 0.4).abs() < 1e-4, "{minimum:?}");
    }

    #[test]
    fn limits_are_kept_and_the_end_is_never_worse_than_the_start() {
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
    fn values_that_are_not_finite_are_rejected_points_and_an_error_at_the_start() {
        let bounds = Bounds::linear(&[0.0], &[1.0]).unwrap();
        let cliff = |x: &[f64]| if x[0] < 0.3 { f64::NAN } else { x[0] };
        let minimum = found(cliff, &[0.9], &bounds, 200).unwrap();
        assert!(minimum.point[0] >= 0.3 && minimum.point[0] < 0.35, "{minimum:?}");
        assert!(matches!(found(cliff, &[0.1], &bounds, 200), Err(SearchError::NotFinite { .. })));
        assert!(matches!(found(cliff, &[2.0], &bounds, 200), Err(SearchError::StartOutside { .. })));
        assert!(matches!(found(cliff, &[0.9], &bounds, 0), Err(SearchError::Option { .. })));
    }
}
