use super::super::bounds::Scale;
use super::super::test_functions::{Degenerate, Exponential, PowellSingular, Rosenbrock, Rows};
use super::*;
use crate::math::elementary::ln;
use crate::math::sampling::{key, uniform};

fn wide(dimension: usize) -> Bounds {
    Bounds::unscaled(&vec![-1e3; dimension], &vec![1e3; dimension]).unwrap()
}

fn solve(problem: &mut dyn LeastSquaresProblem, start: &[f64], bounds: &Bounds) -> Minimum {
    let minimum = minimise(problem, start, bounds, &LeastSquaresOptions::default()).unwrap();
    assert!(bounds.contains(&minimum.point));
    assert_eq!(minimum.value, problem.cost(&minimum.point));
    assert!(minimum.value <= problem.cost(start));
    minimum
}

fn assert_near(minimum: &Minimum, expected: &[f64], tolerance: f64) {
    let distance = minimum.point.iter().zip(expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(distance < tolerance, "{distance:e} from {expected:?}: {minimum:?}");
}

#[test]
fn rosenbrock_is_solved_from_the_classical_start() {
    let minimum = solve(&mut Rosenbrock, &[-1.2, 1.0], &wide(2));
    assert_near(&minimum, &[1.0, 1.0], 1e-9);
    let is_cut_short = matches!(minimum.termination, Termination::MaxEvaluations | Termination::Stopped);
    assert!(!is_cut_short && minimum.evaluations <= 30, "{minimum:?}");
}

#[test]
fn exponential_fit_agrees_with_scipy_free_and_at_bounds() {
    // scipy 1.17.1, least_squares(jac, bounds, xtol = ftol = gtol = 1e-15), from (1, -0.5, 0.7); costs are sums of
    // squares.
    let cases = [
        (
            ([0.0, -5.0, -5.0], [10.0, 0.0, 5.0]),
            [2.487_738_184_276_209, -1.283_761_931_703_788_3, 0.495_998_803_398_617_6],
            0.024_412_150_975_400_77,
        ),
        (
            ([0.0, -1.0, -5.0], [10.0, 0.0, 5.0]),
            [2.637_648_822_378_201_5, -1.0, 0.250_924_587_151_982_85],
            0.062_814_490_547_454_78,
        ),
        (
            ([0.0, -5.0, 0.6], [2.2, 0.0, 5.0]),
            [2.2, -1.458_189_843_725_469_7, 0.682_418_971_068_630_2],
            0.123_092_452_591_941_89,
        ),
    ];
    for ((lower, upper), expected, cost) in cases {
        for bounds in [Bounds::linear(&lower, &upper).unwrap(), Bounds::unscaled(&lower, &upper).unwrap()] {
            let minimum = solve(&mut Exponential, &[1.0, -0.5, 0.7], &bounds);
            assert_near(&minimum, &expected, 1e-6);
            assert!((minimum.value - cost).abs() < 1e-12 * cost, "{minimum:?}");
            // The residuals of the last case are too large for quadratic convergence; scipy needs 38 evaluations.
            assert!(minimum.evaluations <= 30, "{minimum:?}");
        }
    }
}

#[test]
fn a_coordinate_with_its_minimum_at_a_bound_equals_it_and_can_leave_bounds() {
    let bounds = Bounds::linear(&[0.0, -1.0, -5.0], &[10.0, 0.0, 5.0]).unwrap();
    let minimum = solve(&mut Exponential, &[1.0, -0.5, 0.7], &bounds);
    assert_eq!(minimum.point[1], -1.0);
    assert_eq!(minimum.states, [BoundState::Free, BoundState::AtLower, BoundState::Free]);
    // From the opposite corner, where every coordinate starts at a bound.
    let from_corner = solve(&mut Exponential, &[10.0, 0.0, -5.0], &bounds);
    assert_near(&from_corner, &minimum.point, 1e-6);
    assert_eq!(from_corner.point[1], -1.0);
}

#[test]
fn bounded_rosenbrock_agrees_with_scipy() {
    // scipy 1.17.1, least_squares with bounds ([-2, -2], [2, 0.1]); sum of squares 0.45667450749854827.
    let bounds = Bounds::linear(&[-2.0, -2.0], &[2.0, 0.1]).unwrap();
    let minimum = solve(&mut Rosenbrock, &[-1.2, 0.0], &bounds);
    assert_near(&minimum, &[0.331_769_080_531_135_9, 0.1], 1e-7);
    assert_eq!(minimum.point[1], 0.1);
    assert!((minimum.value - 0.456_674_507_498_548_27).abs() < 1e-13);
}

#[test]
fn a_singular_jacobian_at_the_minimum_slows_the_search_but_does_not_stop_it() {
    let bounds = Bounds::linear(&[-4.0; 4], &[4.0; 4]).unwrap();
    let minimum = solve(&mut PowellSingular, &[3.0, -1.0, 0.0, 1.0], &bounds);
    // Linear convergence: each step halves the distance and divides the cost by 16, until the minimum damping limits
    // it.
    assert!(minimum.value < 1e-22, "{minimum:?}");
    assert!(minimum.point.iter().all(|x| x.abs() < 1e-5), "{minimum:?}");
}

#[test]
fn parameters_that_the_residuals_do_not_distinguish_do_not_stop_the_search() {
    let bounds = Bounds::linear(&[0.0, 0.0, 0.0], &[1.0, 2.0, 1.0]).unwrap();
    for weak in [0.0, 1e-9, 1e-2] {
        let minimum = solve(&mut Degenerate { weak }, &[0.3, 0.3, 0.3], &bounds);
        assert!(minimum.value < 1e-20, "{weak}: {minimum:?}");
        assert!((minimum.point[1] * minimum.point[2] - 0.06).abs() < 1e-9 && (minimum.point[0] - 0.4).abs() < 1e-9);
        assert!(minimum.evaluations <= 20, "{weak}: {minimum:?}");
        let variances = minimum.normal.variances(&[true; 3]);
        assert!(variances[0].is_finite());
        assert_eq!(variances[1].is_infinite(), weak < 1e-6, "{weak}: {variances:?}");
    }
    // With 1e-5 the valley is narrow and curved. The search advances slowly and ends at the limit of evaluations.
    let slow = solve(&mut Degenerate { weak: 1e-5 }, &[0.3, 0.3, 0.3], &bounds);
    assert_eq!(slow.termination, Termination::MaxEvaluations);
    assert!(slow.value < 1e-12, "{slow:?}");
}

#[test]
fn same_inputs_give_the_same_bits() {
    let bounds = Bounds::linear(&[0.0, -5.0, 0.6], &[2.2, 0.0, 5.0]).unwrap();
    let runs = [(); 2].map(|()| solve(&mut Exponential, &[1.0, -0.5, 0.7], &bounds));
    assert_eq!(runs[0], runs[1]);
    let bits = |minimum: &Minimum| minimum.point.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(&runs[0]), bits(&runs[1]));
}

