use super::super::test_functions::rosenbrock;
use super::*;
use crate::math::elementary::sin_cos;

/// Runs a search and records every point at which the objective is evaluated.
fn recorded(
    f: impl Fn(&[f64]) -> f64,
    start: &[f64],
    bounds: &Bounds,
    options: &PatternOptions,
) -> (Minimum, Vec<Vec<f64>>) {
    let mut seen = Vec::new();
    let minimum = minimise(
        |x| {
            seen.push(x.to_vec());
            f(x)
        },
        start,
        bounds,
        options,
    )
    .unwrap();
    (minimum, seen)
}

fn wide(dimension: usize) -> Bounds {
    Bounds::unscaled(&vec![-1e6; dimension], &vec![1e6; dimension]).unwrap()
}

fn unit_box(dimension: usize) -> Bounds {
    Bounds::linear(&vec![0.0; dimension], &vec![1.0; dimension]).unwrap()
}

fn iterations(dimension: usize, max_iterations: usize) -> PatternOptions {
    PatternOptions { max_iterations, ..PatternOptions::matlab(dimension) }
}

/// `ps_example` of the Global Optimization Toolbox. The page "How Pattern Search Polling Works" lists its first
/// iterations (unscaled mesh, start (2.1, 1.7)).
fn ps_example(x: &[f64]) -> f64 {
    let side = x[1].abs();
    side + match x[0] {
        a if a < -5.0 => (a + 5.0) * (a + 5.0),
        a if a < -3.0 => -2.0 * sin_cos(a).0,
        a if a < 0.0 => 0.5 * a + 2.0,
        a => 0.3 * a.sqrt() + 2.5,
    }
}

#[test]
fn iterations_are_those_that_matlab_documents() {
    let start = [2.1, 1.7];
    assert!((ps_example(&start) - 4.6347).abs() < 5e-5);
    let (_, seen) = recorded(ps_example, &start, &wide(2), &iterations(2, 4));
    let expected = [
        // Start. Mesh 1: (3.1, 1.7) and (2.1, 2.7) are worse, (1.1, 1.7) is better, and (2.1, 0.7) is not evaluated.
        [2.1, 1.7],
        [3.1, 1.7],
        [2.1, 2.7],
        [1.1, 1.7],
        // Mesh 2, starting from the first direction again.
        [3.1, 1.7],
        [1.1, 3.7],
        [-0.9, 1.7],
        // Mesh 4.
        [3.1, 1.7],
        [-0.9, 5.7],
        [-4.9, 1.7],
        // Mesh 8: all four fail.
        [3.1, 1.7],
        [-4.9, 9.7],
        [-12.9, 1.7],
        [-4.9, -6.3],
    ];
    assert_eq!(seen.len(), expected.len());
    for (seen, expected) in seen.iter().zip(&expected) {
        assert!((seen[0] - expected[0]).abs() + (seen[1] - expected[1]).abs() < 1e-12, "{seen:?} {expected:?}");
    }
    // The values on that page for the three successes.
    for (index, value) in [(3, 4.5146), (6, 3.25), (9, -0.2649)] {
        assert!((ps_example(&seen[index]) - value).abs() < 5e-5);
    }
}

#[test]
fn ps_example_ends_where_matlab_ends() {
    // The documented run: 60 iterations to (-4.712, 0) with value -2, ended by the mesh size.
    let (minimum, _) = recorded(ps_example, &[2.1, 1.7], &wide(2), &PatternOptions::matlab(2));
    assert!((minimum.point[0] + 4.712).abs() < 5e-4 && minimum.point[1].abs() < 1e-5, "{minimum:?}");
    assert!((minimum.value + 2.0).abs() < 1e-5);
    assert_eq!((minimum.iterations, minimum.termination), (60, Termination::MeshTolerance));
}

#[test]
fn a_poll_tries_the_positive_axes_and_then_the_negative_ones() {
    let (minimum, seen) = recorded(|x| if x == [0.0; 3] { 0.0 } else { 1.0 }, &[0.0; 3], &wide(3), &iterations(3, 1));
    let expected =
        [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.], [-1., 0., 0.], [0., -1., 0.], [0., 0., -1.]];
    assert_eq!(seen, expected);
    assert_eq!((minimum.mesh_size, minimum.termination), (0.5, Termination::MaxIterations));
}

