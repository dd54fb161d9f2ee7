//! Finds the start of stage three. Eq. 1 may have no minimum near the lobe of lowest CSSIM: blue acrylic under Eucalyptus Grove gets a
//! wide lobe at every gamma, although CSSIM is a sixth lower with a sharp lobe. So CSSIM is minimised on a coarse picture from a few
//! very different lobes; polish at full resolution starts from the best result.

use super::{
    polish::{Judges, Limits, Polished, polish},
    ranges::Ranges,
    stage_one::paper_start,
    stage_two::FullView,
};
use crate::{
    brdf::{Model, Parameter, main_lobe, offset_of},
    math::elementary::{exp, ln},
    search::{Progress, SearchError, Termination},
};
use std::ops::ControlFlow;

/// Most evaluations of CSSIM on the coarse picture by a search that continues from one of the best trials.
pub(crate) const MAX_EXPLORATIONS: usize = 300;

/// Most evaluations of the trial from each start.
const TRIAL: usize = 80;

/// Decrease of CSSIM below which two iterations in a row end a search. Evaluations cost little here, and save some at full resolution.
const TOLERANCE: f64 = 4e-6;

/// Trials that are continued. A sharp lobe may score worse than a wide one after the trials and better at the end (specular red phenolic
/// under Eucalyptus Grove: .2393 against .2339 after the trials, .2246 against .2322 at the end).
const CONTINUED: usize = 2;

/// The lobes that are tried in addition to the winner's, as widths of GGX.
const WIDTHS: [f64; 2] = [0.03, 0.1];

/// The sharpest lobe that differs visibly from a mirror on a coarse picture, as a width of GGX.
const SHARPEST: f64 = 0.015;

/// Smallest distance of a start from a bound, as a share of the range: a search that starts at a bound may stay there.
const INSIDE: f64 = 0.01;

/// The starts: the winner, the winner with other lobes, and the paper's generic start.
pub(crate) fn starts(model: &dyn Model, ranges: &Ranges, won: &[f64]) -> Vec<Vec<f64>> {
    let (lower, upper) = ranges.bounds(model);
    let width = main_lobe(model).map(|(_, width)| width);
    let with_width = |alpha: f64| {
        let mut start = won.to_vec();
        if let Some(width) = width {
            start[width.entry] = (width.inverse)(width_of(model, alpha));
        }
        start
    };
    let mut starts = vec![won.to_vec()];
    starts.extend(WIDTHS.map(with_width));
    starts.push(paper_start(model));
    for start in &mut starts {
        for (i, x) in start.iter_mut().enumerate() {
            let margin = if width.is_some_and(|width| width.entry == i) { 0.0 } else { INSIDE * (upper[i] - lower[i]) };
            *x = x.clamp(lower[i] + margin, upper[i] - margin);
        }
    }
    // If the width is held, they may be equal.
    let mut distinct: Vec<Vec<f64>> = Vec::new();
    for start in starts {
        if !distinct.contains(&start) {
            distinct.push(start);
        }
    }
    distinct
}

/// The starts of a model that follows another one, whose lobe was found already: the winner with the values that the parameters of the
/// other model have there, and the winner; for a model with more parameters than the other, all its own starts.
pub(crate) fn starts_after(
    model: &dyn Model,
    ranges: &Ranges,
    won: &[f64],
    other: (&dyn Model, &[f64]),
) -> Vec<Vec<f64>> {
    let (lower, upper) = ranges.bounds(model);
    let mut found = won.to_vec();
    for parameter in other.0.parameters() {
        let places = offset_of(model.parameters(), parameter.name).zip(offset_of(other.0.parameters(), parameter.name));
        let Some((to, from)) = places else { continue };
        let count = parameter.channels.count();
        found[to..to + count].copy_from_slice(&other.1[from..from + count]);
    }
    for (x, (lower, upper)) in found.iter_mut().zip(lower.iter().zip(&upper)) {
        *x = x.clamp(*lower, *upper);
    }
    // A richer model may have a better lobe elsewhere (alum bronze under Grace Cathedral with a tail: .0436, from these two starts .0497).
    let is_richer = model.parameters().len() > other.0.parameters().len();
    let own = if is_richer { starts(model, ranges, won) } else { vec![won.to_vec()] };
    std::iter::once(found).chain(own).collect()
}

/// Whether a model has all parameters of another one, with the same names.
pub(crate) fn can_follow(model: &dyn Model, other: &dyn Model) -> bool {
    let has = |p: &Parameter| model.parameters().iter().any(|q| q.name == p.name && q.channels == p.channels);
    other.parameters().iter().all(has)
}

/// Most evaluations in all of an exploration from so many starts.
pub(crate) fn most_evaluations(starts: usize, max_evaluations: usize) -> usize {
    starts * max_evaluations.min(TRIAL) + CONTINUED * max_evaluations
}