/// The residuals `ln(x) - ln(0.02)` and `y - 3`; the cost or the Jacobian is NaN where y exceeds a limit.
struct PartlyNan {
    cost_limit: f64,
    jacobian_limit: f64,
}

impl Rows for PartlyNan {
    const DIMENSION: usize = 2;
    fn rows(&self, x: &[f64]) -> Vec<(Vec<f64>, f64)> {
        let cost = if x[1] > self.cost_limit { f64::NAN } else { ln(x[0]) - ln(0.02) };
        let slope = if x[1] > self.jacobian_limit { f64::NAN } else { 1.0 / x[0] };
        vec![(vec![slope, 0.0], cost), (vec![0.0, 1.0], x[1] - 3.0)]
    }
}

#[test]
fn logarithmic_scale_makes_a_logarithmic_residual_linear() {
    let scales = vec![Scale::Logarithmic, Scale::Linear];
    let bounds = Bounds::new(vec![1e-4, 0.0], vec![1.0, 10.0], scales).unwrap();
    let mut problem = PartlyNan { cost_limit: f64::INFINITY, jacobian_limit: f64::INFINITY };
    let minimum = solve(&mut problem, &[0.9, 9.0], &bounds);
    assert_near(&minimum, &[0.02, 3.0], 1e-10);
    // The model is exact and only the damping slows it. The natural scale needs more steps.
    let natural = solve(&mut problem, &[0.9, 9.0], &Bounds::linear(&[1e-4, 0.0], &[1.0, 10.0]).unwrap());
    assert!(minimum.evaluations < natural.evaluations, "{} {}", minimum.evaluations, natural.evaluations);
    // The normal equations are those of the natural parameters.
    assert!((minimum.normal.matrix(0, 0) * 0.02 * 0.02 - 1.0).abs() < 1e-9);
}