#[test]
fn mesh_doubles_after_success_and_halves_after_failure() {
    // Only -x improves: successes at mesh 1, 2 and 4 lead to -7. Then x + 8 and x - 8 fail, and x + 4 and x - 4.
    let (_, seen) = recorded(|x| (x[0] + 7.0).abs(), &[0.0], &wide(1), &iterations(1, 5));
    assert_eq!(seen.concat(), [0.0, 1.0, -1.0, 1.0, -3.0, 1.0, -7.0, 1.0, -15.0, -3.0, -11.0]);
}

#[test]
fn points_outside_the_box_are_neither_evaluated_nor_counted() {
    let bounds = Bounds::unscaled(&[-1.0, 0.0], &[0.5, 3.0]).unwrap();
    let (minimum, seen) = recorded(|x| x[0] * x[0] + x[1], &[0.0, 0.0], &bounds, &iterations(2, 2));
    // Outside the box: (1, 0) and (0, -1) at mesh 1, (0, -1/2) at mesh 1/2.
    assert_eq!(seen, [[0.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.5, 0.0], [0.0, 0.5], [-0.5, 0.0]]);
    assert_eq!(minimum.evaluations, 6);
}

#[test]
fn the_evaluation_limit_is_exact_within_a_poll() {
    for budget in [1, 2, 5, 17] {
        let options = PatternOptions { max_evaluations: budget, ..PatternOptions::matlab(2) };
        let (minimum, seen) = recorded(rosenbrock, &[-1.2, 1.0], &wide(2), &options);
        assert_eq!((seen.len(), minimum.evaluations), (budget, budget));
        assert_eq!(minimum.termination, Termination::MaxEvaluations);
        assert_eq!(minimum.value, rosenbrock(&minimum.point));
    }
}

#[test]
fn every_termination_reason_is_reached() {
    let f = |x: &[f64]| (x[0] - 0.3).abs();
    let end = |options: &PatternOptions| minimise(f, &[0.9], &unit_box(1), options).unwrap().termination;
    let matlab = PatternOptions::matlab(1);
    assert_eq!(end(&matlab), Termination::MeshTolerance);
    assert_eq!(end(&PatternOptions { step_tolerance: 1e-2, ..matlab.clone() }), Termination::StepTolerance);
    // With a range of 1000 units, steps of x are above the tolerance when the scaled mesh is below it.
    let bounds = Bounds::linear(&[0.0], &[1000.0]).unwrap();
    let options = PatternOptions { step_tolerance: 1e-2, function_tolerance: 10.0, ..matlab.clone() };
    let far = minimise(|x: &[f64]| (x[0] - 300.0).abs(), &[900.0], &bounds, &options).unwrap();
    assert_eq!(far.termination, Termination::FunctionTolerance);
    assert_eq!(end(&PatternOptions { max_iterations: 3, ..matlab.clone() }), Termination::MaxIterations);
    assert_eq!(end(&PatternOptions { max_evaluations: 4, ..matlab }), Termination::MaxEvaluations);
}

#[test]
fn the_observer_gets_the_incumbent_after_every_evaluation_and_can_stop_the_search() {
    let mut reports = Vec::new();
    let mut observe = |progress: &Progress<'_>| {
        assert_eq!(progress.value, rosenbrock(progress.point));
        reports.push((progress.evaluations, progress.value));
        if progress.evaluations == 25 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let options = PatternOptions::matlab(2);
    let minimum = minimise_observed(rosenbrock, &[-1.2, 1.0], &wide(2), &options, &mut observe).unwrap();
    assert_eq!((minimum.termination, minimum.evaluations), (Termination::Stopped, 25));
    assert!(reports.iter().map(|report| report.0).eq(1..=25));
    assert!(reports.windows(2).all(|pair| pair[1].1 <= pair[0].1));
    assert_eq!(reports[24].1, minimum.value);
}

#[test]
fn a_point_that_is_not_finite_is_rejected_and_a_start_that_is_not_finite_is_an_error() {
    let options = PatternOptions::matlab(1);
    let refused = minimise(|_| f64::NAN, &[0.5], &unit_box(1), &options);
    assert_eq!(refused, Err(SearchError::NotFinite { what: "the objective", point: vec![0.5] }));
    // NaN or minus infinity below 0.4: the minimum of the finite values is found.
    for invalid in [f64::NAN, f64::NEG_INFINITY] {
        let f = |x: &[f64]| if x[0] < 0.4 { invalid } else { x[0] };
        let minimum = minimise(f, &[0.9], &unit_box(1), &options).unwrap();
        assert!((minimum.point[0] - 0.4).abs() < 2e-6 && minimum.value >= 0.4, "{minimum:?}");
    }
    assert!(matches!(minimise(|x| x[0], &[1.5], &unit_box(1), &options), Err(SearchError::StartOutside { .. })));
    let options = PatternOptions { contraction: 1.0, ..options };
    assert!(matches!(minimise(|x| x[0], &[0.5], &unit_box(1), &options), Err(SearchError::Option { .. })));
}

