use super::*;
use crate::math::sampling::{key, uniform};

/// The normal equations of m rows in n unknowns, pseudo-random in [-1, 1]. If `dependent`, the last column is a
/// combination of the first two.
fn random_problem(seed: u64, m: usize, n: usize, dependent: bool) -> NormalEquations {
    let number = |i: usize, j: usize| 2.0 * uniform(key(&[seed, i as u64, j as u64])) - 1.0;
    let mut normal = NormalEquations::new(n);
    for i in 0..m {
        let mut row: Vec<f64> = (0..n).map(|j| number(i, j)).collect();
        if dependent {
            row[n - 1] = 2.0 * row[0] - 0.5 * row[1];
        }
        normal.add_row(&row, 3.0 * number(i, n));
    }
    normal
}

fn objective(normal: &NormalEquations, x: &[f64]) -> f64 {
    let product = normal.times(x);
    (0..x.len()).map(|i| x[i] * (0.5 * product[i] - normal.vector(i))).sum()
}

/// The lowest objective over all choices of variables at bounds, solved for the others, of those inside the box.
fn brute_force(normal: &NormalEquations, lower: &[f64], upper: &[f64]) -> f64 {
    let n = lower.len();
    let mut lowest = f64::INFINITY;
    for code in 0..3_usize.pow(u32::try_from(n).unwrap()) {
        let place = |i: usize| code / 3_usize.pow(u32::try_from(i).unwrap()) % 3;
        let mut x: Vec<f64> = (0..n).map(|i| [0.0, lower[i], upper[i]][place(i)]).collect();
        let free: Vec<usize> = (0..n).filter(|&i| place(i) == 0).collect();
        let product = normal.times(&x);
        let rhs: Vec<f64> = free.iter().map(|&i| normal.vector(i) - product[i]).collect();
        for (&i, value) in free.iter().zip(gauss(&free, normal, rhs)) {
            x[i] = value;
        }
        if (0..n).all(|i| (lower[i] - 1e-12..=upper[i] + 1e-12).contains(&x[i])) {
            lowest = lowest.min(objective(normal, &x));
        }
    }
    lowest
}

/// Gaussian elimination with partial pivoting, as an independent reference; NaN if singular.
fn gauss(free: &[usize], normal: &NormalEquations, mut rhs: Vec<f64>) -> Vec<f64> {
    let k = free.len();
    let mut a: Vec<Vec<f64>> = free.iter().map(|&i| free.iter().map(|&j| normal.matrix(i, j)).collect()).collect();
    for p in 0..k {
        let pivot = (p..k).max_by(|&i, &j| a[i][p].abs().total_cmp(&a[j][p].abs())).unwrap();
        a.swap(p, pivot);
        rhs.swap(p, pivot);
        let pivot_row = a[p].clone();
        for i in p + 1..k {
            let factor = a[i][p] / pivot_row[p];
            a[i].iter_mut().zip(&pivot_row).for_each(|(cell, above)| *cell -= factor * above);
            rhs[i] -= factor * rhs[p];
        }
    }
    for p in (0..k).rev() {
        let known: f64 = (p + 1..k).map(|j| a[p][j] * rhs[j]).sum();
        rhs[p] = (rhs[p] - known) / a[p][p];
    }
    rhs
}

/// The largest violation of the optimality conditions, relative to the size of the right-hand side.
fn violation(normal: &NormalEquations, solution: &BoundedSolution, lower: &[f64], upper: &[f64]) -> f64 {
    let product = normal.times(&solution.point);
    let size = (0..lower.len()).map(|i| normal.vector(i).abs() + product[i].abs()).fold(0.0, f64::max);
    let of = |i: usize| {
        let descent = normal.vector(i) - product[i];
        let x = solution.point[i];
        assert!(lower[i] <= x && x <= upper[i]);
        match solution.states[i] {
            BoundState::Free => descent.abs(),
            BoundState::AtLower => {
                assert_eq!(x, lower[i]);
                if lower[i] == upper[i] { 0.0 } else { descent }
            }
            BoundState::AtUpper => {
                assert_eq!(x, upper[i]);
                -descent
            }
        }
    };
    (0..lower.len()).map(of).fold(0.0, f64::max) / size
}

fn random_box(seed: u64, n: usize) -> (Vec<f64>, Vec<f64>) {
    // About a third of the bounds exclude 0, so that the first point is at a bound; widths from 0 (fixed) to 2.
    let middle = |i: usize| 1.5 * (2.0 * uniform(key(&[seed, 77, i as u64])) - 1.0);
    let width = |i: usize| (2.2 * uniform(key(&[seed, 78, i as u64])) - 0.1).max(0.0);
    let lower = (0..n).map(|i| middle(i) - 0.5 * width(i)).collect();
    let upper = (0..n).map(|i| middle(i) + 0.5 * width(i)).collect();
    (lower, upper)
}

