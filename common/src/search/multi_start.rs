//! From many starts to a few minima: the starts of lowest cost that are not close to each other are refined, and close
//! minima are merged.
//!
//! Distances are the largest difference in any scaled coordinate of the box, so 0.01 is a hundredth of a (linear or
//! logarithmic) range. Selection and merging are also functions of their own, for callers that refine in parallel.

use super::bounds::Bounds;
use super::{least_squares, pattern};

/// A start with its cost, e.g. from a scan.
#[derive(Debug, Clone, PartialEq)]
pub struct Start {
    /// A natural point of the box.
    pub point: Vec<f64>,
    /// The objective at the point. A start whose cost is not finite is not selected.
    pub cost: f64,
}

/// The number of starts to refine, and the distances below which points count as the same.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MultiStartOptions {
    /// Largest number of starts to refine.
    pub refine: usize,
    /// A start closer than this to a selected start of lower cost is skipped. 0 skips only equal points.
    pub start_distance: f64,
    /// A minimum closer than this to a lower one is merged into it. 0 merges only equal points.
    pub merge_distance: f64,
}

impl Default for MultiStartOptions {
    /// Six starts, because the scan before them is dense. Starts closer than a twentieth of a range usually lead to the
    /// same minimum. Least squares reproduces a minimum to much better than a thousandth of a range.
    fn default() -> Self {
        Self { refine: 6, start_distance: 0.05, merge_distance: 1e-3 }
    }
}

/// The result of a refinement: a point and its objective.
pub trait Refined {
    /// The natural point.
    fn point(&self) -> &[f64];
    /// The objective at the point.
    fn value(&self) -> f64;
}

impl Refined for pattern::Minimum {
    fn point(&self) -> &[f64] {
        &self.point
    }
    fn value(&self) -> f64 {
        self.value
    }
}

impl Refined for least_squares::Minimum {
    fn point(&self) -> &[f64] {
        &self.point
    }
    fn value(&self) -> f64 {
        self.value
    }
}

/// Refines the best distinct starts in order of cost and returns their distinct minima, the lowest first.
///
/// # Errors
/// The first error of `refine`, if it fails for every start.
pub fn refine_best<M: Refined, E>(
    starts: &[Start],
    bounds: &Bounds,
    options: &MultiStartOptions,
    mut refine: impl FnMut(&Start) -> Result<M, E>,
) -> Result<Vec<M>, E> {
    let selected = select_starts(starts, bounds, options);
    let mut minima = Vec::with_capacity(selected.len());
    let mut failure = None;
    for i in selected {
        match refine(&starts[i]) {
            Ok(minimum) => minima.push(minimum),
            Err(error) => failure = failure.or(Some(error)),
        }
    }
    match failure {
        Some(error) if minima.is_empty() => Err(error),
        _ => Ok(merge_minima(minima, bounds, options.merge_distance)),
    }
}

/// Indices of the starts to refine, by ascending cost; equal costs keep their order, and close starts are skipped.
///
/// # Panics
/// If a start has fewer coordinates than the box.
#[must_use]
pub fn select_starts(starts: &[Start], bounds: &Bounds, options: &MultiStartOptions) -> Vec<usize> {
    let mut order: Vec<usize> = (0..starts.len()).filter(|&i| starts[i].cost.is_finite()).collect();
    order.sort_by(|&a, &b| starts[a].cost.total_cmp(&starts[b].cost));
    let mut selected: Vec<usize> = Vec::with_capacity(options.refine);
    for i in order {
        if selected.len() == options.refine {
            break;
        }
        let is_close = |&other: &usize| is_near(&starts[i].point, &starts[other].point, bounds, options.start_distance);
        if !selected.iter().any(is_close) {
            selected.push(i);
        }
    }
    selected
}

/// Sorts minima by value (equal values keep their order) and drops each that is close to a lower one.
///
/// # Panics
/// If a minimum has fewer coordinates than the box.
#[must_use]
pub fn merge_minima<M: Refined>(mut minima: Vec<M>, bounds: &Bounds, distance: f64) -> Vec<M> {
    minima.sort_by(|a, b| a.value().total_cmp(&b.value()));
    let mut kept: Vec<M> = Vec::with_capacity(minima.len());
    for minimum in minima {
        if !kept.iter().any(|lower| is_near(minimum.point(), lower.point(), bounds, distance)) {
            kept.push(minimum);
        }
    }
    kept
}

fn is_near(a: &[f64], b: &[f64], bounds: &Bounds, distance: f64) -> bool {
    let apart = bounds.scaled_distance(a, b);
    apart < distance || apart == 0.0
}

#[cfg(test)]
mod tests {
    use super::super::pattern::{PatternOptions, minimise};
    use super::*;

    fn start(point: &[f64], cost: f64) -> Start {
        Start { point: point.to_vec(), cost }
    }

    #[test]
    fn starts_of_lowest_cost_are_selected_and_close_or_unusable_ones_skipped() {
        let bounds = Bounds::linear(&[0.0, 0.0], &[1.0, 10.0]).unwrap();
        let starts = [
            start(&[0.5, 5.0], 3.0),
            start(&[0.1, 1.0], f64::NAN),
            start(&[0.9, 9.0], 1.0),
            start(&[0.9, 9.2], 2.0),
            start(&[0.1, 1.0], 3.0),
            start(&[0.2, 2.0], 4.0),
        ];
        let options = MultiStartOptions { refine: 3, start_distance: 0.05, merge_distance: 0.0 };
        assert_eq!(select_starts(&starts, &bounds, &options), [2, 0, 4]);
        let options = MultiStartOptions { refine: 9, start_distance: 0.0, merge_distance: 0.0 };
        assert_eq!(select_starts(&starts, &bounds, &options), [2, 3, 0, 4, 5]);
    }

    #[test]
    fn two_basins_give_two_minima_the_lower_first() {
        // Minima at -1 (value 0.1) and 2 (value 0).
        let f = |x: &[f64]| ((x[0] + 1.0) * (x[0] + 1.0) + 0.1).min((x[0] - 2.0) * (x[0] - 2.0));
        let bounds = Bounds::linear(&[-5.0], &[5.0]).unwrap();
        let starts: Vec<Start> = [-4.0, -1.5, 0.1, 1.0, 4.5].map(|x| start(&[x], f(&[x]))).to_vec();
        let options = MultiStartOptions { refine: 5, ..MultiStartOptions::default() };
        let pattern = PatternOptions { initial_mesh: 0.01, ..PatternOptions::matlab(1) };
        let mut calls = 0;
        let minima = refine_best(&starts, &bounds, &options, |start| {
            calls += 1;
            minimise(f, &start.point, &bounds, &pattern)
        })
        .unwrap();
        assert_eq!((calls, minima.len()), (5, 2));
        assert!((minima[0].point[0] - 2.0).abs() < 1e-4 && (minima[1].point[0] + 1.0).abs() < 1e-4);
        let failed: Result<Vec<pattern::Minimum>, &str> =
            refine_best(&starts, &bounds, &options, |_| Err("no renderer"));
        assert_eq!(failed, Err("no renderer"));
    }
}