#[test]
fn smooth_kinked_and_discontinuous_minima_are_found() {
    type Case = (&'static str, fn(&[f64]) -> f64, [f64; 2], f64);
    let cases: [Case; 4] = [
        ("quadratic", |x| (x[0] - 0.3) * (x[0] - 0.3) + 4.0 * (x[1] - 0.7) * (x[1] - 0.7), [0.3, 0.7], 2e-6),
        ("sum of moduli", |x| (x[0] - 0.3).abs() + 2.0 * (x[1] - 0.7).abs(), [0.3, 0.7], 2e-6),
        // Descent along the kink is diagonal, so polling along the axes stops on the kink, at the final mesh size.
        ("largest modulus", |x| (x[0] - 0.3).abs().max(0.1 * (x[1] - 0.7).abs()), [0.3, 0.7], 2e-5),
        ("step", |x| (x[0] - 0.3).abs() + if x[1] < 0.6 { 1.0 } else { x[1] }, [0.3, 0.6], 2e-6),
    ];
    for (name, f, expected, tolerance) in cases {
        let minimum = minimise(f, &[0.9, 0.9], &unit_box(2), &PatternOptions::matlab(2)).unwrap();
        let distance = (minimum.point[0] - expected[0]).abs().max((minimum.point[1] - expected[1]).abs());
        assert!(distance < tolerance, "{name}: {minimum:?}");
    }
}

#[test]
fn rosenbrock_is_descended_in_two_and_four_dimensions() {
    // The search is slow, because the valley is not along an axis. Hence a high limit of evaluations and a tolerance of
    // 1e-4.
    for dimension in [2, 4] {
        let start: Vec<f64> = (0..dimension).map(|i| if i % 2 == 0 { -1.2 } else { 1.0 }).collect();
        let options = PatternOptions {
            mesh_tolerance: 1e-8,
            step_tolerance: 0.0,
            max_iterations: 100_000,
            max_evaluations: 400_000,
            ..PatternOptions::matlab(dimension)
        };
        let minimum = minimise(rosenbrock, &start, &wide(dimension), &options).unwrap();
        let distance = minimum.point.iter().map(|x| (x - 1.0).abs()).fold(0.0, f64::max);
        assert!(distance < 1e-4, "{minimum:?}");
        assert_eq!(minimum.termination, Termination::MeshTolerance);
    }
}

#[test]
fn a_minimum_at_a_bound_is_approached_from_inside_the_box() {
    let bounds = Bounds::new(
        vec![-2.0, 0.005],
        vec![2.0, 1.0],
        vec![super::super::Scale::Linear, super::super::Scale::Logarithmic],
    )
    .unwrap();
    let f = |x: &[f64]| {
        assert!(bounds.contains(x), "{x:?}");
        x[0] + x[1]
    };
    let minimum = minimise(f, &[0.37, 0.3], &bounds, &PatternOptions::matlab(2)).unwrap();
    assert!(minimum.point[0] + 2.0 < 8e-6 && minimum.point[1] - 0.005 < 1e-7, "{minimum:?}");
    // A step that reaches a bound is equal to it to the bit.
    let exact = minimise(f, &[0.0, 1.0], &bounds, &PatternOptions::matlab(2)).unwrap();
    assert_eq!(exact.point, [-2.0, 0.005]);
}

#[test]
fn a_fixed_parameter_is_not_polled() {
    let bounds = Bounds::linear(&[0.0, 0.4], &[1.0, 0.4]).unwrap();
    let options = PatternOptions::matlab(2);
    let (minimum, seen) = recorded(|x| (x[0] - 0.25).abs() + x[1], &[1.0, 0.4], &bounds, &options);
    assert!(seen.iter().all(|x| x[1] == 0.4));
    assert_eq!(minimum.point, [0.25, 0.4]);
}