#[test]
fn solutions_are_optimal_and_as_low_as_every_active_set() {
    let mut active = 0;
    for n in 1..=6 {
        for seed in 0..60 {
            let normal = random_problem(seed, n + 3, n, false);
            let (lower, upper) = random_box(seed, n);
            let solution = solve(&normal, &lower, &upper).unwrap();
            let violation = violation(&normal, &solution, &lower, &upper);
            assert!(violation < 1e-13, "{n} {seed}: {violation:e}");
            let (found, best) = (objective(&normal, &solution.point), brute_force(&normal, &lower, &upper));
            assert!((found - best).abs() <= 1e-11 * (1.0 + best.abs()), "{n} {seed}: {found} {best}");
            active += solution.states.iter().filter(|&&state| state != BoundState::Free).count();
        }
    }
    // Both free variables and variables at bounds must occur.
    assert!((400..1000).contains(&active), "{active} of 1260 variables at bounds");
}

#[test]
fn dependent_columns_and_fewer_rows_than_unknowns_still_give_a_minimum() {
    for seed in 0..200 {
        let (m, n) = if seed % 2 == 0 { (9, 4) } else { (2, 4) };
        let normal = random_problem(seed, m, n, true);
        let (lower, upper) = random_box(seed, n);
        let solution = solve(&normal, &lower, &upper).unwrap();
        let violation = violation(&normal, &solution, &lower, &upper);
        // Elimination leaves about 1e-15 of the square of a dependent column, so its part of the gradient is accurate
        // to the square root of that.
        assert!(violation < 1e-7, "{seed}: {violation:e}");
    }
}

#[test]
fn eight_variables_with_a_wide_range_of_units_are_solved() {
    for seed in 0..50 {
        let units: Vec<f64> = (0..8).map(|i| [1e-6, 1.0, 1e5][i % 3]).collect();
        let normal = random_problem(seed, 12, 8, false).reparametrised(&units);
        let (lower, upper) = random_box(seed, 8);
        let lower: Vec<f64> = lower.iter().zip(&units).map(|(bound, unit)| bound / unit).collect();
        let upper: Vec<f64> = upper.iter().zip(&units).map(|(bound, unit)| bound / unit).collect();
        let solution = solve(&normal, &lower, &upper).unwrap();
        let in_units = BoundedSolution {
            point: solution.point.iter().zip(&units).map(|(x, unit)| x * unit).collect(),
            states: vec![BoundState::Free; 8],
        };
        let plain = random_problem(seed, 12, 8, false);
        let (lower, upper) = random_box(seed, 8);
        let expected = solve(&plain, &lower, &upper).unwrap();
        assert_eq!(solution.states, expected.states);
        let distance = in_units.point.iter().zip(&expected.point).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(distance < 1e-9, "{seed}: {distance:e}");
    }
}

#[test]
fn agrees_with_scipy() {
    // scipy 1.17.1, lsq_linear(A, b, bounds, method="bvls", tol=1e-15).
    let rows = [
        ([1.0, 2.0, 0.0, 1.0], 1.0),
        ([0.0, 1.0, -1.0, 2.0], 2.0),
        ([2.0, 0.0, 1.0, 1.0], -1.0),
        ([1.0, 1.0, 1.0, -1.0], 3.0),
        ([0.0, 3.0, 1.0, 0.0], 2.0),
        ([-1.0, 1.0, 2.0, 1.0], -2.0),
    ];
    let mut normal = NormalEquations::new(4);
    rows.iter().for_each(|(row, b)| normal.add_row(row, *b));
    let solution = solve(&normal, &[0.0, 0.0, -0.25, 0.0], &[0.5, 1.0, 1.0, 2.0]).unwrap();
    let expected = [0.402_777_777_777_777_7, 0.715_277_777_777_778_1, -0.25, 0.0];
    for (x, expected) in solution.point.iter().zip(expected) {
        assert!((x - expected).abs() < 1e-14, "{:?}", solution.point);
    }
    let states = [BoundState::Free, BoundState::Free, BoundState::AtLower, BoundState::AtLower];
    assert_eq!(solution.states, states);
}

#[test]
fn without_bounds_the_solution_is_the_plain_one_and_without_rows_the_nearest_to_zero() {
    let normal = random_problem(1, 9, 3, false);
    let infinite = [f64::INFINITY; 3];
    let solution = solve(&normal, &infinite.map(|x| -x), &infinite).unwrap();
    let plain = gauss(&[0, 1, 2], &normal, (0..3).map(|i| normal.vector(i)).collect());
    assert!(solution.point.iter().zip(&plain).all(|(a, b)| (a - b).abs() < 1e-12));
    let nothing = solve(&NormalEquations::new(2), &[-1.0, 0.5], &[1.0, 2.0]).unwrap();
    assert_eq!(nothing.point, [0.0, 0.5]);
}

#[test]
fn faulty_inputs_are_refused() {
    let mut normal = random_problem(1, 9, 2, false);
    assert!(matches!(solve(&normal, &[0.0], &[1.0, 1.0]), Err(SearchError::Dimension { .. })));
    assert!(matches!(solve(&normal, &[0.0, 1.0], &[1.0, 0.0]), Err(SearchError::EmptyRange { index: 1, .. })));
    normal.set_matrix(0, 1, f64::NAN);
    assert_eq!(solve(&normal, &[0.0, 0.0], &[1.0, 1.0]), Err(SearchError::NormalNotFinite));
}