#[test]
fn a_point_that_is_not_finite_is_rejected_and_a_start_that_is_not_finite_is_an_error() {
    let bounds = Bounds::linear(&[1e-4, 0.0], &[1.0, 10.0]).unwrap();
    for (cost_limit, jacobian_limit) in [(2.5, f64::INFINITY), (f64::INFINITY, 2.5)] {
        let mut problem = PartlyNan { cost_limit, jacobian_limit };
        let minimum = solve(&mut problem, &[0.9, 0.5], &bounds);
        // The values end below the minimum in y: the search stops near the limit.
        assert!(minimum.point[1] <= 2.5 && minimum.point[1] > 2.0, "{minimum:?}");
        let refused = minimise(&mut problem, &[0.9, 9.0], &bounds, &LeastSquaresOptions::default());
        assert!(matches!(refused, Err(SearchError::NotFinite { .. })), "{refused:?}");
    }
}

#[test]
fn every_termination_reason_is_reached() {
    let bounds = Bounds::linear(&[0.0, -5.0, -5.0], &[10.0, 0.0, 5.0]).unwrap();
    let never = LeastSquaresOptions {
        gradient_tolerance: 0.0,
        step_tolerance: 0.0,
        cost_tolerance: 0.0,
        ..LeastSquaresOptions::default()
    };
    let end = |options: &LeastSquaresOptions| minimise(&mut Exponential, &[1.0, -0.5, 0.7], &bounds, options).unwrap();
    let gradient = end(&LeastSquaresOptions { gradient_tolerance: 1e-4, ..never.clone() });
    assert_eq!(gradient.termination, Termination::GradientTolerance);
    let step = end(&LeastSquaresOptions { step_tolerance: 1e-3, ..never.clone() });
    assert_eq!(step.termination, Termination::StepTolerance);
    let function = end(&LeastSquaresOptions { cost_tolerance: 1e-4, ..never.clone() });
    assert_eq!(function.termination, Termination::FunctionTolerance);
    for budget in [1, 2, 4] {
        let cut = end(&LeastSquaresOptions { max_evaluations: budget, ..never.clone() });
        assert_eq!((cut.termination, cut.evaluations), (Termination::MaxEvaluations, budget));
    }
    // Without tolerances the search ends at the rounding error of the cost.
    assert!(end(&never).value <= gradient.value);
}

#[test]
fn the_observer_is_called_after_every_evaluation_and_can_stop_the_search() {
    let mut seen = Vec::new();
    let mut observe = |progress: &Progress<'_>| {
        seen.push(progress.value);
        if seen.len() == 4 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let options = LeastSquaresOptions::default();
    let stopped = minimise_observed(&mut Rosenbrock, &[-1.2, 1.0], &wide(2), &options, &mut observe).unwrap();
    assert_eq!((stopped.termination, stopped.evaluations), (Termination::Stopped, 4));
    assert!(seen.windows(2).all(|pair| pair[1] <= pair[0]) && seen[3] == stopped.value);
}