/// Searches from every start for a while, continues from the best results, and returns the one of lowest score, the first of equal ones.
///
/// # Errors
/// When no start can be rendered and scored.
pub(crate) fn explore(
    view: &FullView<'_>,
    judges: Judges<'_>,
    starts: &[Vec<f64>],
    (ranges, max_evaluations): (&Ranges, usize),
    observe: &mut dyn FnMut(&Progress<'_>) -> ControlFlow<()>,
) -> Result<Polished, SearchError> {
    let score = |p: &Polished| judges.by.pick(p.cssim, p.cssim_object);
    let mut search = |start: Vec<f64>, evaluations: usize| {
        let limits = Limits { ranges, evaluations: evaluations.min(max_evaluations), tolerance: TOLERANCE };
        polish(view, judges, &[start], limits, &mut *observe)
    };
    let (mut found, mut failure, mut spent) = (Vec::new(), SearchError::NoParameters, 0);
    for start in starts {
        match search(start.clone(), TRIAL) {
            Ok(trial) => {
                spent += trial.evaluations;
                found.push(trial);
            }
            Err(error) => failure = error,
        }
    }
    found.sort_by(|a, b| score(a).total_cmp(&score(b)));
    for trial in found.iter_mut().take(CONTINUED).filter(|trial| trial.termination == Termination::MaxEvaluations) {
        // It ends no worse than it starts; if it fails, the trial stands.
        if let Ok(further) = search(trial.parameters.clone(), max_evaluations) {
            spent += further.evaluations;
            *trial = further;
        }
    }
    let best = found.into_iter().min_by(|a, b| score(a).total_cmp(&score(b))).ok_or(failure)?;
    Ok(Polished { evaluations: spent, ..best })
}

/// The span of widths whose lobes differ visibly on a coarse picture; `None` for a model without widths.
pub(crate) fn explored_span(model: &dyn Model) -> Option<(f64, f64)> {
    span_of_lobes(model, SHARPEST)
}

/// The span of widths whose lobes are at least as wide as that of GGX with this alpha; `None` for a model without widths.
pub(crate) fn span_of_lobes(model: &dyn Model, sharpest: f64) -> Option<(f64, f64)> {
    let widths: Vec<f64> = grid(model)?.into_iter().filter(|(_, alpha)| *alpha >= sharpest).map(|(w, _)| w).collect();
    let (low, high) = (widths.iter().copied().reduce(f64::min)?, widths.iter().copied().reduce(f64::max)?);
    (low < high).then_some((low, high))
}

/// The model's width whose lobe is about as wide as GGX of this alpha.
fn width_of(model: &dyn Model, alpha: f64) -> f64 {
    let distance = |a: f64| (ln(a) - ln(alpha)).abs();
    let nearest = grid(model).unwrap_or_default().into_iter().min_by(|a, b| distance(a.1).total_cmp(&distance(b.1)));
    nearest.map_or(alpha, |(width, _)| width)
}

/// Widths over the model's range, evenly in their logarithm, each with the GGX alpha of its lobe.
fn grid(model: &dyn Model) -> Option<Vec<(f64, f64)>> {
    const STEPS: u32 = 200;
    let (basis, width) = main_lobe(model)?;
    let (low, high) = width.span(model.parameters());
    let width = |i: u32| match i {
        0 => low,
        STEPS => high,
        _ => exp(ln(low) + (ln(high) - ln(low)) * f64::from(i) / f64::from(STEPS)),
    };
    (0..=STEPS).map(|i| Some((width(i), basis.lobe.equivalent_alpha(width(i))?))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::{CookTorrance, Ggx, GgxHaze, MODELS};

    #[test]
    fn starts_are_different_lobes_inside_the_box() {
        let won = vec![0.0, 0.0, 0.3, 2.0, 0.2, 0.0, 0.7, 0.4];
        let mut ranges = Ranges::default();
        let free = starts(&Ggx, &ranges, &won);
        assert_eq!(free.len(), 4);
        assert_eq!(free[0], [0.01, 0.01, 0.3, 1.98, 0.2, 0.02, 0.7, 0.4]);
        assert!((free[1][7] / 0.03 - 1.0).abs() < 0.02 && (free[2][7] / 0.1 - 1.0).abs() < 0.02);
        assert_eq!(free[3], [0.3; 8]);
        ranges.hold(&Ggx, "f90", &[1.0]).unwrap();
        ranges.hold(&Ggx, "alpha", &[0.2]).unwrap();
        let held = starts(&Ggx, &ranges, &won);
        assert!(held.iter().all(|start| start[6..] == [1.0, 0.2]));
        assert_eq!(held.len(), 2, "the winner, and the paper's start");
    }

    #[test]
    fn model_that_follows_starts_from_the_lobe_of_the_other_within_its_ranges() {
        let (won, found) =
            ([0.2, 0.2, 0.2, 0.04, 0.04, 0.04, 1.0, 0.5, 0.15, 0.4], [0.1, 0.1, 0.1, 0.3, 0.2, 0.1, 0.6, 0.05]);
        let starts = starts_after(&GgxHaze, &Ranges::default(), &won, (&Ggx, &found));
        assert_eq!((starts.len(), &starts[0]), (5, &[&found[..], &[0.15, 0.4]].concat()));
        let mut held = Ranges::default();
        held.hold(&Ggx, "f90", &[1.0]).unwrap();
        let starts = starts_after(&Ggx, &held, &won[..8], (&Ggx, &found));
        assert_eq!(starts, [[&found[..6], &[1.0, 0.05]].concat(), won[..8].to_vec()]);
        assert!(can_follow(&GgxHaze, &Ggx) && !can_follow(&Ggx, &GgxHaze) && !can_follow(&CookTorrance, &Ggx));
    }

    #[test]
    fn every_model_has_a_span_to_explore_within_its_bounds() {
        for model in MODELS {
            let (_, width) = main_lobe(*model).unwrap();
            let (lower, upper) = width.span(model.parameters());
            let (low, high) = explored_span(*model).unwrap();
            assert!(lower <= low && low < high && high <= upper, "{}", model.name());
        }
        let (low, high) = explored_span(&Ggx).unwrap();
        assert!((0.015..0.0155).contains(&low) && high == 1.0);
    }
}