#[test]
fn faulty_inputs_are_refused() {
    let options = LeastSquaresOptions::default();
    let refused = minimise(&mut Rosenbrock, &[0.0; 3], &wide(3), &options);
    assert!(matches!(refused, Err(SearchError::Dimension { expected: 3, found: 2, .. })));
    let refused = minimise(&mut Rosenbrock, &[0.0, 2e3], &wide(2), &options);
    assert!(matches!(refused, Err(SearchError::StartOutside { index: 1, .. })));
    let options = LeastSquaresOptions { initial_damping: 0.0, ..options };
    assert!(matches!(minimise(&mut Rosenbrock, &[0.0; 2], &wide(2), &options), Err(SearchError::Option { .. })));
}

#[test]
fn a_minimum_in_a_corner_with_a_fixed_parameter_ends_by_the_gradient() {
    // The gradient points out of the box at the corner (0.2, 0.1, 1).
    let bounds = Bounds::linear(&[0.0, 0.0, 1.0], &[0.2, 0.1, 1.0]).unwrap();
    let minimum = solve(&mut Degenerate { weak: 0.0 }, &[0.1, 0.02, 1.0], &bounds);
    assert_eq!(minimum.point[2], 1.0);
    assert_eq!(minimum.point[0], 0.2);
    assert_eq!(minimum.termination, Termination::GradientTolerance);
}

/// `A x - b` of pseudo-random numbers in [-1, 1], ten rows.
struct Linear {
    seed: u64,
}

impl Rows for Linear {
    const DIMENSION: usize = 7;
    fn rows(&self, x: &[f64]) -> Vec<(Vec<f64>, f64)> {
        let number = |i: u64, j: u64| 2.0 * uniform(key(&[self.seed, i, j])) - 1.0;
        (0..10)
            .map(|i| {
                let row: Vec<f64> = (0..7).map(|j| number(i, j)).collect();
                let value: f64 = row.iter().zip(x).map(|(a, x)| a * x).sum();
                (row, value - 2.0 * number(i, 7))
            })
            .collect()
    }
}

#[test]
fn linear_problems_end_at_the_solution_of_bvls_from_anywhere_in_the_box() {
    let bounds = Bounds::linear(&[-0.3; 7], &[0.4; 7]).unwrap();
    let mut at_bounds = 0;
    for seed in 0..40 {
        let mut problem = Linear { seed };
        let start: Vec<f64> = (0..7).map(|i| bounds.to_natural(i, uniform(key(&[seed, 99, i as u64])))).collect();
        let minimum = solve(&mut problem, &start, &bounds);
        let mut normal = NormalEquations::new(7);
        problem.rows(&[0.0; 7]).iter().for_each(|(row, residual)| normal.add_row(row, -residual));
        let expected = bvls::solve(&normal, bounds.lower(), bounds.upper()).unwrap();
        assert_eq!(minimum.states, expected.states, "{seed}");
        assert_near(&minimum, &expected.point, 1e-7);
        at_bounds += minimum.states.iter().filter(|&&state| state != BoundState::Free).count();
    }
    assert!((40..240).contains(&at_bounds), "{at_bounds} of 280 coordinates at bounds");
}

#[test]
fn damping_follows_the_gain_by_nielsens_rule() {
    let mut damping = Damping { mu: 1.0, growth: 2.0 };
    damping.tighten();
    damping.tighten();
    damping.tighten();
    assert_eq!((damping.mu, damping.growth), (2.0 * 4.0 * 8.0, 16.0));
    // A gain of 1/2 keeps the damping, 1/4 raises it by 1/8, and 1 divides it by 3.
    damping.relax(0.5);
    assert_eq!((damping.mu, damping.growth), (64.0, 2.0));
    damping.relax(0.25);
    assert_eq!(damping.mu, 72.0);
    damping.relax(1.0);
    assert_eq!(damping.mu, 72.0 * (1.0 / 3.0));
    (0..100).for_each(|_| damping.relax(1.0));
    assert_eq!(damping.mu, MIN_DAMPING);
}
